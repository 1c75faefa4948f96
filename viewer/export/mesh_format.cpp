#include "viewer/export/mesh_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "builder/stream/colour_encoding.h"
#include "viewer/export/glb_chunks.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kTextHeaderBytes = 1024, kGlbHeaderBytes = 4096;
constexpr size_t kLongestNote = 200;

uint8_t channelOf(uint32_t rgba, int channel) { return uint8_t(rgba >> 8 * channel); }

/// Returns a note's text on one line, not too long.
std::string lineOf(std::string text) {
    std::ranges::replace_if(
        text, [](unsigned char c) { return c < ' '; }, '?');
    return text.size() > kLongestNote ? text.substr(0, kLongestNote) : text;
}

/// Returns lines that begin with `mark`, each a note, and one that makes the text `bytes` long with `rest` behind it.
std::string comments(const Notes& notes, const std::string& mark, const std::string& before, const std::string& rest,
                     size_t bytes) {
    std::string text = before;
    for (const auto& [word, about] : notes) text += fmt::format("{} {} {}\n", mark, word, lineOf(about));
    const size_t used = text.size() + mark.size() + 1 + rest.size();
    return text + mark + std::string(bytes - std::min(bytes, used), ' ') + "\n" + rest;
}

class Ply final : public MeshFormat {
public:
    explicit Ply(const MeshFormatOptions& options) : options_(options) {}

    [[nodiscard]] std::optional<std::string> problemWith(uint64_t vertices, uint64_t) const override {
        constexpr uint64_t kMost = std::numeric_limits<int32_t>::max();
        if (vertices <= kMost) return {};
        return fmt::format("a PLY numbers at most {} vertices, and the surface has {}", kMost, vertices);
    }
    [[nodiscard]] std::string header(uint64_t vertices, uint64_t triangles, const Notes& notes) const override {
        const char* real = options_.positions.isDouble ? "double" : "float";
        std::string rest =
            fmt::format("element vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\n", vertices, real, real, real);
        if (options_.hasColour)
            rest += "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
        if (options_.hasDistance) rest += "property float distance\n";
        rest += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", triangles);
        return comments(notes, "comment", "ply\nformat binary_little_endian 1.0\n", rest, kTextHeaderBytes);
    }
    void add(const SurfaceVertex& vertex, std::string& bytes) override {
        for (int a = 0; a < 3; ++a)
            options_.positions.isDouble ? put(bytes, vertex.at[a]) : put(bytes, float(vertex.at[a]));
        if (options_.hasColour) put(bytes, vertex.colour);
        if (options_.hasDistance) put(bytes, vertex.distance);
    }
    void add(const std::array<uint64_t, 3>& triangle, std::string& bytes) const override {
        put(bytes, uint8_t{3});
        for (const uint64_t v : triangle) put(bytes, int32_t(v));
    }
    void add(const Facet&, std::string&) const override {}

private:
    MeshFormatOptions options_;
};

class Obj final : public MeshFormat {
public:
    explicit Obj(const MeshFormatOptions& options) : options_(options) {}

    [[nodiscard]] std::optional<std::string> problemWith(uint64_t, uint64_t) const override { return {}; }
    [[nodiscard]] std::string header(uint64_t vertices, uint64_t triangles, const Notes& notes) const override {
        const std::string rest = fmt::format("# {} vertices, {} triangles\n", vertices, triangles);
        return comments(notes, "#", "", rest, kTextHeaderBytes);
    }
    void add(const SurfaceVertex& vertex, std::string& bytes) override {
        const glm::dvec3 p = vertex.at;
        auto out = std::back_inserter(bytes);
        if (options_.positions.isDouble)
            fmt::format_to(out, "v {} {} {}", p.x, p.y, p.z);
        else
            fmt::format_to(out, "v {} {} {}", float(p.x), float(p.y), float(p.z));
        if (options_.hasColour)
            fmt::format_to(out, " {:.5g} {:.5g} {:.5g}", channelOf(vertex.colour, 0) / 255.0,
                           channelOf(vertex.colour, 1) / 255.0, channelOf(vertex.colour, 2) / 255.0);
        bytes += '\n';
    }
    void add(const std::array<uint64_t, 3>& t, std::string& bytes) const override {
        fmt::format_to(std::back_inserter(bytes), "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    void add(const Facet&, std::string&) const override {}

private:
    MeshFormatOptions options_;
};

class Stl final : public MeshFormat {
public:
    [[nodiscard]] bool takesFacets() const override { return true; }
    [[nodiscard]] std::optional<std::string> problemWith(uint64_t, uint64_t triangles) const override {
        constexpr uint64_t kMost = std::numeric_limits<uint32_t>::max();
        if (triangles <= kMost) return {};
        return fmt::format("an STL counts at most {} triangles, and the surface has {}", kMost, triangles);
    }
    [[nodiscard]] std::string header(uint64_t, uint64_t triangles, const Notes& notes) const override {
        // An STL that begins with "solid" is taken for text.
        std::string text = "vcp:";
        for (const auto& [word, about] : notes) text += fmt::format(" {} {};", word, lineOf(about));
        text.resize(80, ' ');
        put(text, uint32_t(triangles));
        return text;
    }
    void add(const SurfaceVertex&, std::string&) override {}
    void add(const std::array<uint64_t, 3>&, std::string&) const override {}
    void add(const Facet& facet, std::string& bytes) const override {
        const glm::dvec3 n = glm::cross(facet[1] - facet[0], facet[2] - facet[0]);
        const double length = glm::length(n);
        const glm::dvec3 unit = length > 0 ? n / length : glm::dvec3(0);
        for (const glm::dvec3& v : {unit, facet[0], facet[1], facet[2]})
            for (int a = 0; a < 3; ++a) put(bytes, float(v[a]));
        put(bytes, uint16_t{0});
    }
};

class Glb final : public MeshFormat {
public:
    explicit Glb(const MeshFormatOptions& options) : options_(options) {}

    [[nodiscard]] std::optional<std::string> problemWith(uint64_t vertices, uint64_t triangles) const override {
        constexpr uint64_t kMost = std::numeric_limits<uint32_t>::max();
        const uint64_t bytes = kGlbHeaderBytes + dataBytes(vertices, triangles);
        if (bytes <= kMost && vertices < kMost) return {};
        return fmt::format("a GLB has at most {} bytes, and the surface takes {}", kMost, bytes);
    }
    [[nodiscard]] std::string header(uint64_t vertices, uint64_t triangles, const Notes& notes) const override {
        const uint64_t data = dataBytes(vertices, triangles);
        std::string json = jsonOf(vertices, triangles, notes).dump(-1, ' ', false, Json::error_handler_t::replace);
        json.resize(kGlbHeaderBytes - kGlbFrameBytes, ' ');
        return glbStart(json, data);
    }
    void add(const SurfaceVertex& vertex, std::string& bytes) override {
        const glm::vec3 p(vertex.at - options_.positions.origin);
        low_ = glm::min(low_, p);
        high_ = glm::max(high_, p);
        for (int a = 0; a < 3; ++a) put(bytes, p[a]);
        if (!options_.hasColour) return;
        for (int c = 0; c < 3; ++c)
            put(bytes, uint16_t(std::lround(65535 * lightOfByte()[channelOf(vertex.colour, c)])));
        put(bytes, uint16_t(257 * channelOf(vertex.colour, 3)));
    }
    void add(const std::array<uint64_t, 3>& triangle, std::string& bytes) const override {
        for (const uint64_t v : triangle) put(bytes, uint32_t(v));
    }
    void add(const Facet&, std::string&) const override {}

private:
    [[nodiscard]] uint64_t stride() const { return options_.hasColour ? 20 : 12; }
    [[nodiscard]] uint64_t dataBytes(uint64_t vertices, uint64_t triangles) const {
        return vertices * stride() + triangles * 12;
    }

    [[nodiscard]] Json jsonOf(uint64_t vertices, uint64_t triangles, const Notes& notes) const {
        constexpr int kArrayBuffer = 34962, kElementBuffer = 34963, kShort = 5123, kInt = 5125, kFloat = 5126;
        Json extras = Json::object();
        for (const auto& [word, about] : notes) extras[word] = lineOf(about);
        Json node = {{"mesh", 0}};
        if (const glm::dvec3 o = options_.positions.origin; o != glm::dvec3(0)) node["translation"] = {o.x, o.y, o.z};
        Json attributes = {{"POSITION", 0}};
        Json accessors = {{{"bufferView", 0},
                           {"componentType", kFloat},
                           {"count", vertices},
                           {"type", "VEC3"},
                           {"min", {low_.x, low_.y, low_.z}},
                           {"max", {high_.x, high_.y, high_.z}}},
                          {{"bufferView", 1}, {"componentType", kInt}, {"count", 3 * triangles}, {"type", "SCALAR"}}};
        if (options_.hasColour) {
            attributes["COLOR_0"] = 2;
            accessors.push_back({{"bufferView", 0},
                                 {"byteOffset", 12},
                                 {"componentType", kShort},
                                 {"normalized", true},
                                 {"count", vertices},
                                 {"type", "VEC4"}});
        }
        const uint64_t indices = vertices * stride();
        return {
            {"asset", {{"version", "2.0"}, {"generator", "vcp"}, {"extras", extras}}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {node}},
            {"meshes", {{{"primitives", {{{"attributes", attributes}, {"indices", 1}, {"material", 0}}}}}}},
            {"materials",
             {{{"doubleSided", true}, {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}}}},
            {"buffers", {{{"byteLength", dataBytes(vertices, triangles)}}}},
            {"bufferViews",
             {{{"buffer", 0}, {"byteLength", indices}, {"byteStride", stride()}, {"target", kArrayBuffer}},
              {{"buffer", 0}, {"byteOffset", indices}, {"byteLength", 12 * triangles}, {"target", kElementBuffer}}}},
            {"accessors", accessors}};
    }

    MeshFormatOptions options_;
    glm::vec3 low_{std::numeric_limits<float>::infinity()}, high_{-std::numeric_limits<float>::infinity()};
};

/// Returns how far single precision moves points in these bounds.
double singleRounding(const Box& bounds) {
    return glm::length(glm::max(glm::abs(bounds.low), glm::abs(bounds.high))) * 0x1p-24;
}

}  // namespace

PositionFormat positionsFor(OutputKind kind, const Box& bounds, double step) {
    PositionFormat format;
    format.rounding = singleRounding(bounds);
    if (format.rounding <= step / 4 || kind == OutputKind::Stl) return format;
    if (kind == OutputKind::Glb) {
        format.origin = glm::round(bounds.centre());
        format.rounding = singleRounding({bounds.low - format.origin, bounds.high - format.origin});
        return format;
    }
    format.isDouble = true;
    format.rounding = 0;
    return format;
}

std::unique_ptr<MeshFormat> meshFormat(OutputKind kind, const MeshFormatOptions& options) {
    switch (kind) {
        case OutputKind::Obj:
            return std::make_unique<Obj>(options);
        case OutputKind::Stl:
            return std::make_unique<Stl>();
        case OutputKind::Glb:
            return std::make_unique<Glb>(options);
        default:
            return std::make_unique<Ply>(options);
    }
}

}  // namespace vcp
