// One page of a .vcp file, read and checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/image/image_need.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "octree/page/page.h"

namespace vcp {

/// A page's decoded bytes, 16-byte aligned; or what a piece of images shows.
struct PageBytes {
    std::vector<uint4> geometry;
    std::vector<uint4> colour;     ///< empty when not asked for or absent
    std::vector<ImageNeed> needs;  ///< of the page, where its images are asked for
    std::vector<uint32_t> texels;  ///< of a piece: tile by tile, each row by row, RGBA8

    [[nodiscard]] std::span<const std::byte> geometryBytes() const { return std::as_bytes(std::span(geometry)); }
    [[nodiscard]] std::span<const std::byte> colourBytes() const { return std::as_bytes(std::span(colour)); }
    [[nodiscard]] uint64_t bytes() const {
        return geometryBytes().size() + colourBytes().size() + texels.size() * sizeof(uint32_t);
    }
};

/// Reads, verifies (hash), decodes (page_codec.h) and checks (parsePage, parsePaperPage, against its entry) one page.
/// Safe on hostile bytes: allocates at most a few times the entry's pageBytes, which readDataset has bounded.
/// Precondition: the page's entry is known. Any thread.
Result<PageBytes> readPage(const ByteReader& reader, const Dataset& dataset, uint64_t page, bool withColour);

}  // namespace vcp
