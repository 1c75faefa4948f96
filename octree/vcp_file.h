// The .vcp file, version 2, and version 3 for other methods than the certified one.
//
//   offset   bytes        content
//   0        4096         FileHeader: what is in the file, tables of the levels, where the directory is
//   4096     4096 * n     directory: blocks of 51 PageEntries and a hash; coarse level first, Morton order
//                         (x lowest) within a level, so that the coarsest pages' entries and the header are
//                         within the first 16 KiB
//   ...                   pages, in the order of the directory, each on 256 bytes: geometry, then colour;
//                         each as octree/page_codec.h says; zero bytes between
//   end-64   64           CommitRecord, written last
//
// Every header, block and page carries an XXH3-64; a file whose commit record, header or size disagree was
// not finished or was changed. Sizes, counts and offsets are checked before use: a hostile file wastes
// neither memory nor time. All numbers little endian. Readers refuse versions they do not know.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/page.h"
#include "octree/paper_page.h"
#include "octree/result.h"
#include "octree/sparse_array.h"

namespace vcp {

inline constexpr uint32_t kFileVersion = 2;
inline constexpr uint32_t kMethodFileVersion = 3;  ///< version of files whose method is not Certified
inline constexpr uint32_t kMaxLevels = 22;         ///< Morton codes have 21 bits an axis
inline constexpr uint32_t kMaxPaperLog2Cells = 20;
inline constexpr uint64_t kDirectoryOffset = 4096;
inline constexpr uint64_t kBlockBytes = 4096;
inline constexpr uint32_t kEntriesPerBlock = 51;
inline constexpr uint64_t kPageAlignment = 256;

/// What the pages hold.
enum class Method : uint32_t {
    Certified,  ///< octree/page.h
    Paper,      ///< octree/paper_page.h: one level, one page, no certificate and no colour
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
    double certifiedErrorMax = 0;  ///< largest certified error of the finest level, world units
    double boundsMin[3] = {};      ///< lowest corner of the mesh's bounds, world units
    double boundsMax[3] = {};
    uint32_t levels = 0;  ///< 1 to kMaxLevels
    uint32_t log2Cells =
        0;               ///< cells an edge of a page: 2^log2Cells; 1 to 7, of the method Paper to kMaxPaperLog2Cells
    uint32_t flags = 0;  ///< bit 0: has colour
    Method method = Method::Certified;
    uint64_t triangles = 0, degenerateTriangles = 0, vertices = 0;
    uint64_t leaves = 0;      ///< soft and hard leaves of the finest level
    uint64_t hardLeaves = 0;  ///< hard leaves of the finest level
    LevelRow level[kMaxLevels] = {};
    uint64_t hash = 0;      ///< XXH3-64 of the 4096 bytes with this field zero
    PaperParameters paper;  ///< zero where the method is another
};
inline constexpr uint32_t kFlagColour = 1;
static_assert(offsetof(FileHeader, origin) == 32 && offsetof(FileHeader, levels) == 128 &&
              offsetof(FileHeader, triangles) == 144);
static_assert(offsetof(FileHeader, level) == 184 && offsetof(FileHeader, hash) == 184 + 24 * kMaxLevels &&
              sizeof(FileHeader) == 184 + 24 * kMaxLevels + 8 + 32);

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
    uint32_t leaves = 0;      ///< number of soft and hard leaves
    uint32_t hardLeaves = 0;
    float certifiedError = 0;  ///< world units, rounded up
    uint8_t childMask = 0;     ///< octants that have a page on the next level
    uint8_t level = 0;
    uint8_t reserved[6] = {};
};
static_assert(sizeof(PageEntry) == 80 && offsetof(PageEntry, firstChild) == 56 && offsetof(PageEntry, childMask) == 72);

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
    return {page.firstChild, static_cast<uint64_t>(std::popcount(page.childMask))};
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

/// The entries of all pages, in the file's order: a vector of them. The directory of a large file comes in parts: at
/// first the entries of some blocks are known (readDatasetStart), the others follow with admitBlock(). What is known
/// stays as it is, and any thread may read it; the entry of a page that is not known must not be read. Entries that are
/// not known take no memory.
class PageDirectory {
public:
    PageDirectory();
    PageDirectory(const PageDirectory& other);
    PageDirectory(PageDirectory&& other) noexcept;
    PageDirectory& operator=(const PageDirectory& other);
    PageDirectory& operator=(PageDirectory&& other) noexcept;
    ~PageDirectory();

    [[nodiscard]] size_t size() const { return parts_ ? sparse_.size() : entries_.size(); }
    [[nodiscard]] bool empty() const { return size() == 0; }
    [[nodiscard]] const PageEntry& operator[](size_t page) const { return data()[page]; }
    [[nodiscard]] PageEntry& operator[](size_t page) { return parts_ ? sparse_[page] : entries_[page]; }
    [[nodiscard]] const PageEntry* begin() const { return data(); }
    [[nodiscard]] const PageEntry* end() const { return data() + size(); }
    [[nodiscard]] const PageEntry* data() const { return parts_ ? sparse_.data() : entries_.data(); }
    /// Appends an entry to a directory that is known as a whole.
    void push_back(const PageEntry& entry) { entries_.push_back(entry); }
    void resize(size_t pages) { entries_.resize(pages); }

    /// Makes a directory of so many pages, none known yet. Throws std::bad_alloc where there are no addresses for them.
    void expect(size_t pages);
    [[nodiscard]] bool knows(uint64_t page) const { return !parts_ || knowsBlock(page / kEntriesPerBlock); }
    [[nodiscard]] bool knowsBlock(uint64_t block) const;
    [[nodiscard]] uint64_t blocks() const { return (size() + kEntriesPerBlock - 1) / kEntriesPerBlock; }
    [[nodiscard]] uint64_t blocksKnown() const;

private:
    friend class BlockAdmission;
    struct Parts;
    std::vector<PageEntry> entries_;         // all entries, where the directory is known as a whole
    mutable SparseArray<PageEntry> sparse_;  // entries where it comes in parts
    std::unique_ptr<Parts> parts_;           // null: all is known
};

/// Header and directory of a .vcp file, checked. Copy it, share it, read from any thread.
struct Dataset {
    FileHeader header;
    PageDirectory pages;

    [[nodiscard]] bool hasColour() const { return (header.flags & kFlagColour) != 0; }
    /// Edge of a cell of `level`, world units.
    [[nodiscard]] double cellOf(uint32_t level) const;
    /// World position of the lowest corner of a page.
    [[nodiscard]] glm::dvec3 originOf(const PageEntry& page) const;
    /// Edge of a page, world units.
    [[nodiscard]] double edgeOf(const PageEntry& page) const;
};

/// Where the bytes of a file come from: bounded reads at an offset. Implemented by streaming/ (file, HTTP,
/// faulty) and by tests. Any thread may call read.
class ByteReader {
public:
    virtual ~ByteReader() = default;
    virtual Result<void> read(uint64_t offset, std::span<std::byte> bytes) const = 0;
    [[nodiscard]] virtual uint64_t size() const = 0;
    [[nodiscard]] virtual const std::string& name() const = 0;
    /// Ends reads that are under way soon, with Cancelled, where they could take long. Later reads work.
    virtual void interrupt() const {}
    /// Reports that what read() gave for these bytes proved wrong: a copy of them is not used again.
    virtual void distrust(uint64_t offset, uint64_t bytes) const {
        static_cast<void>(offset), static_cast<void>(bytes);
    }
};

/// Opens a local file for bounded reads (pread); a pipe or device in its place is not waited for. Errors: Io.
Result<std::shared_ptr<ByteReader>> openFile(const std::filesystem::path& path);

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

/// Checks a block of the directory, by its hash and against the blocks that are known, and makes its entries known;
/// does nothing where they are known already. `bytes`: the kBlockBytes at blockOffset(block) of the file named `file`.
/// Any thread. Errors: InvalidInput.
Result<void> admitBlock(const Dataset& dataset, const std::string& file, uint64_t block,
                        std::span<const std::byte> bytes);
constexpr uint64_t blockOffset(uint64_t block) { return kDirectoryOffset + block * kBlockBytes; }

/// A page's decoded bytes, 16-byte aligned.
struct PageBytes {
    std::vector<uint4> geometry;
    std::vector<uint4> colour;  ///< empty when not asked for or absent

    [[nodiscard]] std::span<const std::byte> geometryBytes() const { return std::as_bytes(std::span(geometry)); }
    [[nodiscard]] std::span<const std::byte> colourBytes() const { return std::as_bytes(std::span(colour)); }
};

/// Reads, verifies (hash), decodes (page_codec.h) and checks (parsePage, parsePaperPage, against its entry) one page.
/// Safe on hostile bytes: allocates at most a few times the entry's pageBytes, which readDataset has bounded.
/// Precondition: the page's entry is known. Any thread.
Result<PageBytes> readPage(const ByteReader& reader, const Dataset& dataset, uint64_t page, bool withColour);

/// Reads every byte of the file and checks it, also those between pages, and that header, directory and pages say the
/// same. Calls `progress(bytes done)` now and then; it returns false to cancel. Errors: the first thing that is wrong.
Result<void> verifyFile(const ByteReader& reader, bool (*progress)(void*, uint64_t) = nullptr, void* user = nullptr);

/// Returns the XXH3-64 of the bytes.
uint64_t hashBytes(std::span<const std::byte> bytes);

/// Interleaves three 21-bit coordinates, x lowest; and back.
uint64_t mortonEncode(glm::u32vec3 cell);
glm::u32vec3 mortonDecode(uint64_t code);

}  // namespace vcp
