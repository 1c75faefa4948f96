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

/// An image of a material that the file keeps.
struct KeptImage {
    Material material;  ///< that has it as its colour, if only for this
    TexelKind kind = TexelKind::Colours;
    bool isChannel = false;  ///< nobody else reads it, and says that it cannot be read
};

// A PNG of one white texel.
constexpr unsigned char kWhitePng[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00,
    0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x00, 0x00, 0x00, 0x00, 0x3a, 0x7e, 0x9b, 0x55, 0x00,
    0x00, 0x00, 0x0a, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0xf8, 0x0f, 0x00, 0x01, 0x01, 0x01, 0x00,
    0xb1, 0x38, 0xf6, 0x14, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

/// Returns the image of a material's colour: a white one where only its channels have images.
KeptImage colourOf(const Material& material) {
    static const auto white = std::make_shared<const std::string>(std::begin(kWhitePng), std::end(kWhitePng));
    KeptImage kept{.material = material};
    if (!material.image.exists()) kept.material.image.bytes = white;
    return kept;
}

/// Returns the image of a channel, all of it opaque.
KeptImage channelOf(const ImageSource& image, TexelKind kind) {
    Material material;
    material.image = image;
    material.ignoresAlpha = true;
    return {material, kind, true};
}

/// Returns all images that the file keeps of a material.
std::vector<KeptImage> imagesOf(const Material& material) {
    std::vector<KeptImage> images;
    if (!material.hasImages()) return images;
    images.push_back(colourOf(material));
    const MaterialChannels& channels = material.channels;
    if (channels.normals.exists()) images.push_back(channelOf(channels.normals, TexelKind::Numbers));
    if (channels.surface.exists()) images.push_back(channelOf(channels.surface, TexelKind::Numbers));
    if (channels.emission.exists()) images.push_back(channelOf(channels.emission, TexelKind::Colours));
    return images;
}

/// Names an image by where it comes from, what its alpha or its mask does, and how it is averaged: it is decoded once
/// for all materials that have it.
using SourceKey = std::pair<std::filesystem::path, const std::string*>;
using ImageKey = std::tuple<SourceKey, bool, bool, SourceKey, TexelKind>;
SourceKey keyOf(const ImageSource& source) { return {source.path, source.bytes.get()}; }
ImageKey keyOf(const KeptImage& image) {
    const Material& material = image.material;
    return {keyOf(material.image), material.ignoresAlpha, material.isCutOut,
            material.isCutOut && material.ignoresAlpha ? keyOf(material.mask.image) : SourceKey(), image.kind};
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
    CodedImage(ImageRows& image, TexelKind kind, uint64_t firstTile, const ImageQuality& quality, PageSpool& work)
        : image_(image),
          kind_(kind),
          quality_(quality),
          levels_(imageLevels(image.size().x, image.size().y, firstTile, kLargeTileEdge)),
          work_(work),
          places_(tilesOf(levels_)) {}

    [[nodiscard]] const std::vector<ImageLevel>& levels() const { return levels_; }

    /// Reads the image, and codes its tiles. Returns why it cannot be read; nothing where it was. Errors: Io,
    /// Cancelled.
    Result<std::optional<Error>> code(const std::function<bool(double)>& progress) {
        Result<void> coded;
        const auto take = [&](size_t level, uint32_t firstRow, std::span<const Rgba8> rows) -> Result<void> {
            if (level == 0 && !progress(double(firstRow) / double(levels_[0].height)))
                coded = Error::cancelled();
            else
                coded = codeRow(level, firstRow / kLargeTileEdge, rows);
            return coded;
        };
        const auto read = readLevels(image_, take, kind_);
        if (!coded) return coded.error();
        return read ? std::optional<Error>() : std::optional(read.error());
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
    const TexelKind kind_;
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
    [[nodiscard]] Result<std::optional<ImageRow>> add(const KeptImage& kept, uint64_t firstTile,
                                                      const std::function<bool(double)>& progress) const {
        if (!progress(0)) return Error::cancelled();
        const auto opened = openImage(kept.material);
        if (!opened) return leaveOut(kept, opened.error());
        if (const auto tooLarge = tooLargeFor(imageBytes, kept.material.image, **opened)) {
            if (options.keepImages) return *tooLarge;
            warnings.push_back(tooLarge->line() + "; it is left out");
            return std::optional<ImageRow>();
        }
        CodedImage image(**opened, kept.kind, firstTile, options.imageQuality, work);
        VCP_TRY_ASSIGN(const auto unread, image.code(progress));
        if (!unread) VCP_TRY(image.appendTo(spool));
        work.remove();
        if (unread) return leaveOut(kept, namedImageError(kept.material.image, *unread));
        const glm::uvec2 size = (*opened)->size();
        return std::optional(ImageRow{size.x, size.y, uint32_t(image.levels().size()), kMixedTiles, firstTile});
    }

private:
    [[nodiscard]] std::optional<ImageRow> leaveOut(const KeptImage& kept, const Error& error) const {
        if (kept.isChannel) warnings.push_back(error.line() + "; its material does without");
        return {};
    }
};

/// Returns the row of a material's channels; none where they have no image that can be read, and do not shine.
/// `numberOf`: returns an image's number in the file, or nothing where it cannot be read.
template <class NumberOf>
Result<ChannelRow> storedChannels(MaterialChannels channels, const NumberOf& numberOf) {
    ChannelRow row;
    const auto keep = [&](const ImageSource& image, TexelKind kind, uint32_t& to) -> Result<bool> {
        if (!image.exists()) return true;
        VCP_TRY_ASSIGN(const auto number, numberOf(channelOf(image, kind)));
        if (number) to = *number + 1;
        return number.has_value();
    };
    VCP_TRY_ASSIGN(const bool hasNormals, keep(channels.normals, TexelKind::Numbers, row.normals));
    VCP_TRY_ASSIGN(const bool hasSurface, keep(channels.surface, TexelKind::Numbers, row.surface));
    VCP_TRY_ASSIGN(const bool hasEmission, keep(channels.emission, TexelKind::Colours, row.emission));
    if (!hasNormals) channels.forgetNormals();
    if (!hasSurface) channels.forgetSurface();
    if (!hasEmission) channels.forgetEmission();
    if (!channels.exist()) return ChannelRow();
    row.isGiven = 1;
    row.normalScale = channels.normalScale;
    row.roughness = channels.roughness;
    row.metalness = channels.metalness;
    for (int i = 0; i < 3; ++i) row.emissionFactor[i] = channels.emissionFactor[i];
    return row;
}

/// Returns by how many bits the coordinates of the last material may be coarser than steps: so that they still tell
/// apart what is between the texels of all its images.
uint32_t stepsAside(const ImageTables& tables) {
    uint32_t edge = 1;
    const auto widen = [&](uint32_t image) {
        edge = std::max({edge, tables.images[image].width, tables.images[image].height});
    };
    forEachImage(tables, uint32_t(tables.materials.size() - 1), widen);
    const uint32_t bits = uint32_t(std::bit_width(edge - 1)) + kBitsBelowTexels;
    return uint32_t(-kLog2TextureUnit) - std::min(bits, uint32_t(-kLog2TextureUnit));
}

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
        const auto numberOf = [&](const KeptImage& kept) -> Result<std::optional<uint32_t>> {
            const auto [number, isNew] = numbers.try_emplace(keyOf(kept));
            if (!isNew) return number->second;
            const auto part = [&](double done) { return progress((double(i) + done) / double(materials.size())); };
            VCP_TRY_ASSIGN(const auto row, store.add(kept, tiles, part));
            if (!row) return number->second;
            number->second = uint32_t(tables.images.size());
            tables.images.push_back(*row);
            tiles += tilesOf(levelsOf(*row));
            return number->second;
        };
        const Material& material = materials[i];
        if (!material.hasImages()) continue;
        VCP_TRY_ASSIGN(const auto number, numberOf(colourOf(material)));
        if (!number) continue;
        tables.materials.push_back({*number, material.factor, storedWrap(material.wrapU), storedWrap(material.wrapV)});
        VCP_TRY_ASSIGN(const auto channels, storedChannels(material.channels, numberOf));
        tables.channels.push_back(channels);
        placed[i] = {uint32_t(tables.materials.size()), stepsAside(tables)};
    }
    if (tables.images.empty()) return std::vector<PlacedMaterial>();
    const auto isGiven = [](const ChannelRow& row) { return row.isGiven != 0; };
    if (std::none_of(tables.channels.begin(), tables.channels.end(), isGiven)) tables.channels.clear();
    // The numbers of rows stand before them.
    const uint32_t counts[3] = {uint32_t(tables.images.size()), uint32_t(tables.materials.size()),
                                uint32_t(tables.channels.size())};
    StoredPage stored{.geometry = tables.stored(), .colour = {}};
    const auto first = std::as_bytes(std::span(counts));
    stored.geometry.insert(stored.geometry.begin(), first.begin(), first.end());
    VCP_TRY(spool.append({}, stored));
    return placed;
}

uint64_t expectedImageBytes(std::span<const Material> materials) {
    std::map<ImageKey, double> bytes;
    for (const Material& material : materials)
        for (const KeptImage& kept : imagesOf(material)) {
            const ImageSource& image = kept.material.image;
            std::error_code missing;
            const auto size = image.bytes ? image.bytes->size() : std::filesystem::file_size(image.path, missing);
            const bool isPng = image.bytes ? image.bytes->starts_with("\x89PNG") : image.path.extension() == ".png";
            bytes[keyOf(kept)] = missing ? 0 : (isPng ? kStoredOfPng : kStoredOfJpeg) * double(size);
        }
    return uint64_t(std::accumulate(bytes.begin(), bytes.end(), 0.0,
                                    [](double sum, const auto& image) { return sum + image.second; }));
}

uint64_t expectedImageMemory(std::span<const Material> materials, uint64_t textureBytes) {
    std::set<ImageKey> known;
    uint64_t rows = 0, textures = 0;
    for (const Material& material : materials)
        for (const KeptImage& kept : imagesOf(material)) {
            if (!known.insert(keyOf(kept)).second) continue;
            const auto image = openImage(kept.material);
            if (!image) continue;
            rows = std::max(rows, memoryFor(**image));
            // Colours at vertices come from the image of the colour alone.
            if (keyOf(kept.material.image) == keyOf(material.image)) textures += Texture::bytesOf((*image)->size());
        }
    return rows + std::min(textures, textureBytes);
}

double expectedImageSeconds(uint64_t bytes) { return kSecondsOfByte * double(bytes); }

Result<ImageTables> storedTables(const PageSpool& spool) {
    ImageTables tables;
    if (spool.entries().empty()) return tables;
    const std::span tiles = std::span(spool.entries()).first(spool.entries().size() - 1);
    VCP_TRY_ASSIGN(const auto stored, spool.read(spool.entries().back()));
    uint32_t counts[3];
    std::memcpy(counts, stored.geometry.data(), sizeof counts);
    tables.images.resize(counts[0]);
    tables.materials.resize(counts[1]);
    tables.channels.resize(counts[2]);
    const std::byte* rows = stored.geometry.data() + sizeof counts;
    const auto take = [&rows](auto& table) {
        const size_t bytes = std::as_bytes(std::span(table)).size();
        if (bytes > 0) std::memcpy(table.data(), rows, bytes);
        rows += bytes;
    };
    take(tables.images), take(tables.materials), take(tables.channels);
    for (const PageEntry& tile : tiles) tables.tiles.push_back({0, tile.hash, tile.storedBytes, 0});
    return tables;
}

}  // namespace vcp
