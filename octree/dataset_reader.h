// A .vcp file's header and directory, read and checked.
#pragma once

#include <cstdint>

#include <glm/vec3.hpp>

#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "octree/page_directory.h"
#include "octree/vcp_file.h"

namespace vcp {

/// Header and directory of a .vcp file, checked. Copy it, share it, read from any thread.
struct Dataset {
    FileHeader header;
    PageDirectory pages;

    [[nodiscard]] bool hasColour() const { return (header.flags & kFlagColour) != 0; }
    [[nodiscard]] bool isCovering() const { return (header.flags & kFlagCovering) != 0; }
    [[nodiscard]] bool hasImages() const { return (header.flags & kFlagImages) != 0; }
    [[nodiscard]] bool hasColourErrors() const { return (header.flags & kFlagColourErrors) != 0; }
    [[nodiscard]] bool hasParts() const { return (header.flags & kFlagParts) != 0; }
    /// Whether some of the mesh's parts are known to be open.
    [[nodiscard]] bool hasOpenParts() const { return header.closedParts < header.parts; }
    /// Edge of a cell of `level`, world units.
    [[nodiscard]] double cellOf(uint32_t level) const;
    /// Returns the edge of a level's widest slab leaves, world units.
    [[nodiscard]] double slabEdgeOf(uint32_t level) const;
    /// World position of the lowest corner of a page.
    [[nodiscard]] glm::dvec3 originOf(const PageEntry& page) const;
    /// Edge of a page, world units.
    [[nodiscard]] double edgeOf(const PageEntry& page) const;
};

/// Reads and checks header, directory and commit record, but no page. Its memory depends on what has come, not on what
/// the header claims. Errors: InvalidInput, Unsupported (version, method), Io; each names the file and the byte.
Result<Dataset> readDataset(const ByteReader& reader);

inline constexpr uint64_t kLeadBytes = 64 << 10;

/// Does the same, but reads only the blocks within the first leadBytes of the file where the directory has more than 4
/// * leadBytes, so that the bytes read do not depend on the file's size. The other blocks follow with admitBlock.
/// `leadBytes`: a multiple of kBlockBytes, more than kDirectoryOffset. Errors: as readDataset; Limit, where there are
/// no addresses for so many pages.
Result<Dataset> readDatasetStart(const ByteReader& reader, uint64_t leadBytes = kLeadBytes);
constexpr uint64_t wholeDirectoryBytes(uint64_t leadBytes) { return 4 * leadBytes; }

}  // namespace vcp
