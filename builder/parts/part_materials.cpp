#include "builder/parts/part_materials.h"

#include <algorithm>
#include <map>

#include <xxhash.h>

namespace vcp {

namespace {

using nlohmann::json;

constexpr const char* kImageFile = "embedded.spill";

/// Names and paths may have any bytes; text of this format may not.
json textBytes(const std::string& text) { return std::vector<uint8_t>(text.begin(), text.end()); }

std::string textFrom(const json& j) {
    const auto bytes = j.get<std::vector<uint8_t>>();
    return {bytes.begin(), bytes.end()};
}

json vectorJson(glm::vec2 v) { return {v.x, v.y}; }
json vectorJson(glm::vec3 v) { return {v.x, v.y, v.z}; }
glm::vec2 vec2From(const json& j) { return {j.at(0).get<float>(), j.at(1).get<float>()}; }
glm::vec3 vec3From(const json& j) { return {j.at(0).get<float>(), j.at(1).get<float>(), j.at(2).get<float>()}; }

/// Images by how they are recorded: null, a path, or the number of one that the mesh holds.
class ImageWriter {
public:
    explicit ImageWriter(TempSpace& space) : file_(space, kImageFile) {}

    Result<json> record(const ImageSource& image) {
        if (!image.bytes) return image.path.empty() ? json() : textBytes(image.path.native());
        const auto [known, isNew] = numbers_.try_emplace(image.bytes.get(), numbers_.size());
        if (!isNew) return json(known->second);
        const auto bytes = std::as_bytes(std::span(*image.bytes));
        VCP_TRY_ASSIGN(const uint64_t offset, file_.append(bytes));
        images_.push_back({offset, bytes.size(), XXH3_64bits(bytes.data(), bytes.size())});
        return json(known->second);
    }
    /// Returns where the images are, which are durable then.
    Result<json> finish() {
        if (!images_.empty()) VCP_TRY(file_.sync());
        return images_;
    }

private:
    TempFile file_;
    std::map<const std::string*, size_t> numbers_;
    json images_ = json::array();
};

class ImageReader {
public:
    static Result<ImageReader> open(const json& images, TempSpace& space) {
        ImageReader reader;
        if (images.empty()) return reader;
        TempFile file(space, kImageFile);
        const json& last = images.back();
        VCP_TRY(file.reopen(last.at(0).get<uint64_t>() + last.at(1).get<uint64_t>()));
        for (const json& image : images) {
            auto bytes = std::make_shared<std::string>(image.at(1).get<size_t>(), '\0');
            const auto offset = image.at(0).get<uint64_t>();
            VCP_TRY(file.read(offset, std::as_writable_bytes(std::span(*bytes))));
            if (XXH3_64bits(bytes->data(), bytes->size()) != image.at(2).get<uint64_t>())
                return damagedTempFile(file.path(), offset);
            reader.images_.push_back(std::move(bytes));
        }
        return reader;
    }
    [[nodiscard]] ImageSource image(const json& j) const {
        if (j.is_null()) return {};
        if (j.is_array()) return {.path = textFrom(j), .bytes = {}};
        return {.path = {}, .bytes = images_.at(j.get<size_t>())};
    }

private:
    std::vector<std::shared_ptr<const std::string>> images_;
};

Result<json> jsonOf(const Material& m, ImageWriter& images) {
    const MaterialChannels& c = m.channels;
    VCP_TRY_ASSIGN(auto image, images.record(m.image));
    VCP_TRY_ASSIGN(auto mask, images.record(m.mask.image));
    VCP_TRY_ASSIGN(auto normals, images.record(c.normals));
    VCP_TRY_ASSIGN(auto surface, images.record(c.surface));
    VCP_TRY_ASSIGN(auto emission, images.record(c.emission));
    return json{{"name", textBytes(m.name)},
                {"factor", m.factor},
                {"image", image},
                {"ignores alpha", m.ignoresAlpha},
                {"is cut out", m.isCutOut},
                {"wrap", {int(m.wrapU), int(m.wrapV)}},
                {"mask", mask},
                // Any cutoff above 1 says the same.
                {"mask rule", {std::min(m.mask.cutoff, 2.0), m.mask.sparesGlass, m.mask.mayBeGrey}},
                {"mask place", {vectorJson(m.mask.uvScale), vectorJson(m.mask.uvOffset)}},
                {"channel images", {normals, surface, emission}},
                {"channel factors", {c.normalScale, c.roughness, c.metalness}},
                {"emission factor", vectorJson(c.emissionFactor)}};
}

Material materialFrom(const json& j, const ImageReader& images) {
    Material m;
    m.name = textFrom(j.at("name"));
    m.factor = j.at("factor").get<Rgba8>();
    m.image = images.image(j.at("image"));
    m.ignoresAlpha = j.at("ignores alpha").get<bool>();
    m.isCutOut = j.at("is cut out").get<bool>();
    m.wrapU = Wrap(j.at("wrap").at(0).get<uint8_t>());
    m.wrapV = Wrap(j.at("wrap").at(1).get<uint8_t>());
    m.mask.image = images.image(j.at("mask"));
    m.mask.cutoff = j.at("mask rule").at(0).get<double>();
    m.mask.sparesGlass = j.at("mask rule").at(1).get<bool>();
    m.mask.mayBeGrey = j.at("mask rule").at(2).get<bool>();
    m.mask.uvScale = vec2From(j.at("mask place").at(0));
    m.mask.uvOffset = vec2From(j.at("mask place").at(1));
    MaterialChannels& c = m.channels;
    c.normals = images.image(j.at("channel images").at(0));
    c.surface = images.image(j.at("channel images").at(1));
    c.emission = images.image(j.at("channel images").at(2));
    c.normalScale = j.at("channel factors").at(0).get<float>();
    c.roughness = j.at("channel factors").at(1).get<float>();
    c.metalness = j.at("channel factors").at(2).get<float>();
    c.emissionFactor = vec3From(j.at("emission factor"));
    return m;
}

}  // namespace

Result<json> recordMaterials(const std::vector<Material>& materials, TempSpace& space) {
    ImageWriter images(space);
    json recorded = json::array();
    for (const Material& each : materials) {
        VCP_TRY_ASSIGN(auto row, jsonOf(each, images));
        recorded.push_back(std::move(row));
    }
    VCP_TRY_ASSIGN(auto held, images.finish());
    return json{{"materials", recorded}, {"images", held}};
}

Result<std::vector<Material>> recordedMaterials(const json& recorded, TempSpace& space) {
    VCP_TRY_ASSIGN(const auto images, ImageReader::open(recorded.at("images"), space));
    std::vector<Material> materials;
    for (const json& row : recorded.at("materials")) materials.push_back(materialFrom(row, images));
    return materials;
}

}  // namespace vcp
