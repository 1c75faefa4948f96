// The images of a file in pieces, which are read one at a time: the levels of an image of at most kFirstEdge texels an
// edge, or up to kPieceTexels of a finer level, in the order of the file (a square of 512 texels, where there is one).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "octree/image/image_tables.h"

namespace vcp {

inline constexpr uint32_t kFirstEdge = 64;
inline constexpr uint64_t kPieceTexels = uint64_t{512} * 512;

struct ImagePiece {
    uint32_t image = 0;
    uint32_t level = 0;  ///< the finest one that it has tiles of, 0: the image's finest
    uint64_t firstTile = 0, tiles = 0;
};

/// Pieces are numbered image by image, coarse levels first. Immutable; any thread.
class ImagePieces {
public:
    /// Reads the tables of a section whose place was checked. Errors: readImageTables'.
    static Result<std::shared_ptr<const ImagePieces>> read(const ByteReader& reader, const ImagesPlace& place);
    /// Precondition: the tables were checked.
    explicit ImagePieces(ImageTables tables);

    [[nodiscard]] const ImageTables& tables() const { return tables_; }
    [[nodiscard]] uint64_t count() const { return firstPiece_.back(); }
    [[nodiscard]] ImagePiece piece(uint64_t number) const;
    /// The levels of an image, the finest first.
    [[nodiscard]] const std::vector<ImageLevel>& levelsOf(uint32_t image) const { return levels_[image]; }
    /// Returns the pieces that have a level's tiles: those from `first` on, before `end`.
    struct Range {
        uint64_t first = 0, end = 0;
    };
    [[nodiscard]] Range piecesOf(uint32_t image, uint32_t level) const;
    /// Returns the finest level of the image's first piece, which has all that are coarser.
    [[nodiscard]] uint32_t firstLevel(uint32_t image) const { return firstLevel_[image]; }
    /// Where a tile of a piece lies.
    struct TilePlace {
        uint32_t level = 0;
        glm::uvec2 tile{0}, size{0};  ///< column and row; texels along both axes
    };
    /// `i`: number of the tile among those of the piece, in the order of their texels.
    [[nodiscard]] TilePlace placeOf(const ImagePiece& piece, uint64_t i) const;
    /// Returns the piece that has a level's tile.
    [[nodiscard]] uint64_t pieceOf(uint32_t image, uint32_t level, glm::uvec2 tile) const;
    /// Returns the texels of its tiles.
    [[nodiscard]] uint64_t texelsOf(const ImagePiece& piece) const;
    /// Returns the bytes that a piece takes in memory, and those of all.
    [[nodiscard]] uint64_t bytesOf(uint64_t number) const { return texelsOf(piece(number)) * sizeof(uint32_t); }
    [[nodiscard]] uint64_t bytes() const;
    /// Where a piece is in the file; pieces follow each other.
    struct Extent {
        uint64_t begin = 0, end = 0;

        [[nodiscard]] uint64_t bytes() const { return end - begin; }
    };
    [[nodiscard]] Extent extentOf(const ImagePiece& piece) const;

    /// Reads and decodes a piece: its tiles, each row by row, RGBA8. Errors: InvalidInput (with file and byte), Io.
    Result<std::vector<uint32_t>> readPiece(const ByteReader& reader, uint64_t number) const;

private:
    struct Place {
        uint16_t x, y;
    };
    ImageTables tables_;
    std::vector<std::vector<ImageLevel>> levels_;
    std::vector<uint32_t> firstLevel_;
    std::vector<uint64_t> firstPiece_{0};  // of each image, and the end of the last
    std::vector<Place> places_;            // of each tile in its level
    std::vector<uint32_t> numbers_;        // of a level's tiles in the file's order, row by row
};

}  // namespace vcp
