#include "builder/image_store.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <optional>

#include <oneapi/tbb/parallel_for.h>

#include "builder/texture/jpeg_blocks.h"
#include "builder/texture/texture.h"
#include "octree/image/jpeg_tile.h"
#include "octree/image/tile_codec.h"

namespace vcp {

namespace {

// Coordinates have so many bits more than tell texels apart.
constexpr uint32_t kBitsBelowTexels = 5;

/// Names an image by where it comes from: it is decoded once for all materials that have it.
using ImageKey = std::pair<std::filesystem::path, const std::string*>;
ImageKey keyOf(const ImageSource& source) { return {source.path, source.bytes.get()}; }

ImageWrap storedWrap(Wrap wrap) {
    return wrap == Wrap::Clamp ? ImageWrap::Clamp : wrap == Wrap::Mirror ? ImageWrap::Mirror : ImageWrap::Repeat;
}

std::vector<uint32_t> texelsOf(const Image& image, const ImageLevel& level, glm::uvec2 tile) {
    const glm::uvec2 size = level.sizeOf(tile), first = tile * level.tileEdge;
    std::vector<uint32_t> texels;
    texels.reserve(size_t{size.x} * size.y);
    for (uint32_t y = 0; y < size.y; ++y) {
        const auto row = image.texels.begin() + std::ptrdiff_t(size_t{first.y + y} * image.width + first.x);
        texels.insert(texels.end(), row, row + size.x);
    }
    return texels;
}

/// Codes a tile. `quality`: of a JPEG; 0: without loss.
std::vector<std::byte> packed(const std::vector<uint32_t>& texels, glm::uvec2 size, int quality) {
    std::vector<std::byte> exact = packTile(texels, size);
    const auto isOpaque = [](uint32_t texel) { return texel >> 24 == 255; };
    if (quality == 0 || !std::all_of(texels.begin(), texels.end(), isOpaque)) return exact;
    auto lossy = packJpeg(texels, size, quality);
    return lossy && lossy->size() < exact.size() ? *std::move(lossy) : exact;
}

/// An image that is to be stored.
struct SourceImage {
    std::shared_ptr<const std::string> file;
    Texture texture;
};

/// Appends the tiles of an image, coarse levels first. `memoryBytes`: for blocks of a JPEG.
Result<void> appendTiles(const SourceImage& image, const std::vector<ImageLevel>& levels, const ImageQuality& quality,
                         uint64_t memoryBytes, PageSpool& spool) {
    const auto blocks = quality.finest ? nullptr : JpegBlocks::read(*image.file, memoryBytes);
    for (size_t l = levels.size(); l-- > 0;) {
        const std::vector<glm::uvec2> order = tileOrder(levels[l]);
        std::vector<StoredPage> tiles(order.size());
        tbb::parallel_for(size_t{0}, order.size(), [&](size_t i) {
            std::vector<std::byte>& tile = tiles[i].geometry;
            if (l == 0 && blocks) tile = blocks->tile(levels[l], order[i]);
            if (tile.empty())
                tile = packed(texelsOf(image.texture.levels()[l], levels[l], order[i]), levels[l].sizeOf(order[i]),
                              l > 0 ? quality.coarser : quality.finest.value_or(0));
        });
        for (const StoredPage& tile : tiles) VCP_TRY(spool.append({}, tile));
    }
    return {};
}

/// Loads an image; nothing where it cannot be read. Errors: Limit.
Result<std::optional<SourceImage>> loadSource(const Material& material, uint64_t imageBytes) {
    ImageLimits limits;
    // Its levels take a third as much again, and the coarser ones are made while the image itself is there.
    const uint64_t most = imageBytes / 2;
    const bool isScarce = most < limits.bytes;
    limits.bytes = std::min(limits.bytes, most);
    auto file = imageFile(material.image, limits);
    auto image = file ? decodeImage(material.image, **file, limits) : file.error();
    if (image) return std::optional(SourceImage{*file, Texture(*std::move(image), material.wrapU, material.wrapV)});
    if (image.error().code != ErrorCode::Limit || !isScarce) return std::optional<SourceImage>();
    Error error = image.error();
    error.message += "; where that is for lack of memory, let the memory cap be larger";
    return error;
}

}  // namespace

Result<std::vector<PlacedMaterial>> storeImages(std::span<const Material> materials, const ImageQuality& quality,
                                                uint64_t imageBytes, PageSpool& spool,
                                                const std::function<bool(double)>& progress) {
    std::vector<PlacedMaterial> placed(materials.size());
    std::map<ImageKey, std::optional<uint32_t>> numbers;  // nothing: it cannot be read
    ImageTables tables;
    uint64_t tiles = 0;
    for (size_t i = 0; i < materials.size(); ++i) {
        const Material& material = materials[i];
        if (!material.image.exists()) continue;
        const auto [number, isNew] = numbers.try_emplace(keyOf(material.image));
        if (isNew) {
            if (!progress(double(i) / double(materials.size()))) return Error::cancelled();
            VCP_TRY_ASSIGN(const auto source, loadSource(material, imageBytes));
            if (!source) continue;
            const glm::uvec2 size = source->texture.size();
            const auto levels = imageLevels(size.x, size.y, tiles, kLargeTileEdge);
            VCP_TRY(appendTiles(*source, levels, quality, imageBytes / 2, spool));
            number->second = uint32_t(tables.images.size());
            tables.images.push_back({size.x, size.y, uint32_t(levels.size()), kMixedTiles, tiles});
            tiles += tilesOf(levels);
        }
        if (!number->second) continue;
        const ImageRow& image = tables.images[*number->second];
        const uint32_t bits = uint32_t(std::bit_width(std::max(image.width, image.height) - 1)) + kBitsBelowTexels;
        tables.materials.push_back(
            {*number->second, material.factor, storedWrap(material.wrapU), storedWrap(material.wrapV)});
        placed[i] = {uint32_t(tables.materials.size()),
                     uint32_t(-kLog2TextureUnit) - std::min(bits, uint32_t(-kLog2TextureUnit))};
    }
    if (tables.images.empty()) return std::vector<PlacedMaterial>();
    // The numbers of rows stand before them.
    const uint32_t counts[2] = {uint32_t(tables.images.size()), uint32_t(tables.materials.size())};
    StoredPage stored{.geometry = tables.stored(), .colour = {}};
    const auto first = std::as_bytes(std::span(counts));
    stored.geometry.insert(stored.geometry.begin(), first.begin(), first.end());
    VCP_TRY(spool.append({}, stored));
    return placed;
}

Result<ImageTables> storedTables(const PageSpool& spool) {
    ImageTables tables;
    if (spool.entries().empty()) return tables;
    const std::span tiles = std::span(spool.entries()).first(spool.entries().size() - 1);
    VCP_TRY_ASSIGN(const auto stored, spool.read(spool.entries().back()));
    uint32_t counts[2];
    std::memcpy(counts, stored.geometry.data(), sizeof counts);
    tables.images.resize(counts[0]);
    tables.materials.resize(counts[1]);
    const std::byte* const rows = stored.geometry.data() + sizeof counts;
    std::memcpy(tables.images.data(), rows, counts[0] * sizeof(ImageRow));
    std::memcpy(tables.materials.data(), rows + counts[0] * sizeof(ImageRow), counts[1] * sizeof(MaterialRow));
    for (const PageEntry& tile : tiles) tables.tiles.push_back({0, tile.hash, tile.storedBytes, 0});
    return tables;
}

}  // namespace vcp
