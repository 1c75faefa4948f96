#include "builder/mesh/gltf/gltf_materials.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "builder/stream/colour_encoding.h"
#include "builder/stream/data_uri.h"

namespace vcp {
namespace {

struct Texture {
    std::optional<uint32_t> image;
    Wrap wrapU = Wrap::Repeat, wrapV = Wrap::Repeat;
};

Wrap wrapOf(uint64_t number) {
    if (number == 33071) return Wrap::Clamp;
    return number == 33648 ? Wrap::Mirror : Wrap::Repeat;
}

const Json* member(const Json& object, const char* key) {
    if (!object.is_object()) return nullptr;
    const auto found = object.find(key);
    return found == object.end() ? nullptr : &*found;
}

class MaterialReader {
public:
    MaterialReader(const Json& json, GltfDocument& document, JsonCheck& check)
        : json_(json), document_(document), check_(check) {}

    void read() {
        const std::string file = "glTF";
        const JsonFields top(json_, file, check_);
        top.each("images", "image", where_, [&](const JsonFields& f) { readImage(f); });
        std::vector<std::pair<Wrap, Wrap>> samplers;
        top.each("samplers", "sampler", where_, [&](const JsonFields& f) {
            samplers.emplace_back(wrapOf(f.whole("wrapS", 0)), wrapOf(f.whole("wrapT", 0)));
        });
        top.each("textures", "texture", where_, [&](const JsonFields& f) {
            Texture texture;
            texture.image = f.index("source", document_.images.size());
            if (const auto sampler = f.index("sampler", samplers.size()))
                std::tie(texture.wrapU, texture.wrapV) = samplers[*sampler];
            textures_.push_back(texture);
        });
        top.each("materials", "material", where_, [&](const JsonFields& f) { readMaterial(f); });
    }

private:
    void readImage(const JsonFields& f) {
        GltfImage image;
        if (f.find("uri")) image.uri = f.text("uri");
        image.view = f.index("bufferView", document_.views.size());
        if (isDataUri(image.uri)) {
            auto data = decodeDataUri(image.uri);
            if (!data) document_.warnings.push_back(where_ + ": its data URI is not base64; it is left out");
            image.data = std::move(data).value_or("");
            image.uri.clear();
        }
        document_.images.push_back(std::move(image));
    }

    void readMaterial(const JsonFields& f) {
        GltfMaterial material;
        material.name = f.text("name");
        readAlpha(f, material);
        const Json* const extensions = f.find("extensions");
        const Json* const old = extensions ? member(*extensions, "KHR_materials_pbrSpecularGlossiness") : nullptr;
        const Json* const current = f.find("pbrMetallicRoughness");
        if (old && !current)
            readBase(*old, "diffuseFactor", "diffuseTexture", material);
        else if (current)
            readBase(*current, "baseColorFactor", "baseColorTexture", material);
        document_.materials.push_back(std::move(material));
    }

    // What is not understood is opaque.
    static void readAlpha(const JsonFields& f, GltfMaterial& material) {
        const Json* const mode = f.find("alphaMode");
        if (mode && *mode == "MASK") material.alphaMode = GltfAlpha::Mask;
        if (mode && *mode == "BLEND") material.alphaMode = GltfAlpha::Blend;
        const Json* const cutoff = f.find("alphaCutoff");
        if (cutoff && cutoff->is_number()) material.alphaCutoff = cutoff->get<double>();
    }

    void readBase(const Json& json, const char* factorKey, const char* textureKey, GltfMaterial& material) {
        const JsonFields f(json, where_, check_);
        std::array<double, 4> factor{1, 1, 1, 1};
        f.numbers(factorKey, factor);
        material.factor = encodeRgba(factor);
        material.alpha = factor[3];
        const Json* const texture = f.find(textureKey);
        if (texture) readTexture(*texture, material);
    }

    void readTexture(const Json& json, GltfMaterial& material) {
        const JsonFields f(json, where_, check_);
        const auto number = f.index("index", textures_.size());
        if (!number) return;
        const Texture& texture = textures_[*number];
        material.image = texture.image;
        material.wrapU = texture.wrapU;
        material.wrapV = texture.wrapV;
        material.texCoord = uint32_t(f.whole("texCoord", 0));
        if (!texture.image)
            document_.warnings.push_back(where_ + ": its texture is in a format that is not read; it is left out");
        const Json* const extensions = f.find("extensions");
        const Json* const transform = extensions ? member(*extensions, "KHR_texture_transform") : nullptr;
        if (transform) readTransform(*transform, material);
    }

    // Rotation is counter-clockwise as one sees the image, whose v grows downwards.
    void readTransform(const Json& json, GltfMaterial& material) {
        const JsonFields f(json, where_, check_);
        std::array<double, 2> offset{0, 0}, scale{1, 1};
        f.numbers("offset", offset);
        f.numbers("scale", scale);
        const Json* const rotation = f.find("rotation");
        const double angle = rotation && rotation->is_number() ? rotation->get<double>() : 0;
        const double c = std::cos(angle), s = std::sin(angle);
        material.uvMatrix = {glm::dvec3(c * scale[0], s * scale[1], offset[0]),
                             glm::dvec3(-s * scale[0], c * scale[1], offset[1])};
        material.texCoord = uint32_t(f.whole("texCoord", material.texCoord));
    }

    const Json& json_;
    GltfDocument& document_;
    JsonCheck& check_;
    std::string where_;
    std::vector<Texture> textures_;
};

}  // namespace

void readGltfMaterials(const Json& json, GltfDocument& document, JsonCheck& check) {
    MaterialReader(json, document, check).read();
}

}  // namespace vcp
