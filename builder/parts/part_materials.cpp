#include "builder/parts/part_materials.h"

#include <algorithm>
#include <bit>
#include <initializer_list>
#include <map>

#include <xxhash.h>

#include "builder/spill/journal.h"

namespace vcp {

namespace {

using nlohmann::json;

constexpr const char* kImageFile = "embedded.spill";
/// Images are written in such pieces, so that no second one is in memory.
constexpr size_t kPieceBytes = size_t{1} << 20;

/// Numbers as their bits: a mesh may have some that are none, which text of this format cannot say.
json bitsOf(std::initializer_list<float> numbers) {
    json bits = json::array();
    for (const float each : numbers) bits.push_back(std::bit_cast<uint32_t>(each));
    return bits;
}
float numberAt(const json& bits, size_t i) { return std::bit_cast<float>(bits.at(i).get<uint32_t>()); }

/// Images by how they are recorded: null, a path, or the number of one that the mesh holds.
class ImageWriter {
public:
    explicit ImageWriter(TempSpace& space) : file_(space, kImageFile) {}

    Result<json> record(const ImageSource& image) {
        if (!image.bytes) return image.path.empty() ? json() : bytesJson(image.path.native());
        const auto [known, isNew] = numbers_.try_emplace(image.bytes.get(), numbers_.size());
        if (!isNew) return json(known->second);
        const auto bytes = std::as_bytes(std::span(*image.bytes));
        const uint64_t offset = file_.size();
        for (size_t at = 0; at < bytes.size(); at += kPieceBytes)
            VCP_TRY(file_.append(bytes.subspan(at, std::min(kPieceBytes, bytes.size() - at))));
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
    /// Reads all; without `bytes`, images are empty.
    static Result<ImageReader> open(const json& images, TempSpace& space, bool bytes) {
        ImageReader reader;
        reader.images_.assign(images.size(), std::make_shared<std::string>());
        if (images.empty() || !bytes) return reader;
        reader.images_.clear();
        TempFile file(space, kImageFile);
        const json& last = images.back();
        VCP_TRY(file.reopen(last.at(0).get<uint64_t>() + last.at(1).get<uint64_t>()));
        for (const json& image : images) {
            auto held = std::make_shared<std::string>(image.at(1).get<size_t>(), '\0');
            const auto offset = image.at(0).get<uint64_t>();
            VCP_TRY(file.read(offset, std::as_writable_bytes(std::span(*held))));
            if (XXH3_64bits(held->data(), held->size()) != image.at(2).get<uint64_t>())
                return damagedTempFile(file.path(), offset);
            reader.images_.push_back(std::move(held));
        }
        return reader;
    }
    [[nodiscard]] ImageSource image(const json& j) const {
        if (j.is_null()) return {};
        if (j.is_array()) return {.path = textFromBytes(j), .bytes = {}};
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
    return json{{"name", bytesJson(m.name)},
                {"factor", m.factor},
                {"image", image},
                {"ignores alpha", m.ignoresAlpha},
                {"is cut out", m.isCutOut},
                {"wrap", {int(m.wrapU), int(m.wrapV)}},
                {"mask", mask},
                {"mask cutoff", std::bit_cast<uint64_t>(m.mask.cutoff)},
                {"mask rule", {m.mask.sparesGlass, m.mask.mayBeGrey}},
                {"mask place", bitsOf({m.mask.uvScale.x, m.mask.uvScale.y, m.mask.uvOffset.x, m.mask.uvOffset.y})},
                {"channel images", {normals, surface, emission}},
                {"channel factors", bitsOf({c.normalScale, c.roughness, c.metalness, c.emissionFactor.x,
                                            c.emissionFactor.y, c.emissionFactor.z})}};
}

Material materialFrom(const json& j, const ImageReader& images) {
    Material m;
    m.name = textFromBytes(j.at("name"));
    m.factor = j.at("factor").get<Rgba8>();
    m.image = images.image(j.at("image"));
    m.ignoresAlpha = j.at("ignores alpha").get<bool>();
    m.isCutOut = j.at("is cut out").get<bool>();
    m.wrapU = Wrap(j.at("wrap").at(0).get<uint8_t>());
    m.wrapV = Wrap(j.at("wrap").at(1).get<uint8_t>());
    m.mask.image = images.image(j.at("mask"));
    m.mask.cutoff = std::bit_cast<double>(j.at("mask cutoff").get<uint64_t>());
    m.mask.sparesGlass = j.at("mask rule").at(0).get<bool>();
    m.mask.mayBeGrey = j.at("mask rule").at(1).get<bool>();
    const json& place = j.at("mask place");
    m.mask.uvScale = {numberAt(place, 0), numberAt(place, 1)};
    m.mask.uvOffset = {numberAt(place, 2), numberAt(place, 3)};
    MaterialChannels& c = m.channels;
    c.normals = images.image(j.at("channel images").at(0));
    c.surface = images.image(j.at("channel images").at(1));
    c.emission = images.image(j.at("channel images").at(2));
    const json& factors = j.at("channel factors");
    c.normalScale = numberAt(factors, 0);
    c.roughness = numberAt(factors, 1);
    c.metalness = numberAt(factors, 2);
    c.emissionFactor = {numberAt(factors, 3), numberAt(factors, 4), numberAt(factors, 5)};
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

Result<std::vector<Material>> recordedMaterials(const json& recorded, TempSpace& space, bool withImages) {
    VCP_TRY_ASSIGN(const auto images, ImageReader::open(recorded.at("images"), space, withImages));
    std::vector<Material> materials;
    for (const json& row : recorded.at("materials")) materials.push_back(materialFrom(row, images));
    return materials;
}

}  // namespace vcp
