#include "octree/image/image_pieces.h"

#include <algorithm>

namespace vcp {

namespace {

/// Returns the most tiles of a piece.
uint64_t pieceTiles(const ImageLevel& level) { return kPieceTexels / (uint64_t{level.tileEdge} * level.tileEdge); }

uint64_t piecesOfLevel(const ImageLevel& level) { return (level.tiles() + pieceTiles(level) - 1) / pieceTiles(level); }

}  // namespace

Result<std::shared_ptr<const ImagePieces>> ImagePieces::read(const ByteReader& reader, const ImagesPlace& place) {
    VCP_TRY_ASSIGN(auto tables, readImageTables(reader, place));
    return std::make_shared<const ImagePieces>(std::move(tables));
}

ImagePieces::ImagePieces(ImageTables tables) : tables_(std::move(tables)) {
    places_.reserve(tables_.tiles.size());
    numbers_.resize(tables_.tiles.size());
    for (const ImageRow& image : tables_.images) {
        levels_.push_back(vcp::levelsOf(image));
        const std::vector<ImageLevel>& levels = levels_.back();
        auto first = uint32_t(levels.size() - 1);
        while (first > 0 && std::max(levels[first - 1].width, levels[first - 1].height) <= kFirstEdge) --first;
        firstLevel_.push_back(first);
        uint64_t pieces = 1;
        for (uint32_t level = 0; level < first; ++level) pieces += piecesOfLevel(levels[level]);
        firstPiece_.push_back(firstPiece_.back() + pieces);
        for (auto level = levels.rbegin(); level != levels.rend(); ++level)
            for (uint32_t number = 0; const glm::uvec2 tile : tileOrder(*level)) {
                numbers_[level->firstTile + uint64_t{tile.y} * level->tilesX() + tile.x] = number++;
                places_.push_back({uint16_t(tile.x), uint16_t(tile.y)});
            }
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
        return piece;
    }
    --before;
    while (before >= piecesOfLevel(levels[--piece.level])) before -= piecesOfLevel(levels[piece.level]);
    const ImageLevel& level = levels[piece.level];
    const uint64_t first = before * pieceTiles(level);
    piece.firstTile = level.firstTile + first;
    piece.tiles = std::min(pieceTiles(level), level.tiles() - first);
    return piece;
}

ImagePieces::TilePlace ImagePieces::placeOf(const ImagePiece& piece, uint64_t i) const {
    const std::vector<ImageLevel>& levels = levels_[piece.image];
    // The first piece of an image has a level a tile, the coarsest first.
    const bool isFirst = piece.level == firstLevel_[piece.image];
    const auto level = uint32_t(isFirst ? levels.size() - 1 - i : piece.level);
    const Place& place = places_[piece.firstTile + i];
    const glm::uvec2 tile(place.x, place.y);
    return {level, tile, levels[level].sizeOf(tile)};
}

uint64_t ImagePieces::pieceOf(uint32_t image, uint32_t level, glm::uvec2 tile) const {
    const uint64_t first = piecesOf(image, level).first;
    if (level >= firstLevel_[image]) return first;
    const ImageLevel& of = levels_[image][level];
    return first + numbers_[of.firstTile + uint64_t{tile.y} * of.tilesX() + tile.x] / pieceTiles(of);
}

uint64_t ImagePieces::texelsOf(const ImagePiece& piece) const {
    uint64_t texels = 0;
    for (uint64_t i = 0; i < piece.tiles; ++i) {
        const glm::uvec2 size = placeOf(piece, i).size;
        texels += uint64_t{size.x} * size.y;
    }
    return texels;
}

uint64_t ImagePieces::bytes() const {
    uint64_t bytes = 0;
    for (const std::vector<ImageLevel>& levels : levels_)
        for (const ImageLevel& level : levels) bytes += level.texels() * sizeof(uint32_t);
    return bytes;
}

ImagePieces::Extent ImagePieces::extentOf(const ImagePiece& piece) const {
    const TileRow& last = tables_.tiles[piece.firstTile + piece.tiles - 1];
    return {tables_.tiles[piece.firstTile].offset, last.offset + last.storedBytes};
}

Result<std::vector<uint32_t>> ImagePieces::readPiece(const ByteReader& reader, uint64_t number) const {
    const ImagePiece piece = this->piece(number);
    VCP_TRY_ASSIGN(const auto stored, readTiles(reader, tables_, piece.firstTile, piece.tiles));
    std::vector<uint32_t> texels(texelsOf(piece));
    std::span<uint32_t> rest(texels);
    for (uint64_t i = 0; i < piece.tiles; ++i) {
        const glm::uvec2 size = placeOf(piece, i).size;
        const size_t count = size_t{size.x} * size.y;
        VCP_TRY(decodeTile(reader.name(), tables_, tables_.images[piece.image], stored, piece.firstTile + i, size,
                           rest.first(count)));
        rest = rest.subspan(count);
    }
    return texels;
}

}  // namespace vcp
