#include "builder/image_store.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>

#include <oneapi/tbb/parallel_for.h>

#include "builder/texture/jpeg_blocks.h"
#include "builder/texture/texture.h"
#include "octree/image/jpeg_tile.h"
#include "octree/image/tile_codec.h"

namespace vcp {

namespace {

// Coordinates have so many bits more than tell texels apart.
constexpr uint32_t kBitsBelowTexels = 5;
// What levels above the finest are coded with, unless somebody says it.
constexpr int kLeastQuality = 80, kBestQuality = 95;
// Tiles that are coded before they are written.
constexpr size_t kTilesAtOnce = 64;
// What images take in a file, of what their own files take: JPEGs with their coarser levels, and PNGs.
constexpr double kStoredOfJpeg = 1.5, kStoredOfPng = 0.9;

/// Names an image by where it comes from, and whether its alpha counts: it is decoded once for all materials that have
/// it.
using ImageKey = std::tuple<std::filesystem::path, const std::string*, bool>;
ImageKey keyOf(const Material& material) {
    return {material.image.path, material.image.bytes.get(), material.ignoresAlpha};
}

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

/// Codes a tile in as few bytes as it may have. `blocks`: of the source's JPEG; may be null. `quality`: of a JPEG that
/// it may be, too; 0: none.
std::vector<std::byte> packed(const Image& image, const ImageLevel& level, glm::uvec2 tile, const JpegBlocks* blocks,
                              int quality) {
    const glm::uvec2 size = level.sizeOf(tile);
    const std::vector<uint32_t> texels = texelsOf(image, level, tile);
    std::vector<std::byte> least = packTile(texels, size);
    const auto take = [&](std::vector<std::byte> other) {
        if (!other.empty() && other.size() < least.size()) least = std::move(other);
    };
    if (blocks != nullptr) take(blocks->tile(level, tile));
    const auto isOpaque = [](uint32_t texel) { return texel >> 24 == 255; };
    if (quality > 0 && std::all_of(texels.begin(), texels.end(), isOpaque))
        if (auto coded = packJpeg(texels, size, quality)) take(*std::move(coded));
    return least;
}

/// Appends the tiles of an image, coarse levels first. `blocks`: of its JPEG; may be null.
Result<void> appendTiles(const Texture& texture, const std::vector<ImageLevel>& levels, const JpegBlocks* blocks,
                         const ImageQuality& quality, PageSpool& spool) {
    const int own = blocks != nullptr ? std::clamp(blocks->quality(), kLeastQuality, kBestQuality) : kBestQuality;
    const int coarser = quality.coarser.value_or(own);
    for (size_t l = levels.size(); l-- > 0;) {
        const std::vector<glm::uvec2> order = tileOrder(levels[l]);
        const bool isFinest = l == 0;
        for (size_t first = 0; first < order.size(); first += kTilesAtOnce) {
            std::vector<StoredPage> tiles(std::min(kTilesAtOnce, order.size() - first));
            tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t i) {
                tiles[i].geometry =
                    packed(texture.levels()[l], levels[l], order[first + i], isFinest ? blocks : nullptr,
                           isFinest ? quality.finest.value_or(0) : coarser);
            });
            for (const StoredPage& tile : tiles) VCP_TRY(spool.append({}, tile));
        }
    }
    return {};
}

/// An image that is to be stored.
struct SourceImage {
    Texture texture;
    std::unique_ptr<JpegBlocks> blocks;  // of the source's JPEG; may be null
};

/// Loads an image; nothing where it cannot be read. `withBlocks`: if it is a JPEG. Errors: Limit.
Result<std::optional<SourceImage>> loadSource(const Material& material, bool withBlocks, uint64_t imageBytes) {
    ImageLimits limits;
    // Its levels take a third as much again, and its blocks up to half as much again.
    const uint64_t most = imageBytes / 3;
    const bool isScarce = most < limits.bytes;
    limits.bytes = std::min(limits.bytes, most);
    const auto file = imageFile(material.image, limits);
    auto image = file ? decodeImage(material.image, **file, limits) : file.error();
    if (image && material.ignoresAlpha) ignoreAlpha(*image);
    if (image)
        return std::optional(SourceImage{Texture(*std::move(image), material.wrapU, material.wrapV),
                                         withBlocks ? JpegBlocks::read(**file) : nullptr});
    if (image.error().code != ErrorCode::Limit || !isScarce) return std::optional<SourceImage>();
    Error error = image.error();
    error.message += "; where that is for lack of memory, let the memory cap be larger";
    return error;
}

}  // namespace

Result<std::vector<PlacedMaterial>> storeImages(std::span<const Material> materials, const BuildOptions& options,
                                                uint64_t imageBytes, PageSpool& spool,
                                                std::vector<std::string>& warnings,
                                                const std::function<bool(double)>& progress) {
    std::vector<PlacedMaterial> placed(materials.size());
    std::map<ImageKey, std::optional<uint32_t>> numbers;  // nothing: it cannot be read
    ImageTables tables;
    uint64_t tiles = 0;
    for (size_t i = 0; i < materials.size(); ++i) {
        const Material& material = materials[i];
        if (!material.image.exists()) continue;
        const auto [number, isNew] = numbers.try_emplace(keyOf(material));
        if (isNew) {
            if (!progress(double(i) / double(materials.size()))) return Error::cancelled();
            const auto loaded = loadSource(material, options.imageQuality.finest != 0, imageBytes);
            if (!loaded && options.keepImages) return loaded.error();
            if (!loaded) warnings.push_back(loaded.error().line() + "; it is left out");
            if (!loaded || !*loaded) continue;
            const SourceImage& source = **loaded;
            const glm::uvec2 size = source.texture.size();
            const auto levels = imageLevels(size.x, size.y, tiles, kLargeTileEdge);
            VCP_TRY(appendTiles(source.texture, levels, source.blocks.get(), options.imageQuality, spool));
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

uint64_t expectedImageBytes(std::span<const Material> materials) {
    std::map<ImageKey, double> bytes;
    for (const Material& material : materials) {
        if (!material.image.exists()) continue;
        std::error_code missing;
        const auto size = material.image.bytes ? material.image.bytes->size()
                                               : std::filesystem::file_size(material.image.path, missing);
        const bool isPng = material.image.bytes ? material.image.bytes->starts_with("\x89PNG")
                                                : material.image.path.extension() == ".png";
        bytes[keyOf(material)] = missing ? 0 : (isPng ? kStoredOfPng : kStoredOfJpeg) * double(size);
    }
    return uint64_t(std::accumulate(bytes.begin(), bytes.end(), 0.0,
                                    [](double sum, const auto& image) { return sum + image.second; }));
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
