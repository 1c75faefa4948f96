// The .vcp file, version 6; 7 where pages have open marks, 8 where there are images, 9 where materials have further
// channels, 10 where pages say how far off the colours of their slabs are, and 11 where slabs are half a cell wide.
// Files of versions 3 to 5 are read, too: they say nothing of parts; those of versions 3 and 4 have all pages without
// children on the finest level; those of version 3 have no slab leaves and no kFlagCovering.
//
// Pages without children hold the finest surface. Most are of the finest level; where triangles are few, they are of
// coarser ones.
//
//   offset   bytes        content
//   0        4096         FileHeader: what is in the file, tables of the levels, where the directory is
//   4096     4096 * n     directory: blocks of 51 PageEntries and a hash; coarse level first, Morton order
//                         (x lowest) within a level, so that the coarsest pages' entries and the header are
//                         within the first 16 KiB
//   ...                   pages, in the order of the directory, each on 256 bytes: geometry, then colour;
//                         each as octree/page/page_codec.h says; zero bytes between
//   ...                   with kFlagImages: the section of images, on 256 bytes (octree/image/image_tables.h)
//   end-64   64           CommitRecord, written last
//
// Every header, block and page carries an XXH3-64; a file whose commit record, header or size disagree was
// not finished or was changed. Sizes, counts and offsets are checked before use: a hostile file wastes
// neither memory nor time. All numbers little endian. Readers refuse versions they do not know.
//
// dataset_reader.h reads header and directory, page_reader.h one page, vcp_verify.h every byte; vcp_writer.h writes.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "octree/image/images_place.h"
#include "octree/page/paper_page.h"

namespace vcp {

inline constexpr uint32_t kFileVersion = 6;
inline constexpr uint32_t kMarkedFileVersion = 7;                           ///< with kFlagMarks
inline constexpr uint32_t kImagesFileVersion = 8;                           ///< with kFlagImages
inline constexpr uint32_t kChannelsFileVersion = 9;                         ///< with kFlagChannels
inline constexpr uint32_t kColourErrorsFileVersion = 10;                    ///< with kFlagColourErrors
inline constexpr uint32_t kFineSlabsFileVersion = 11;                       ///< with kFlagFineSlabs
inline constexpr uint32_t kOldestFileVersion = 3, kNewestFileVersion = 11;  ///< that are read
inline constexpr uint32_t kMaxLevels = 22;                                  ///< Morton codes have 21 bits an axis
inline constexpr uint32_t kMaxPaperLog2Cells = 20;
inline constexpr uint64_t kDirectoryOffset = 4096;
inline constexpr uint64_t kBlockBytes = 4096;
inline constexpr uint32_t kEntriesPerBlock = 51;
inline constexpr uint64_t kPageAlignment = 256;

/// Where a block of the directory is in the file.
constexpr uint64_t blockOffset(uint64_t block) { return kDirectoryOffset + block * kBlockBytes; }
/// How many blocks hold the entries of so many pages.
constexpr uint64_t blocksOf(uint64_t pages) { return (pages + kEntriesPerBlock - 1) / kEntriesPerBlock; }

/// What the pages hold.
enum class Method : uint32_t {
    Certified,  ///< octree/page/page.h
    Paper,      ///< octree/page/paper_page.h: no certificate and no colour; one page, or subvolumes
};

/// One level's row in the header.
struct LevelRow {
    uint64_t firstEntry = 0;
    uint64_t pages = 0;
    double certifiedError = 0;  ///< largest certified error of its pages, world units
};

/// First 4096 bytes of the file (the rest of them is zero).
struct FileHeader {
    char magic[8] = {'V', 'C', 'P', '\r', '\n', '\x1a', '\n', '\0'};
    uint32_t version = kFileVersion;
    uint32_t headerBytes = 4096;
    uint64_t fileBytes = 0;
    uint64_t pages = 0;
    double origin[3] = {};         ///< world position of the lowest corner of the root page
    double cell = 0;               ///< edge of a cell of the finest level, world units
    double errorTarget = 0;        ///< what the builder was asked for, world units
    double certifiedErrorMax = 0;  ///< largest certified error of the pages without children, world units
    double boundsMin[3] = {};      ///< lowest corner of the mesh's bounds, world units
    double boundsMax[3] = {};
    uint32_t levels = 0;     ///< 1 to kMaxLevels
    uint32_t log2Cells = 0;  ///< cells an edge of a page: 2^log2Cells; 1 to 7, of the method Paper to
                             ///< kMaxPaperLog2Cells
    uint32_t flags = 0;      ///< kFlagColour, kFlagCovering, kFlagParts and the others below
    Method method = Method::Certified;
    uint64_t triangles = 0, degenerateTriangles = 0, vertices = 0;
    uint64_t leaves = 0;      ///< soft, slab and hard leaves of the pages without children
    uint64_t hardLeaves = 0;  ///< hard leaves of the pages without children
    LevelRow level[kMaxLevels] = {};
    uint64_t hash = 0;      ///< XXH3-64 of the 4096 bytes with this field zero
    PaperParameters paper;  ///< zero where the method is another
    // With kFlagParts. A part is what shared vertices hold together; it is closed where each edge has an even number of
    // triangles. Positions are as the finest level has them.
    uint64_t parts = 0, closedParts = 0;
    uint64_t openEdges = 0;  ///< edges with an odd number of triangles
    ImagesPlace images;      ///< with kFlagImages
};
inline constexpr uint32_t kFlagColour = 1;
/// The surface of each page covers the mesh's within the page: no ray through the mesh slips between pages of two
/// levels, so none is continued beyond its page.
inline constexpr uint32_t kFlagCovering = 2;
/// The header counts the mesh's parts, and entries say of which kinds those in a page are.
inline constexpr uint32_t kFlagParts = 4;

/// With kFlagParts: some pages have open marks (octree/shared/page_layout.h), and their entries say so.
inline constexpr uint32_t kFlagMarks = 8;

/// With kFlagColour: triangles of the finest level may have texture coordinates and a material (octree/page/page.h).
inline constexpr uint32_t kFlagImages = 16;

/// With kFlagImages: some materials have further channels (octree/image/image_tables.h).
inline constexpr uint32_t kFlagChannels = 32;

/// With kFlagColour: entries of pages with slab leaves say how far off their colours are.
inline constexpr uint32_t kFlagColourErrors = 64;

/// With kFlagCovering: slab leaves are as wide as the cells of the level below, at most; without it, as those of their
/// own level.
inline constexpr uint32_t kFlagFineSlabs = 128;

/// What PageEntry::parts is made of. kPageHasMarks: with both others only; marks tell which surface is whose.
inline constexpr uint8_t kPageHasClosed = 1, kPageHasOpen = 2, kPageHasMarks = 4;

/// Whether a file of this version can be read.
constexpr bool isKnownVersion(uint32_t version) {
    return version >= kOldestFileVersion && version <= kNewestFileVersion;
}
static_assert(offsetof(FileHeader, origin) == 32 && offsetof(FileHeader, levels) == 128 &&
              offsetof(FileHeader, triangles) == 144);
static_assert(offsetof(FileHeader, level) == 184 && offsetof(FileHeader, hash) == 184 + 24 * kMaxLevels &&
              offsetof(FileHeader, images) == 184 + 24 * kMaxLevels + 8 + 32 + 24 &&
              sizeof(FileHeader) == offsetof(FileHeader, images) + 40);

/// One page in the directory.
struct PageEntry {
    uint64_t morton = 0;  ///< position of the subvolume among those of its level, 21 bits an axis
    uint64_t offset = 0;  ///< offset of the stored geometry in the file
    uint64_t hash = 0;    ///< XXH3-64 of the stored geometry
    uint64_t colourOffset = 0;
    uint64_t colourHash = 0;
    uint32_t storedBytes = 0;  ///< bytes of the stored geometry in the file
    uint32_t pageBytes = 0;    ///< bytes of the decoded page
    uint32_t colourStoredBytes = 0;
    uint32_t colourBytes = 0;
    uint32_t firstChild = 0;  ///< entry of the first child page; children are consecutive, in octant order
    uint32_t leaves = 0;      ///< number of soft, slab and hard leaves
    uint32_t hardLeaves = 0;
    float certifiedError = 0;  ///< world units, rounded up
    uint8_t childMask = 0;     ///< octants that have a page on the next level
    uint8_t level = 0;
    uint8_t parts = 0;  ///< with kFlagParts: the kinds of parts in it, kPageHasClosed, kPageHasOpen, kPageHasMarks
    uint8_t colourErrorP95 = 0;       ///< with kFlagColourErrors: 95 % of the slabs' surface err by no more (below)
    uint32_t slabLeaves : 24 = 0;     ///< a page numbers their vectors with 20 bits
    uint32_t colourErrorMax : 8 = 0;  ///< likewise: of the slab that errs most; 0: no slab, or not known
};
static_assert(sizeof(PageEntry) == 80 && offsetof(PageEntry, firstChild) == 56 &&
              offsetof(PageEntry, childMask) == 72 && offsetof(PageEntry, colourErrorP95) == 75);

// The colour error of a slab leaf is the root of the mean square, over the mesh's surface in it, of the difference
// between the slab's colour and the mean light of the surface in each of the leaf's eight octants, as ΔE: 100 times the
// distance in OKLab. So it counts what pages one level finer show more of. What is finer still is none: where distances
// choose the level, no slab is wider than about three times the error that is asked for.
inline constexpr double kMostColourError = 100;

/// Returns the ΔE that a byte of an entry stands for.
constexpr double colourErrorOf(uint32_t code) { return kMostColourError * double(code * code) / (255 * 255); }
/// Returns the byte of the least ΔE that is at least this one; 255 where there is none.
constexpr uint8_t colourErrorCode(double deltaE) {
    uint32_t code = 0;
    while (code < 255 && colourErrorOf(code) < deltaE) ++code;
    return uint8_t(code);
}

/// What the header says of the pages without children.
struct FinestFigures {
    double certifiedError = 0;  ///< world units
    uint64_t leaves = 0, hardLeaves = 0;

    void add(const PageEntry& page) {
        if (page.childMask != 0) return;
        if (page.certifiedError > certifiedError) certifiedError = page.certifiedError;
        leaves += page.leaves;
        hardLeaves += page.hardLeaves;
    }
};

/// A run of consecutive entry numbers. (std::views::iota does not compile with clang 14.)
class EntryRange {
public:
    class Iterator {
    public:
        using iterator_category = std::input_iterator_tag;
        using value_type = uint64_t;
        using difference_type = std::ptrdiff_t;
        using pointer = const uint64_t*;
        using reference = uint64_t;

        explicit Iterator(uint64_t at) : at_(at) {}
        uint64_t operator*() const { return at_; }
        Iterator& operator++() { return ++at_, *this; }
        bool operator==(const Iterator&) const = default;

    private:
        uint64_t at_;
    };
    EntryRange(uint64_t first, uint64_t count) : first_(first), count_(count) {}
    [[nodiscard]] Iterator begin() const { return Iterator(first_); }
    [[nodiscard]] Iterator end() const { return Iterator(first_ + count_); }
    [[nodiscard]] uint64_t size() const { return count_; }

private:
    uint64_t first_, count_;
};

/// The entries of a page's children, in octant order.
inline EntryRange childrenOf(const PageEntry& page) {
    return {page.firstChild, uint64_t(std::popcount(page.childMask))};
}

/// The entry of the child in an octant that has one.
inline uint64_t childIn(const PageEntry& page, uint32_t octant) {
    return uint64_t{page.firstChild} + uint64_t(std::popcount(page.childMask & ((1u << octant) - 1)));
}

struct CommitRecord {
    char magic[8] = {'V', 'C', 'P', 'c', 'o', 'm', 'm', 't'};
    uint64_t fileBytes = 0;
    uint64_t headerHash = 0;
    uint64_t directoryHash = 0;  ///< XXH3-64 of all directory blocks
    uint64_t reserved[3] = {};
    uint64_t hash = 0;  ///< XXH3-64 of the 56 bytes before
};
static_assert(sizeof(CommitRecord) == 64);

}  // namespace vcp
