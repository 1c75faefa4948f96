#include "octree/image/image_pieces.h"

#include <algorithm>

namespace vcp {

namespace {

uint64_t piecesOfLevel(const ImageLevel& level) { return (level.tiles() + kPieceTiles - 1) / kPieceTiles; }

}  // namespace

Result<std::shared_ptr<const ImagePieces>> ImagePieces::read(const ByteReader& reader, const ImagesPlace& place) {
    VCP_TRY_ASSIGN(auto tables, readImageTables(reader, place));
    return std::make_shared<const ImagePieces>(std::move(tables));
}

ImagePieces::ImagePieces(ImageTables tables) : tables_(std::move(tables)) {
    places_.reserve(tables_.tiles.size());
    for (const ImageRow& image : tables_.images) {
        levels_.push_back(imageLevels(image.width, image.height, image.firstTile));
        const std::vector<ImageLevel>& levels = levels_.back();
        auto first = uint32_t(levels.size() - 1);
        while (first > 0 && levels[first - 1].tiles() == 1) --first;
        firstLevel_.push_back(first);
        uint64_t pieces = 1;
        for (uint32_t level = 0; level < first; ++level) pieces += piecesOfLevel(levels[level]);
        firstPiece_.push_back(firstPiece_.back() + pieces);
        for (auto level = levels.rbegin(); level != levels.rend(); ++level)
            for (const glm::uvec2 tile : tileOrder(*level)) places_.push_back({uint16_t(tile.x), uint16_t(tile.y)});
    }
}

ImagePieces::Range ImagePieces::piecesOf(uint32_t image, uint32_t level) const {
    uint64_t first = firstPiece_[image];
    if (level >= firstLevel_[image]) return {first, first + 1};
    ++first;
    for (uint32_t coarser = firstLevel_[image] - 1; coarser > level; --coarser)
        first += piecesOfLevel(levels_[image][coarser]);
    return {first, first + piecesOfLevel(levels_[image][level])};
}

ImagePiece ImagePieces::piece(uint64_t number) const {
    ImagePiece piece;
    piece.image =
        uint32_t(std::upper_bound(firstPiece_.begin() + 1, firstPiece_.end(), number) - firstPiece_.begin() - 1);
    const std::vector<ImageLevel>& levels = levels_[piece.image];
    piece.level = firstLevel_[piece.image];
    uint64_t before = number - firstPiece_[piece.image];
    if (before == 0) {
        piece.firstTile = levels.back().firstTile;
        piece.tiles = levels.size() - piece.level;
        for (size_t level = piece.level; level < levels.size(); ++level) piece.texels += levels[level].texels();
        return piece;
    }
    --before;
    while (before >= piecesOfLevel(levels[--piece.level])) before -= piecesOfLevel(levels[piece.level]);
    const ImageLevel& level = levels[piece.level];
    piece.firstTile = level.firstTile + before * kPieceTiles;
    piece.tiles = std::min(kPieceTiles, level.tiles() - before * kPieceTiles);
    for (uint64_t tile = piece.firstTile; tile < piece.firstTile + piece.tiles; ++tile) {
        const glm::uvec2 size = level.sizeOf(placeOf(tile));
        piece.texels += uint64_t{size.x} * size.y;
    }
    return piece;
}

ImagePieces::Extent ImagePieces::extentOf(const ImagePiece& piece) const {
    const TileRow& last = tables_.tiles[piece.firstTile + piece.tiles - 1];
    return {tables_.tiles[piece.firstTile].offset, last.offset + last.storedBytes};
}

Result<std::vector<uint32_t>> ImagePieces::readPiece(const ByteReader& reader, uint64_t number) const {
    const ImagePiece piece = this->piece(number);
    VCP_TRY_ASSIGN(const auto stored, readTiles(reader, tables_, piece.firstTile, piece.tiles));
    const std::vector<ImageLevel>& levels = levels_[piece.image];
    std::vector<uint32_t> texels(piece.texels);
    std::span<uint32_t> rest(texels);
    size_t level = piece.level;
    // The first piece begins with the coarsest level and goes on with a level a tile.
    const bool isFirst = piece.level == firstLevel_[piece.image];
    if (isFirst) level = levels.size() - 1;
    for (uint64_t tile = piece.firstTile; tile < piece.firstTile + piece.tiles; ++tile) {
        const glm::uvec2 size = levels[level].sizeOf(placeOf(tile));
        const size_t count = size_t{size.x} * size.y;
        VCP_TRY(decodeTile(reader.name(), tables_, stored, tile, size, rest.first(count)));
        rest = rest.subspan(count);
        if (isFirst) --level;
    }
    return texels;
}

}  // namespace vcp
