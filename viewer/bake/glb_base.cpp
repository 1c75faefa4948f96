#include "viewer/bake/glb_base.h"

#include <limits>

#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "viewer/camera/orbit_camera.h"
#include "viewer/export/glb_chunks.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;
using glm::dvec2, glm::dvec3, glm::vec3;

constexpr int kFloat = 5126, kWhole = 5125, kVertices = 34962, kIndices = 34963, kLinear = 9729, kTrilinear = 9987,
              kClamped = 33071;

/// The binary chunk and what describes it.
struct Buffer {
    std::string bytes;
    Json views = Json::array(), accessors = Json::array();

    /// Ends what was appended since `from`, and describes it.
    void describe(size_t from, int target, int componentType, const char* type, size_t count) {
        views.push_back({{"buffer", 0}, {"byteOffset", from}, {"byteLength", bytes.size() - from}, {"target", target}});
        accessors.push_back(
            {{"bufferView", views.size() - 1}, {"componentType", componentType}, {"count", count}, {"type", type}});
    }
};

Buffer bufferOf(const meso::BaseSurface& base, const BaseFrames& frames, int size, dvec3 origin) {
    Buffer made;
    const size_t count = frames.vertices.size();
    vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const auto& v : frames.vertices) {
        const vec3 p(base.positions[v.position] - origin);
        low = glm::min(low, p), high = glm::max(high, p);
        for (int k = 0; k < 3; ++k) put(made.bytes, p[k]);
    }
    made.describe(0, kVertices, kFloat, "VEC3", count);
    made.accessors.back()["min"] = {low.x, low.y, low.z};
    made.accessors.back()["max"] = {high.x, high.y, high.z};
    size_t from = made.bytes.size();
    for (const auto& v : frames.vertices)
        for (int k = 0; k < 3; ++k) put(made.bytes, float(v.normal[k]));
    made.describe(from, kVertices, kFloat, "VEC3", count);
    from = made.bytes.size();
    for (const auto& v : frames.vertices) {
        for (int k = 0; k < 3; ++k) put(made.bytes, float(v.tangent[k]));
        put(made.bytes, float(v.side));
    }
    made.describe(from, kVertices, kFloat, "VEC4", count);
    from = made.bytes.size();
    for (const auto& v : frames.vertices) {
        // The middle of a texel is half a texel from its corner, and v runs downwards.
        const dvec2 uv = (v.place + 0.5) / double(size);
        put(made.bytes, float(uv.x));
        put(made.bytes, float(1 - uv.y));
    }
    made.describe(from, kVertices, kFloat, "VEC2", count);
    from = made.bytes.size();
    for (const auto& t : frames.triangles)
        for (const uint32_t corner : t) put(made.bytes, corner);
    made.describe(from, kIndices, kWhole, "SCALAR", 3 * frames.triangles.size());
    return made;
}

Json materialOf(bool hasColour) {
    Json material = {{"normalTexture", {{"index", 0}}},
                     {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
    Json& surface = material["pbrMetallicRoughness"];
    if (hasColour)
        surface["baseColorTexture"] = {{"index", 1}};
    else
        surface["baseColorFactor"] = {0.6, 0.6, 0.6, 1.0};
    return material;
}

}  // namespace

Result<std::string> glbOf(const std::string& name, const meso::BaseSurface& base, const BaseFrames& frames,
                          const BakedMaps& maps) {
    const dvec3 origin = glm::round(Box::of(base.positions).centre());
    const Buffer buffer = bufferOf(base, frames, maps.size, origin);
    const bool hasColour = !maps.light.empty();
    Json images = {{{"uri", "normal.png"}}}, textures = {{{"source", 0}, {"sampler", 0}}};
    if (hasColour) images.push_back({{"uri", "colour.png"}}), textures.push_back({{"source", 1}, {"sampler", 0}});
    const Json json = {
        {"asset",
         {{"version", "2.0"},
          {"generator", "vcp"},
          {"extras",
           {{"displacement", "displacement.png"},
            {"displacement_offset", maps.displacement.offset},
            {"displacement_range", maps.displacement.range}}}}},
        {"scene", 0},
        {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"mesh", 0}, {"name", name}, {"translation", {origin.x, origin.y, origin.z}}}}},
        {"meshes",
         {{{"primitives",
            {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TANGENT", 2}, {"TEXCOORD_0", 3}}},
              {"indices", 4},
              {"material", 0}}}}}}},
        {"materials", {materialOf(hasColour)}},
        {"textures", textures},
        {"images", images},
        {"samplers", {{{"magFilter", kLinear}, {"minFilter", kTrilinear}, {"wrapS", kClamped}, {"wrapT", kClamped}}}},
        {"accessors", buffer.accessors},
        {"bufferViews", buffer.views},
        {"buffers", {{{"byteLength", buffer.bytes.size()}}}}};
    std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const uint64_t bytes = kGlbFrameBytes + text.size() + buffer.bytes.size();
    if (bytes > std::numeric_limits<uint32_t>::max())
        return Error{.code = ErrorCode::Limit,
                     .message = "a GLB has at most 2^32 bytes; fewer triangles make a smaller one"};
    return glbStart(text, buffer.bytes.size()) + buffer.bytes;
}

}  // namespace vcp
