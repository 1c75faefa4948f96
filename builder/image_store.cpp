#include "builder/image_store.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include "builder/texture/jpeg_blocks.h"
#include "builder/texture/level_bands.h"
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
constexpr uint32_t kTilesAtOnce = 32;
// Memory for them, and for the texels of those that are being coded.
constexpr uint64_t kCodedBytes = uint64_t{16} << 20;
// What images take in a file, of what their own files take: JPEGs with their coarser levels, and PNGs.
constexpr double kStoredOfJpeg = 1.5, kStoredOfPng = 0.9;
// Time to read and code what becomes a byte of the file, on two cores.
constexpr double kSecondsOfByte = 0.3e-6;

/// Names an image by where it comes from, and what its alpha or its mask does: it is decoded once for all materials
/// that have it.
using SourceKey = std::pair<std::filesystem::path, const std::string*>;
using ImageKey = std::tuple<SourceKey, bool, bool, SourceKey>;
SourceKey keyOf(const ImageSource& source) { return {source.path, source.bytes.get()}; }
ImageKey keyOf(const Material& material) {
    return {keyOf(material.image), material.ignoresAlpha, material.isCutOut,
            material.isCutOut && material.ignoresAlpha ? keyOf(material.mask.image) : SourceKey()};
}

ImageWrap storedWrap(Wrap wrap) {
    return wrap == Wrap::Clamp ? ImageWrap::Clamp : wrap == Wrap::Mirror ? ImageWrap::Mirror : ImageWrap::Repeat;
}

/// Returns a tile's texels. `rows`: of its row of tiles.
std::vector<uint32_t> texelsOf(std::span<const Rgba8> rows, const ImageLevel& level, glm::uvec2 tile) {
    const glm::uvec2 size = level.sizeOf(tile);
    std::vector<uint32_t> texels;
    texels.reserve(size_t{size.x} * size.y);
    for (uint32_t y = 0; y < size.y; ++y) {
        const auto row = rows.begin() + std::ptrdiff_t(size_t{y} * level.width + size_t{tile.x} * level.tileEdge);
        texels.insert(texels.end(), row, row + size.x);
    }
    return texels;
}

/// Codes a tile in as few bytes as it may have. `blocks`: of the source's JPEG; may be null. `quality`: of a JPEG that
/// it may be, too; 0: none.
std::vector<std::byte> packed(std::span<const Rgba8> rows, const ImageLevel& level, glm::uvec2 tile,
                              const JpegBlocks* blocks, int quality) {
    const glm::uvec2 size = level.sizeOf(tile);
    const std::vector<uint32_t> texels = texelsOf(rows, level, tile);
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

/// An image whose tiles are coded while its rows are read.
class CodedImage {
public:
    /// `work`: where tiles are kept in the order they are made in.
    CodedImage(ImageRows& image, uint64_t firstTile, const ImageQuality& quality, PageSpool& work)
        : image_(image),
          quality_(quality),
          levels_(imageLevels(image.size().x, image.size().y, firstTile, kLargeTileEdge)),
          work_(work),
          places_(tilesOf(levels_)) {}

    [[nodiscard]] const std::vector<ImageLevel>& levels() const { return levels_; }

    /// Reads the image, and codes its tiles. Returns whether it could be read. Errors: Io, Cancelled.
    Result<bool> code(const std::function<bool(double)>& progress) {
        Result<void> coded;
        const auto take = [&](size_t level, uint32_t firstRow, std::span<const Rgba8> rows) -> Result<void> {
            if (level == 0 && !progress(double(firstRow) / double(levels_[0].height)))
                coded = Error::cancelled();
            else
                coded = codeRow(level, firstRow / kLargeTileEdge, rows);
            return coded;
        };
        const auto read = readLevels(image_, take);
        if (!coded) return coded.error();
        return read.ok();
    }

    /// Appends the tiles to what the file will have, coarse levels first. Errors: Io, InvalidInput (damaged).
    Result<void> appendTo(PageSpool& spool) const {
        for (size_t level = levels_.size(); level-- > 0;)
            for (const glm::uvec2 tile : tileOrder(levels_[level])) {
                VCP_TRY_ASSIGN(const auto coded, work_.read(work_.entries()[places_[numberOf(level, tile)]]));
                VCP_TRY(spool.append({}, coded));
            }
        return {};
    }

private:
    [[nodiscard]] size_t numberOf(size_t level, glm::uvec2 tile) const {
        return size_t(levels_[level].firstTile - levels_.back().firstTile) + size_t{tile.y} * levels_[level].tilesX() +
               tile.x;
    }

    Result<void> codeRow(size_t level, uint32_t row, std::span<const Rgba8> texels) {
        const JpegBlocks* const blocks = quality_.finest == 0 ? nullptr : image_.blocks();
        const int own = blocks != nullptr ? std::clamp(blocks->quality(), kLeastQuality, kBestQuality) : kBestQuality;
        const bool isFinest = level == 0;
        const int quality = isFinest ? quality_.finest.value_or(0) : quality_.coarser.value_or(own);
        const ImageLevel& of = levels_[level];
        for (uint32_t first = 0; first < of.tilesX(); first += kTilesAtOnce) {
            std::vector<StoredPage> tiles(std::min(kTilesAtOnce, of.tilesX() - first));
            tbb::parallel_for(size_t{0}, tiles.size(), [&](size_t i) {
                tiles[i].geometry =
                    packed(texels, of, {first + uint32_t(i), row}, isFinest ? blocks : nullptr, quality);
            });
            for (uint32_t i = 0; i < tiles.size(); ++i) {
                places_[numberOf(level, {first + i, row})] = uint32_t(work_.entries().size());
                VCP_TRY(work_.append({}, tiles[i]));
            }
        }
        return {};
    }

    ImageRows& image_;
    const ImageQuality& quality_;
    std::vector<ImageLevel> levels_;
    PageSpool& work_;
    std::vector<uint32_t> places_;  ///< of each tile, row by row of each level: its number in the work
};

uint64_t memoryFor(const ImageRows& image) { return levelBandBytes(image.size()) + image.heldBytes() + kCodedBytes; }

/// Returns the error that an image takes more memory than there is for one; nothing where it does not.
std::optional<Error> tooLargeFor(uint64_t imageBytes, const ImageSource& source, const ImageRows& image) {
    const glm::uvec2 size = image.size();
    const uint64_t needed = memoryFor(image);
    if (needed <= imageBytes) return {};
    return namedImageError(
        source, {.code = ErrorCode::Limit,
                 .message = fmt::format("a picture of {} by {} texels takes {} MiB while it is read, and {} MiB are "
                                        "there for it; let the memory cap be larger",
                                        size.x, size.y, (needed >> 20) + 1, imageBytes >> 20)});
}

/// Where images are coded to, and what with.
struct ImageStore {
    const BuildOptions& options;
    uint64_t imageBytes;
    PageSpool& work;
    PageSpool& spool;
    std::vector<std::string>& warnings;

    /// Codes an image whose first tile has that number. Returns its row in the tables; nothing where it is left out.
    /// Errors: as storeImages().
    [[nodiscard]] Result<std::optional<ImageRow>> add(const Material& material, uint64_t firstTile,
                                                      const std::function<bool(double)>& progress) const {
        if (!progress(0)) return Error::cancelled();
        const auto opened = openImage(material);
        if (!opened) return std::optional<ImageRow>();
        if (const auto tooLarge = tooLargeFor(imageBytes, material.image, **opened)) {
            if (options.keepImages) return *tooLarge;
            warnings.push_back(tooLarge->line() + "; it is left out");
            return std::optional<ImageRow>();
        }
        CodedImage image(**opened, firstTile, options.imageQuality, work);
        VCP_TRY_ASSIGN(const bool isCoded, image.code(progress));
        if (isCoded) VCP_TRY(image.appendTo(spool));
        work.remove();
        if (!isCoded) return std::optional<ImageRow>();
        const glm::uvec2 size = (*opened)->size();
        return std::optional(ImageRow{size.x, size.y, uint32_t(image.levels().size()), kMixedTiles, firstTile});
    }
};

}  // namespace

Result<std::vector<PlacedMaterial>> storeImages(std::span<const Material> materials, const BuildOptions& options,
                                                uint64_t imageBytes, TempSpace& space, PageSpool& spool,
                                                std::vector<std::string>& warnings,
                                                const std::function<bool(double)>& progress) {
    std::vector<PlacedMaterial> placed(materials.size());
    std::map<ImageKey, std::optional<uint32_t>> numbers;  // nothing: it cannot be read
    ImageTables tables;
    uint64_t tiles = 0;
    PageSpool work(space, 0, "tile");
    const ImageStore store{options, imageBytes, work, spool, warnings};
    for (size_t i = 0; i < materials.size(); ++i) {
        const Material& material = materials[i];
        if (!material.image.exists()) continue;
        const auto [number, isNew] = numbers.try_emplace(keyOf(material));
        if (isNew) {
            const auto part = [&](double done) { return progress((double(i) + done) / double(materials.size())); };
            VCP_TRY_ASSIGN(const auto row, store.add(material, tiles, part));
            if (row) {
                number->second = uint32_t(tables.images.size());
                tables.images.push_back(*row);
                tiles += tilesOf(levelsOf(*row));
            }
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

uint64_t expectedImageMemory(std::span<const Material> materials, uint64_t textureBytes) {
    std::set<ImageKey> known;
    uint64_t rows = 0, textures = 0;
    for (const Material& material : materials) {
        if (!material.image.exists() || !known.insert(keyOf(material)).second) continue;
        const auto image = openImage(material);
        if (!image) continue;
        rows = std::max(rows, memoryFor(**image));
        textures += Texture::bytesOf((*image)->size());
    }
    return rows + std::min(textures, textureBytes);
}

double expectedImageSeconds(uint64_t bytes) { return kSecondsOfByte * double(bytes); }

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
