#include "builder/mesh/gltf/gltf_materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "builder/stream/colour_encoding.h"
#include "builder/stream/data_uri.h"

namespace vcp {
namespace {

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
            GltfTexture texture;
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
        material.hasCoordinates = material.texture.image.has_value();
        readChannels(f, material);
        document_.materials.push_back(std::move(material));
    }

    /// Reads what is beside the base colour. What is wrong there becomes a warning.
    void readChannels(const JsonFields& f, GltfMaterial& material) {
        JsonCheck own;
        GltfChannels& channels = material.channels;
        const Json* const surface = f.find("pbrMetallicRoughness");
        if (surface && surface->is_object()) {
            channels.roughness = numberOf(*surface, "roughnessFactor", 0, 1, 1);
            channels.metalness = numberOf(*surface, "metallicFactor", 0, 1, 1);
            const Json* const image = member(*surface, "metallicRoughnessTexture");
            channels.surface = channelOf(image, "roughness", own, material);
            channels.lacksSurface = image && !channels.surface;
        }
        if (const Json* const normals = f.find("normalTexture")) {
            if (normals->is_object()) channels.normalScale = numberOf(*normals, "scale", -1000, 1000, 1);
            channels.normals = channelOf(normals, "normals", own, material);
        }
        JsonFields(f.object(), where_, own).numbers("emissiveFactor", channels.emissionFactor);
        const Json* const extensions = f.find("extensions");
        const Json* const strong = extensions ? member(*extensions, "KHR_materials_emissive_strength") : nullptr;
        const double strength = strong ? numberOf(*strong, "emissiveStrength", 0, 1e6, 1) : 1;
        for (double& each : channels.emissionFactor) each = std::clamp(each, 0.0, 1.0) * strength;
        const Json* const emission = f.find("emissiveTexture");
        if (channels.emissionFactor != std::array<double, 3>{0, 0, 0})
            channels.emission = channelOf(emission, "emission", own, material);
        channels.lacksEmission = emission && !channels.emission;
        if (own.ok()) return;
        channels = {};
        document_.warnings.push_back(where_ + ": " + own.message + "; what is beside its colour is left out");
    }

    /// Returns the image of a channel, where it lies as the material's texture does, or is the first that lies
    /// anywhere.
    std::optional<uint32_t> channelOf(const Json* json, const char* what, JsonCheck& check, GltfMaterial& material) {
        if (!json) return {};
        const GltfTexture texture = textureOf(JsonFields(*json, where_, check));
        if (!texture.image) return {};
        if (!material.hasCoordinates) {
            material.texture = texture;
            material.texture.image.reset();
            material.hasCoordinates = true;
        }
        if (texture.liesAs(material.texture)) return texture.image;
        document_.warnings.push_back(
            fmt::format("{}: the image of its {} lies elsewhere than its colour's; it is left out", where_, what));
        return {};
    }

    static double numberOf(const Json& object, const char* key, double least, double most, double missing) {
        const Json* const value = member(object, key);
        return value && value->is_number() ? std::clamp(value->get<double>(), least, most) : missing;
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
        if (texture) material.texture = textureOf(JsonFields(*texture, where_, check_));
    }

    GltfTexture textureOf(const JsonFields& f) {
        const auto number = f.index("index", textures_.size());
        if (!number) return {};
        GltfTexture texture = textures_[*number];
        texture.texCoord = uint32_t(f.whole("texCoord", 0));
        if (!texture.image)
            document_.warnings.push_back(where_ + ": its texture is in a format that is not read; it is left out");
        const Json* const extensions = f.find("extensions");
        const Json* const transform = extensions ? member(*extensions, "KHR_texture_transform") : nullptr;
        if (transform) readTransform(f.within(*transform), texture);
        return texture;
    }

    // Rotation is counter-clockwise as one sees the image, whose v grows downwards.
    static void readTransform(const JsonFields& f, GltfTexture& texture) {
        std::array<double, 2> offset{0, 0}, scale{1, 1};
        f.numbers("offset", offset);
        f.numbers("scale", scale);
        const Json* const rotation = f.find("rotation");
        const double angle = rotation && rotation->is_number() ? rotation->get<double>() : 0;
        const double c = std::cos(angle), s = std::sin(angle);
        texture.uvMatrix = {glm::dvec3(c * scale[0], s * scale[1], offset[0]),
                            glm::dvec3(-s * scale[0], c * scale[1], offset[1])};
        texture.texCoord = uint32_t(f.whole("texCoord", texture.texCoord));
    }

    const Json& json_;
    GltfDocument& document_;
    JsonCheck& check_;
    std::string where_;
    std::vector<GltfTexture> textures_;
};

// With a mask, what is there follows from the product of the image's alpha and the factor's.
MaskRule maskOf(const GltfMaterial& from, const ImageSource& image) {
    MaskRule rule;
    if (from.alphaMode == GltfAlpha::Opaque) return rule;
    rule.image = image;
    rule.sparesGlass = from.alphaMode == GltfAlpha::Blend;
    if (from.alphaMode == GltfAlpha::Blend) return rule;
    constexpr double kAboveAll = 2;
    if (from.alphaCutoff > 0)
        rule.cutoff = from.alpha > 0 ? from.alphaCutoff / from.alpha : kAboveAll;
    else
        rule.image = {};
    return rule;
}

MaterialChannels channelsOf(const GltfChannels& from, std::span<const ImageSource> images) {
    const auto imageOf = [&](std::optional<uint32_t> number) { return number ? images[*number] : ImageSource(); };
    MaterialChannels channels{
        .normals = imageOf(from.normals),
        .surface = imageOf(from.surface),
        .emission = imageOf(from.emission),
        .normalScale = float(from.normalScale),
        .roughness = float(from.roughness),
        .metalness = float(from.metalness),
        .emissionFactor = {from.emissionFactor[0], from.emissionFactor[1], from.emissionFactor[2]}};
    if (from.lacksSurface || (from.surface && !channels.surface.exists())) channels.forgetSurface();
    if (from.lacksEmission || (from.emission && !channels.emission.exists())) channels.forgetEmission();
    return channels;
}

}  // namespace

void readGltfMaterials(const Json& json, GltfDocument& document, JsonCheck& check) {
    MaterialReader(json, document, check).read();
}

std::vector<Material> materialsOf(const GltfDocument& document, std::span<const ImageSource> images) {
    std::vector<Material> materials;
    for (const GltfMaterial& from : document.materials) {
        Material material;
        material.name = from.name;
        material.wrapU = from.texture.wrapU;
        material.wrapV = from.texture.wrapV;
        if (from.texture.image) material.image = images[*from.texture.image];
        material.ignoresAlpha = from.alphaMode == GltfAlpha::Opaque;
        material.mask = maskOf(from, material.image);
        if (from.hasCoordinates) material.channels = channelsOf(from.channels, images);
        materials.push_back(std::move(material));
    }
    return materials;
}

}  // namespace vcp
