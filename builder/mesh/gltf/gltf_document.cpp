#include "builder/mesh/gltf/gltf_document.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "builder/mesh/gltf/gltf_materials.h"
#include "builder/mesh/gltf/gltf_meshopt.h"
#include "builder/mesh/gltf/json_fields.h"
#include "builder/mesh/gltf/json_text.h"
#include "builder/stream/colour_encoding.h"
#include "builder/stream/data_uri.h"

namespace vcp {
namespace {

constexpr uint64_t kTextLimit = uint64_t{128} << 20;
constexpr uint64_t kMostZeros = 65536;  // elements of an accessor without data, and so many for each sparse one
constexpr uint64_t kZerosPerValue = 256;

std::optional<GltfComponent> componentOf(uint64_t number) {
    using enum GltfComponent;
    switch (number) {
        case 5120:
            return Int8;
        case 5121:
            return Uint8;
        case 5122:
            return Int16;
        case 5123:
            return Uint16;
        case 5125:
            return Uint32;
        case 5126:
            return Float;
        default:
            return std::nullopt;
    }
}

// Whether a surface is the same without an extension.
bool changesNoSurface(std::string_view extension) {
    static constexpr std::array<std::string_view, 9> kRead{
        "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression",
        "KHR_mesh_quantization",      "EXT_mesh_gpu_instancing", "CESIUM_RTC",
        "EXT_mesh_features",          "EXT_structural_metadata", "KHR_node_visibility"};
    static constexpr std::array<std::string_view, 7> kLooks{
        "KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_", "KHR_xmp", "KHR_animation_"};
    return std::ranges::find(kRead, extension) != kRead.end() ||
           std::ranges::any_of(kLooks, [&](std::string_view start) { return extension.starts_with(start); });
}

class DocumentReader {
public:
    DocumentReader(ByteSource& source, const Json& json) : source_(source), json_(json) {}

    Result<GltfDocument> read() {
        VCP_TRY(checkVersion());
        const std::string file = "glTF";
        const JsonFields top(json_, file, check_);
        top.each("buffers", "buffer", where_, [&](const JsonFields& f) { readBuffer(f); });
        top.each("bufferViews", "bufferView", where_, [&](const JsonFields& f) { readView(f); });
        if (!meshoptIsInProportion(document_))
            return source_.error(ErrorCode::Limit, "bufferViews", std::nullopt,
                                 "are decoded by meshopt to more than 64 times their buffers");
        top.each("accessors", "accessor", where_, [&](const JsonFields& f) { readAccessor(f); });
        readGltfMaterials(json_, document_, check_);
        top.each("meshes", "mesh", where_, [&](const JsonFields& f) { readMesh(f); });
        countNodes(top);
        top.each("nodes", "node", where_, [&](const JsonFields& f) { readNode(f); });
        readRoots();
        readCentre();
        if (!check_.ok()) return source_.error(ErrorCode::InvalidInput, check_.element, std::nullopt, check_.message);
        return std::move(document_);
    }

private:
    Result<void> checkVersion() {
        const std::string where = "glTF";
        const JsonFields top(json_, where, check_);
        const Json* const asset = top.find("asset");
        if (!asset || !asset->is_object())
            return source_.error(ErrorCode::InvalidInput, "", std::nullopt,
                                 "is JSON without 'asset'; it is not glTF 2.0");
        const std::string version = JsonFields(*asset, where, check_).text("version");
        if (!version.starts_with("2."))
            return source_.error(ErrorCode::Unsupported, "asset", std::nullopt,
                                 "is not glTF 2.0; convert it (glTF 1.0 is from before 2017)");
        const Json* const required = top.array("extensionsRequired");
        for (size_t i = 0; required && i < required->size(); ++i) {
            const Json& name = (*required)[i];
            const std::string extension = name.is_string() ? name.get<std::string>() : "?";
            if (!changesNoSurface(extension))
                return source_.error(
                    ErrorCode::Unsupported, "extensionsRequired", std::nullopt,
                    fmt::format("needs the extension {}, which is not read; export it without", shownName(extension)));
        }
        return {};
    }

    static std::string shownName(std::string_view name) {
        std::string text;
        for (const char c : name.substr(0, 64)) text += c > ' ' && c <= '~' ? c : '?';
        return text;
    }

    void readBuffer(const JsonFields& f) {
        GltfBuffer buffer;
        buffer.bytes = f.needWhole("byteLength");
        const Json* const uri = f.find("uri");
        if (uri) buffer.uri = f.text("uri");
        buffer.embedded = !uri || isDataUri(buffer.uri);
        if (uri && buffer.embedded) {
            auto data = decodeDataUri(buffer.uri);
            if (!data) return f.fail("its data URI is not base64");
            if (data->size() < buffer.bytes)
                return f.fail(fmt::format("declares {} bytes, but its data URI holds {}", buffer.bytes, data->size()));
            buffer.data = *std::move(data);
            buffer.uri = "data:";
        }
        document_.buffers.push_back(std::move(buffer));
    }

    void readView(const JsonFields& f) {
        GltfView view;
        if (!f.find("buffer")) return f.fail("has no 'buffer'");
        view.buffer = f.index("buffer", document_.buffers.size()).value_or(0);
        if (!check_.ok()) return;
        view.offset = f.whole("byteOffset", 0);
        view.bytes = f.needWhole("byteLength");
        view.stride = f.whole("byteStride", 0);
        const uint64_t room = document_.buffers[view.buffer].bytes;
        if (view.offset > room || view.bytes > room - view.offset)
            return f.fail(fmt::format("bytes {} to {} lie outside buffer {} of {} bytes", view.offset,
                                      view.offset + view.bytes, view.buffer, room));
        if (view.stride > 252) return f.fail("its byteStride is larger than 252");
        readGltfMeshopt(f, where_, check_, document_.buffers, view);
        document_.views.push_back(view);
    }

    // Checks that `count` elements at an offset of a view lie in it.
    void checkInView(const JsonFields& f, uint32_t number, uint64_t offset, uint64_t count, uint64_t elementBytes,
                     uint64_t stride) {
        const uint64_t room = document_.views[number].bytes;
        if (stride < elementBytes) return f.fail("its elements are larger than the byteStride of its bufferView");
        const bool fits = count == 0 || (offset <= room && elementBytes <= room - offset &&
                                         (count - 1) <= (room - offset - elementBytes) / stride);
        if (!fits)
            f.fail(fmt::format("{} elements of {} bytes do not fit into bufferView {} of {} bytes", count, elementBytes,
                               number, room));
    }

    void readAccessor(const JsonFields& f) {
        GltfAccessor accessor;
        accessor.count = f.needWhole("count");
        accessor.offset = f.whole("byteOffset", 0);
        const auto type = componentOf(f.needWhole("componentType"));
        if (!type) return f.fail("its componentType is unknown");
        accessor.type = *type;
        const std::string shape = f.text("type");
        if (shape == "SCALAR") accessor.components = 1;
        if (shape.size() == 4 && shape.starts_with("VEC")) accessor.components = uint32_t(shape[3] - '0');
        if (accessor.components > 4 || (accessor.components == 0 && !shape.starts_with("MAT")))
            return f.fail("its type is unknown");
        const Json* const normalized = f.find("normalized");
        accessor.normalized = normalized && normalized->is_boolean() && normalized->get<bool>();
        accessor.view = f.index("bufferView", document_.views.size());
        if (!check_.ok()) return;
        const uint64_t bytes = accessor.elementBytes();
        if (accessor.view && accessor.components > 0) {
            const uint64_t stride = document_.views[*accessor.view].stride;
            checkInView(f, *accessor.view, accessor.offset, accessor.count, bytes, stride ? stride : bytes);
        }
        const Json* const sparse = f.find("sparse");
        if (sparse && accessor.components > 0) readSparse(f, *sparse, accessor);
        // The accessors of a mesh that Draco compressed have no view either, so kMostZeros is checked where zeros are
        // read.
        document_.accessors.push_back(accessor);
    }

    void readSparse(const JsonFields& f, const Json& json, GltfAccessor& accessor) {
        const JsonFields s(json, where_, check_);
        const Json empty = Json::object();
        const JsonFields indices(s.find("indices") ? *s.find("indices") : empty, where_, check_);
        const JsonFields values(s.find("values") ? *s.find("values") : empty, where_, check_);
        GltfSparse sparse;
        sparse.count = s.needWhole("count");
        const auto indexView = indices.index("bufferView", document_.views.size());
        const auto valueView = values.index("bufferView", document_.views.size());
        const auto type = componentOf(indices.needWhole("componentType"));
        if (!indexView || !valueView || !type) return f.fail("its sparse indices or values are not complete");
        sparse.indexView = *indexView;
        sparse.valueView = *valueView;
        sparse.indexType = *type;
        sparse.indexOffset = indices.whole("byteOffset", 0);
        sparse.valueOffset = values.whole("byteOffset", 0);
        if (sparse.count > accessor.count) return f.fail("has more sparse values than elements");
        checkInView(f, sparse.indexView, sparse.indexOffset, sparse.count, byteSize(*type), byteSize(*type));
        checkInView(f, sparse.valueView, sparse.valueOffset, sparse.count, accessor.elementBytes(),
                    accessor.elementBytes());
        accessor.sparse = sparse;
    }

    void readMesh(const JsonFields& f) {
        GltfMesh mesh;
        const Json* const primitives = f.array("primitives");
        for (size_t i = 0; primitives && i < primitives->size() && check_.ok(); ++i)
            readPrimitive(JsonFields((*primitives)[i], where_, check_), mesh);
        document_.meshes.push_back(std::move(mesh));
    }

    void readPrimitive(const JsonFields& f, GltfMesh& mesh) {
        GltfPrimitive p;
        const uint64_t mode = f.whole("mode", 4);
        if (mode > 6) return f.fail("the mode of a primitive is unknown");
        if (mode < 4) return;  // points and lines
        p.mode = static_cast<GltfMode>(mode - 4);
        const Json* const attributeJson = f.find("attributes");
        if (!attributeJson) return f.fail("a primitive has no attributes");
        const JsonFields attributes(*attributeJson, where_, check_);
        const size_t accessors = document_.accessors.size();
        const auto position = attributes.index("POSITION", accessors);
        if (!position) return;  // "if it is not specified, other extensions should": nothing to see
        p.position = *position;
        p.colour = attributes.index("COLOR_0", accessors);
        p.normal = attributes.index("NORMAL", accessors);
        p.indices = f.index("indices", accessors);
        p.material = f.index("material", document_.materials.size());
        if (!check_.ok()) return;
        std::string uvName;
        if (p.material && document_.materials[*p.material].hasCoordinates) {
            uvName = fmt::format("TEXCOORD_{}", document_.materials[*p.material].texture.texCoord);
            p.uv = attributes.index(uvName.c_str(), accessors);
        }
        readDraco(f, uvName, p);
        if (check_.ok()) checkPrimitive(f, p);
        if (check_.ok()) checkNormals(p);
        if (check_.ok()) mesh.primitives.push_back(p);
    }

    // Whether an accessor promises far more than it brings.
    static bool isEmpty(const GltfAccessor& a) {
        return !a.view && a.count > kMostZeros + kZerosPerValue * (a.sparse ? a.sparse->count : 0);
    }

    void readDraco(const JsonFields& f, const std::string& uvName, GltfPrimitive& p) {
        const Json* const extensions = f.find("extensions");
        if (!extensions || !extensions->is_object() || !extensions->contains("KHR_draco_mesh_compression")) return;
        const JsonFields draco((*extensions)["KHR_draco_mesh_compression"], where_, check_);
        GltfDraco compressed;
        const auto view = draco.index("bufferView", document_.views.size());
        const Json* const ids = draco.find("attributes");
        if (!view || !ids) return f.fail("KHR_draco_mesh_compression has no bufferView or no attributes");
        compressed.view = *view;
        const JsonFields attributes(*ids, where_, check_);
        constexpr size_t kMostIds = 65536;
        compressed.position = attributes.index("POSITION", kMostIds);
        compressed.colour = attributes.index("COLOR_0", kMostIds);
        compressed.normal = attributes.index("NORMAL", kMostIds);
        if (!uvName.empty()) compressed.uv = attributes.index(uvName.c_str(), kMostIds);
        if (!compressed.position) return f.fail("KHR_draco_mesh_compression has no POSITION");
        p.draco = compressed;
    }

    void checkPrimitive(const JsonFields& f, const GltfPrimitive& p) {
        const auto& accessors = document_.accessors;
        const GltfAccessor& position = accessors[p.position];
        if (position.components != 3) f.fail("POSITION has not 3 components");
        const auto checkAttribute = [&](std::optional<uint32_t> number, uint32_t least, uint32_t most,
                                        const char* name) {
            if (!number) return;
            const GltfAccessor& a = accessors[*number];
            if (a.components < least || a.components > most)
                f.fail(fmt::format("{} has {} components", name, a.components));
            if (a.count != position.count)
                f.fail(fmt::format("{} has {} values for {} vertices", name, a.count, position.count));
            if (!p.draco && isEmpty(a)) f.fail(fmt::format("{} has {} values without data", name, a.count));
        };
        checkAttribute(p.position, 3, 3, "POSITION");
        checkAttribute(p.colour, 3, 4, "COLOR_0");
        checkAttribute(p.uv, 2, 2, "TEXCOORD");
        if (!p.indices || p.draco) return;
        const GltfAccessor& indices = accessors[*p.indices];
        const bool whole = indices.type == GltfComponent::Uint8 || indices.type == GltfComponent::Uint16 ||
                           indices.type == GltfComponent::Uint32;
        if (indices.components != 1 || !whole) f.fail("its indices are not unsigned whole numbers");
        if (isEmpty(indices)) f.fail(fmt::format("its {} indices have no data", indices.count));
    }

    // A surface is there without its normals.
    void checkNormals(GltfPrimitive& p) {
        if (!p.normal) return;
        const GltfAccessor& a = document_.accessors[*p.normal];
        if (a.components == 3 && a.count == document_.accessors[p.position].count && (p.draco || !isEmpty(a))) return;
        document_.warnings.push_back(where_ + ": NORMAL does not fit its vertices; it is left out");
        p.normal.reset();
        if (p.draco) p.draco->normal.reset();
    }

    void countNodes(const JsonFields& top) {
        const Json* const array = top.array("nodes");
        nodeCount_ = array ? array->size() : 0;
        hasParent_.assign(nodeCount_, false);
    }

    void readNode(const JsonFields& f) {
        GltfNode node;
        node.local = readTransform(f);
        node.mesh = f.index("mesh", document_.meshes.size());
        readInstancing(f, node);
        const Json* const children = f.array("children");
        for (size_t i = 0; children && i < children->size(); ++i) {
            const Json& child = (*children)[i];
            const bool right = child.is_number_unsigned() && child.get<uint64_t>() < nodeCount_;
            if (!right) return f.fail("names a child that does not exist");
            const auto number = child.get<uint32_t>();
            hasParent_[number] = true;
            node.children.push_back(number);
        }
        document_.nodes.push_back(std::move(node));
    }

    static glm::dmat4 readTransform(const JsonFields& f) {
        std::array<double, 16> m{};
        if (f.numbers("matrix", m)) {
            glm::dmat4 matrix;
            for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = m[size_t(i)];
            return matrix;
        }
        std::array<double, 3> t{0, 0, 0}, s{1, 1, 1};
        std::array<double, 4> r{0, 0, 0, 1};
        f.numbers("translation", t);
        f.numbers("rotation", r);
        f.numbers("scale", s);
        const double length = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
        const glm::dquat q = length > 0 ? glm::dquat(r[3] / length, r[0] / length, r[1] / length, r[2] / length)
                                        : glm::dquat(1, 0, 0, 0);
        const glm::dmat4 moved = glm::translate(glm::dmat4(1), glm::dvec3(t[0], t[1], t[2]));
        return glm::scale(moved * glm::mat4_cast(q), glm::dvec3(s[0], s[1], s[2]));
    }

    void readInstancing(const JsonFields& f, GltfNode& node) {
        const Json* const extensions = f.find("extensions");
        if (!extensions || !extensions->is_object() || !extensions->contains("EXT_mesh_gpu_instancing")) return;
        const JsonFields extension((*extensions)["EXT_mesh_gpu_instancing"], where_, check_);
        const Json* const attributeJson = extension.find("attributes");
        if (!attributeJson) return f.fail("EXT_mesh_gpu_instancing has no attributes");
        const JsonFields attributes(*attributeJson, where_, check_);
        GltfInstancing instancing;
        std::optional<uint64_t> count;
        const auto take = [&](const char* key, uint32_t components) {
            const auto number = attributes.index(key, document_.accessors.size());
            if (!number) return number;
            const GltfAccessor& a = document_.accessors[*number];
            if (a.components != components || (count && *count != a.count) || isEmpty(a))
                f.fail(fmt::format("EXT_mesh_gpu_instancing: {} does not fit", key));
            count = a.count;
            return number;
        };
        instancing.translation = take("TRANSLATION", 3);
        instancing.rotation = take("ROTATION", 4);
        instancing.scale = take("SCALE", 3);
        instancing.count = count.value_or(1);
        node.instancing = instancing;
    }

    void readRoots() {
        const std::string top = "glTF";
        const JsonFields f(json_, top, check_);
        const Json* const scenes = f.array("scenes");
        where_ = "scene";
        if (!scenes || scenes->empty()) {
            for (uint32_t i = 0; i < nodeCount_; ++i)
                if (!hasParent_[i]) document_.roots.push_back(i);
            return;
        }
        const size_t number = f.index("scene", scenes->size()).value_or(0);
        const JsonFields scene((*scenes)[number], where_, check_);
        const Json* const roots = scene.array("nodes");
        for (size_t i = 0; roots && i < roots->size(); ++i) {
            const Json& root = (*roots)[i];
            if (!root.is_number_unsigned() || root.get<uint64_t>() >= nodeCount_)
                return scene.fail("names a node that does not exist");
            const auto node = root.get<uint32_t>();
            document_.roots.push_back(node);
        }
    }

    void readCentre() {
        const Json* const extensions = json_.contains("extensions") ? &json_["extensions"] : nullptr;
        if (!extensions || !extensions->is_object() || !extensions->contains("CESIUM_RTC")) return;
        where_ = "CESIUM_RTC";
        std::array<double, 3> centre{};
        if (JsonFields((*extensions)["CESIUM_RTC"], where_, check_).numbers("center", centre))
            document_.centre = {centre[0], centre[1], centre[2]};
    }

    ByteSource& source_;
    const Json& json_;
    JsonCheck check_;
    std::string where_;
    GltfDocument document_;
    size_t nodeCount_ = 0;
    std::vector<bool> hasParent_;
};

}  // namespace

Result<GltfDocument> readGltfDocument(ByteSource& source, uint64_t jsonBytes) {
    VCP_TRY_ASSIGN(const auto json, readJson(source, jsonBytes, kTextLimit));
    if (!json.is_object())
        return source.error(ErrorCode::InvalidInput, "JSON", std::nullopt, "is not a JSON object; it is not glTF");
    return DocumentReader(source, json).read();
}

}  // namespace vcp
