#include "octree/image/image_tables.h"

#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "octree/image/jpeg_tile.h"
#include "octree/image/tile_codec.h"
#include "octree/io/content_hash.h"

namespace vcp {

namespace {

template <class Row>
void append(std::vector<std::byte>& bytes, const std::vector<Row>& rows) {
    const auto from = std::as_bytes(std::span(rows));
    bytes.insert(bytes.end(), from.begin(), from.end());
}

/// Copies rows from the front of `bytes`, which has room for them, and takes them off.
template <class Row>
std::vector<Row> takeRows(std::span<const std::byte>& bytes, uint64_t count) {
    std::vector<Row> rows(count);
    if (count > 0) std::memcpy(rows.data(), bytes.data(), count * sizeof(Row));
    bytes = bytes.subspan(count * sizeof(Row));
    return rows;
}

/// Returns the bytes of the rows that a section begins with, before its tiles'.
uint64_t bytesOfRows(const ImagesPlace& place) {
    return place.images * sizeof(ImageRow) + place.materials * sizeof(MaterialRow) +
           place.channels * sizeof(ChannelRow);
}

class TableCheck {
public:
    TableCheck(const ByteReader& reader, const ImagesPlace& place) : reader_(reader), place_(place) {}

    Result<ImageTables> run() {
        ImageTables tables;
        const uint64_t rowBytes = bytesOfRows(place_);
        std::vector<std::byte> bytes;
        VCP_TRY(extend(bytes, rowBytes));
        std::span<const std::byte> rest(bytes);
        tables.images = takeRows<ImageRow>(rest, place_.images);
        tables.materials = takeRows<MaterialRow>(rest, place_.materials);
        tables.channels = takeRows<ChannelRow>(rest, place_.channels);
        uint64_t tiles = 0;
        for (size_t i = 0; i < tables.images.size(); ++i) VCP_TRY(image(i, tables.images[i], tiles));
        for (size_t i = 0; i < tables.materials.size(); ++i) VCP_TRY(material(i, tables.materials[i]));
        for (size_t i = 0; i < tables.channels.size(); ++i) VCP_TRY(channels(i, tables.channels[i]));
        if (tiles > (place_.bytes - rowBytes) / sizeof(TileRow))
            return broken("images", 0, "there are fewer bytes than their tiles ask for");
        VCP_TRY(extend(bytes, rowBytes + tiles * sizeof(TileRow)));
        if (hashBytes(bytes) != place_.hash)
            return broken("images", 0, "the tables' hash does not match: the file was changed or damaged");
        rest = std::span<const std::byte>(bytes).subspan(rowBytes);
        tables.tiles = takeRows<TileRow>(rest, tiles);
        VCP_TRY(tileTable(tables));
        return tables;
    }

private:
    [[nodiscard]] Error broken(std::string element, uint64_t byteInSection, std::string message) const {
        return brokenBytes(reader_.name(), std::move(element), place_.offset + byteInSection, std::move(message));
    }

    /// Reads on until there are `size` bytes of the section.
    Result<void> extend(std::vector<std::byte>& bytes, uint64_t size) const {
        return readInPieces(reader_, place_.offset + bytes.size(), size - bytes.size(),
                            [&](std::span<const std::byte> piece) -> Result<void> {
                                bytes.insert(bytes.end(), piece.begin(), piece.end());
                                return {};
                            });
    }

    Result<void> image(size_t i, const ImageRow& row, uint64_t& tiles) const {
        const auto fail = [&](uint64_t field, const char* message) {
            return broken(fmt::format("image {}", i), i * sizeof(ImageRow) + field, message);
        };
        if (row.width < 1 || row.width > kMaxImageEdge || row.height < 1 || row.height > kMaxImageEdge)
            return fail(offsetof(ImageRow, width), "its size is out of range");
        if (row.coding != kLosslessTiles && row.coding != kMixedTiles)
            return fail(offsetof(ImageRow, coding), "its coding is not known: use a newer program");
        if (row.firstTile != tiles) return fail(offsetof(ImageRow, firstTile), "its first tile is another image's");
        const auto levels = levelsOf(row);
        if (row.levels != levels.size()) return fail(offsetof(ImageRow, levels), "its levels do not suit its size");
        tiles += tilesOf(levels);
        return {};
    }

    Result<void> material(size_t i, const MaterialRow& row) const {
        const auto fail = [&](uint64_t field, const char* message) {
            return broken(fmt::format("material {}", i),
                          place_.images * sizeof(ImageRow) + i * sizeof(MaterialRow) + field, message);
        };
        if (row.image >= place_.images) return fail(offsetof(MaterialRow, image), "names an image that there is not");
        if (row.wrapU > ImageWrap::Mirror || row.wrapV > ImageWrap::Mirror)
            return fail(offsetof(MaterialRow, wrapU), "its wrap modes are not known");
        for (size_t k = 0; k < std::size(row.reserved); ++k)
            if (row.reserved[k] != 0) return fail(offsetof(MaterialRow, reserved) + k, "reserved bytes must be zero");
        return {};
    }

    Result<void> channels(size_t i, const ChannelRow& row) const {
        const auto fail = [&](uint64_t field, const char* message) {
            return broken(fmt::format("channels of material {}", i),
                          place_.images * sizeof(ImageRow) + place_.materials * sizeof(MaterialRow) +
                              i * sizeof(ChannelRow) + field,
                          message);
        };
        if (row.isGiven > 1) return fail(offsetof(ChannelRow, isGiven), "they are there or not");
        static constexpr ChannelRow kNone;
        if (row.isGiven == 0)
            return std::memcmp(&row, &kNone, sizeof row) == 0 ? Result<void>() : fail(0, "there should be none");
        const std::pair<uint32_t, size_t> images[] = {{row.normals, offsetof(ChannelRow, normals)},
                                                      {row.surface, offsetof(ChannelRow, surface)},
                                                      {row.emission, offsetof(ChannelRow, emission)}};
        for (const auto& [number, at] : images)
            if (number > place_.images) return fail(at, "name an image that there is not");
        if (!(std::abs(row.normalScale) <= kMostNormalScale))
            return fail(offsetof(ChannelRow, normalScale), "the scale of their normals is out of range");
        if (!(row.roughness >= 0 && row.roughness <= 1))
            return fail(offsetof(ChannelRow, roughness), "their roughness is out of range");
        if (!(row.metalness >= 0 && row.metalness <= 1))
            return fail(offsetof(ChannelRow, metalness), "their metalness is out of range");
        for (size_t k = 0; k < std::size(row.emissionFactor); ++k)
            if (!(row.emissionFactor[k] >= 0 && row.emissionFactor[k] <= kMostEmission))
                return fail(offsetof(ChannelRow, emissionFactor) + k * sizeof(float), "their emission is out of range");
        return {};
    }

    /// Tiles follow each other, from the end of the tables to that of the section.
    [[nodiscard]] Result<void> tileTable(const ImageTables& tables) const {
        const uint64_t begin = tables.bytes(), before = begin - tables.tiles.size() * sizeof(TileRow);
        uint64_t end = begin;
        for (size_t i = 0; i < tables.tiles.size(); ++i) {
            const TileRow& row = tables.tiles[i];
            const uint64_t at = before + i * sizeof(TileRow);
            const std::string element = fmt::format("tile {}", i);
            if (row.offset != place_.offset + end || row.storedBytes > place_.bytes - end)
                return broken(element, at, "its bytes are out of range");
            if (row.reserved != 0)
                return broken(element, at + offsetof(TileRow, reserved), "reserved bytes must be zero");
            end += row.storedBytes;
        }
        if (end != place_.bytes) return broken("images", end, "the tiles do not fill their section");
        return {};
    }

    const ByteReader& reader_;
    const ImagesPlace& place_;
};

}  // namespace

std::vector<std::byte> ImageTables::stored() const {
    std::vector<std::byte> all;
    append(all, images);
    append(all, materials);
    append(all, channels);
    append(all, tiles);
    return all;
}

std::string wrongPlace(const ImagesPlace& place, uint64_t begin, uint64_t end) {
    if (place.images == 0 || place.materials == 0) return "there are no images";
    if (place.offset < begin || place.offset > end || place.bytes > end - place.offset)
        return "the section of images is out of range";
    if (place.channels != 0 && place.channels != place.materials) return "not all materials have a row of channels";
    if (place.reserved != 0) return "reserved bytes must be zero";
    if (bytesOfRows(place) > place.bytes) return "the section of images is too short for their tables";
    return {};
}

Result<ImageTables> readImageTables(const ByteReader& reader, const ImagesPlace& place) {
    return TableCheck(reader, place).run();
}

Result<StoredTiles> readTiles(const ByteReader& reader, const ImageTables& tables, uint64_t first, uint64_t count) {
    StoredTiles tiles{first, {}};
    if (count == 0) return tiles;
    const TileRow& last = tables.tiles[first + count - 1];
    const uint64_t begin = tables.tiles[first].offset;
    tiles.bytes.resize(last.offset + last.storedBytes - begin);
    VCP_TRY(reader.read(begin, tiles.bytes));
    return tiles;
}

Result<void> decodeTile(const std::string& file, const ImageTables& tables, const ImageRow& image,
                        const StoredTiles& tiles, uint64_t number, glm::uvec2 size, std::span<uint32_t> texels) {
    const TileRow& row = tables.tiles[number];
    const auto bytes = std::span(tiles.bytes).subspan(row.offset - tables.tiles[tiles.first].offset, row.storedBytes);
    const auto fail = [&](std::string message) {
        return brokenBytes(file, fmt::format("tile {}", number), row.offset, std::move(message));
    };
    if (hashBytes(bytes) != row.hash) return fail("its hash does not match: the file was changed or damaged");
    const bool mayBeJpeg = image.coding == kMixedTiles;
    const auto done = mayBeJpeg && isJpeg(bytes) ? unpackJpeg(bytes, size, texels) : unpackTile(bytes, size, texels);
    if (!done) return fail(done.error().message);
    return {};
}

Result<void> verifyImages(const ByteReader& reader, const ImagesPlace& place,
                          const std::function<bool(uint64_t)>& progress) {
    VCP_TRY_ASSIGN(const auto tables, readImageTables(reader, place));
    std::vector<uint32_t> texels(size_t{kLargeTileEdge} * kLargeTileEdge);
    for (const ImageRow& image : tables.images)
        for (const ImageLevel& level : levelsOf(image)) {
            uint64_t number = level.firstTile;
            for (const glm::uvec2 tile : tileOrder(level)) {
                VCP_TRY_ASSIGN(const auto stored, readTiles(reader, tables, number, 1));
                VCP_TRY(decodeTile(reader.name(), tables, image, stored, number, level.sizeOf(tile), texels));
                const TileRow& row = tables.tiles[number++];
                if (!progress(row.offset + row.storedBytes)) return Error::cancelled(reader.name());
            }
        }
    return {};
}

}  // namespace vcp
