// The blocks of a JPEG picture while it is decoded, cut into tiles that are JPEGs of their own, without decoding them
// to texels: no tile differs from the picture, but for the colours of its outermost texels, where the picture has fewer
// of them than of light.
//
// libjpeg asks for the memory of a picture's blocks through functions that a program may replace, and goes over them
// row by row. Where one scan has the whole picture, what it is given here is a ring that holds the last row of tiles,
// so that a picture of any height takes the same memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/image/image_levels.h"
#include "octree/image/jpeg_library.h"

namespace vcp {

class JpegBlocks {
public:
    /// Has `jpeg` keep its blocks here. Precondition: its header was read, and it was not begun to decode.
    void keep(jpeg_decompress_struct& jpeg);
    /// Returns the bytes that they take; up to 6 a texel, of all of them or of a row of tiles. Precondition: keep().
    [[nodiscard]] uint64_t bytes() const;
    /// Whether tiles begin at whole blocks, and their colours are what tiles have (unpackJpeg()). Precondition: keep().
    [[nodiscard]] bool canBeCut() const;
    /// Whether all bits of all blocks came. What lacks some is smoothed where it is decoded as a whole. Precondition:
    /// all scans of a picture that has several are there.
    [[nodiscard]] bool isComplete() const;

    /// Returns the quality of which libjpeg's steps are as large as the picture's, of light and in the mean; 1 to 100.
    [[nodiscard]] int quality() const;
    /// Returns a tile of the picture's finest level, of the row of tiles whose last row of texels was decoded last;
    /// empty where it would show other colours, or there is no memory. Precondition: the level has the picture's size
    /// and kLargeTileEdge. Any thread, while nothing is decoded.
    [[nodiscard]] std::vector<std::byte> tile(const ImageLevel& level, glm::uvec2 tile) const;

private:
    /// The blocks of one component: rows of them, of which row i is kept at i modulo their number.
    struct Ring {
        JBLOCKARRAY rows = nullptr;
        JDIMENSION width = 0, count = 0;
        JDIMENSION end = 0;  ///< behind the last row that was asked for to be written
    };
    static jvirt_barray_ptr request(j_common_ptr info, int pool, boolean isZeroed, JDIMENSION width, JDIMENSION height,
                                    JDIMENSION together);
    static JBLOCKARRAY access(j_common_ptr info, jvirt_barray_ptr blocks, JDIMENSION first, JDIMENSION count,
                              boolean isWritten);

    [[nodiscard]] int mostOf(int jpeg_component_info::*factor) const;
    [[nodiscard]] JDIMENSION rowsOf(int component) const;
    bool takeTile(jpeg_compress_struct& tile, jvirt_barray_ptr* blocks, glm::uvec2 corner, glm::uvec2 size) const;

    jpeg_decompress_struct* jpeg_ = nullptr;
    std::array<Ring, MAX_COMPONENTS> rings_;
    int requested_ = 0;
};

}  // namespace vcp
