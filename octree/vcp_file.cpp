#include "octree/vcp_file.h"

#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "octree/header_check.h"
#include "octree/page_codec.h"
#include "octree/regular_file.h"

namespace vcp {

namespace {

// A page is built from at most a few 10^5 leaves; anything above this is a lie.
constexpr uint64_t kMaxPageBytes = uint64_t{1} << 28;

class LocalFile final : public ByteReader {
public:
    LocalFile(int fd, uint64_t size, std::string name) : fd_(fd), size_(size), name_(std::move(name)) {}
    ~LocalFile() override { ::close(fd_); }
    LocalFile(const LocalFile&) = delete;
    LocalFile& operator=(const LocalFile&) = delete;

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        while (!bytes.empty()) {
            const ssize_t n = ::pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
            if (n < 0 && errno == EINTR) continue;
            if (n < 0) return fail(offset, std::string("read failed: ") + std::strerror(errno));
            if (n == 0) return fail(offset, "the file ends here; it was truncated");
            offset += static_cast<uint64_t>(n);
            bytes = bytes.subspan(static_cast<size_t>(n));
        }
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return size_; }
    [[nodiscard]] const std::string& name() const override { return name_; }

private:
    Error fail(uint64_t offset, std::string message) const {
        return {.code = ErrorCode::Io, .message = std::move(message), .file = name_, .byte = offset};
    }
    int fd_;
    uint64_t size_;
    std::string name_;
};

Error broken(const std::string& file, std::string element, uint64_t byte, std::string message) {
    return {.code = ErrorCode::InvalidInput,
            .message = std::move(message),
            .file = file,
            .element = std::move(element),
            .byte = byte};
}

Error broken(const ByteReader& reader, std::string element, uint64_t byte, std::string message) {
    return broken(reader.name(), std::move(element), byte, std::move(message));
}

constexpr uint64_t blocksOf(uint64_t pages) { return (pages + kEntriesPerBlock - 1) / kEntriesPerBlock; }

/// `field`: byte offset of the wrong field within the entry.
Error brokenEntry(const std::string& file, uint64_t index, std::string message, uint64_t field = 0) {
    const uint64_t byte = blockOffset(index / kEntriesPerBlock) + index % kEntriesPerBlock * sizeof(PageEntry) + field;
    return broken(file, fmt::format("directory entry {}", index), byte, std::move(message));
}

/// Checks what an entry says by itself: sizes fit the file, offsets ascend from one entry to the next.
class EntryCheck {
public:
    EntryCheck(const std::string& file, const Dataset& dataset)
        : file_(file),
          header_(dataset.header),
          hasColour_(dataset.hasColour()),
          end_(blockOffset(blocksOf(dataset.header.pages))) {}

    Result<void> check(uint64_t index, const PageEntry& e, uint32_t level) {
        const auto fail = [&](uint64_t field, const char* message) {
            return brokenEntry(file_, index, message, field);
        };
        if (e.level != level) return fail(offsetof(PageEntry, level), "wrong level");
        VCP_TRY(extent(index, e.offset, e.storedBytes, e.pageBytes));
        VCP_TRY(colour(index, e));
        if (!(e.certifiedError >= 0) || !std::isfinite(e.certifiedError))
            return fail(offsetof(PageEntry, certifiedError), "certified error is not a length");
        if (e.certifiedError > header_.level[level].certifiedError)
            return fail(offsetof(PageEntry, certifiedError),
                        "certified error is larger than its level's in the header");
        if (e.hardLeaves > e.leaves)
            return fail(offsetof(PageEntry, hardLeaves), "leaf counts: more hard leaves than leaves");
        // The root's word stands in the page's header, the words of all other leaves among the nodes.
        if (e.leaves > e.pageBytes / sizeof(uint32_t))
            return fail(offsetof(PageEntry, leaves), "leaf counts: more leaves than its page has room for");
        if (e.childMask == 0 && e.firstChild != 0)
            return fail(offsetof(PageEntry, firstChild), "wrong child pages: a first one where there are none");
        for (size_t i = 0; i < sizeof e.reserved; ++i)
            if (e.reserved[i] != 0) return fail(offsetof(PageEntry, reserved) + i, "reserved bytes must be zero");
        if (level == 0 && e.morton != 0) return fail(offsetof(PageEntry, morton), "the root is not at the origin");
        return {};
    }

private:
    Result<void> colour(uint64_t index, const PageEntry& e) {
        const auto fail = [&](uint64_t field, const char* message) {
            return brokenEntry(file_, index, message, field);
        };
        if (e.colourStoredBytes == 0) {
            if (e.colourBytes != 0 || (hasColour_ && e.leaves != 0))
                return fail(offsetof(PageEntry, colourStoredBytes), "colour is missing");
            if (e.colourOffset != 0)
                return fail(offsetof(PageEntry, colourOffset), "a place of colour where there is none");
            if (e.colourHash != 0) return fail(offsetof(PageEntry, colourHash), "a hash of colour where there is none");
            return {};
        }
        if (!hasColour_)
            return fail(offsetof(PageEntry, colourStoredBytes), "has colour, but the header says that no page has");
        if (e.colourOffset > end_ + kBlockBytes)
            return fail(offsetof(PageEntry, colourOffset), "its colour does not follow it");
        return extent(index, e.colourOffset, e.colourStoredBytes, e.colourBytes);
    }

    Result<void> extent(uint64_t index, uint64_t offset, uint64_t stored, uint64_t bytes) {
        const uint64_t fileBytes = header_.fileBytes - sizeof(CommitRecord);
        if (offset < end_ || offset % kPageAlignment != 0 || stored == 0 || stored > fileBytes ||
            offset > fileBytes - stored)
            return brokenEntry(file_, index, "page lies outside the file or overlaps another");
        if (bytes == 0 || bytes > kMaxPageBytes || bytes % 16 != 0)
            return brokenEntry(file_, index, "page size out of range");
        end_ = offset + stored;
        return {};
    }

    const std::string& file_;
    const FileHeader& header_;
    bool hasColour_;
    uint64_t end_;
};

/// Calls visit(page, octant) for each child, until one gives an error.
template <class Visit>
Result<void> eachChild(const PageEntry& parent, Visit&& visit) {
    uint64_t child = parent.firstChild;
    for (uint32_t octant = 0; octant < 8; ++octant)
        if (parent.childMask >> octant & 1) VCP_TRY(visit(child++, octant));
    return {};
}

bool isChildAt(const PageEntry& child, const PageEntry& parent, uint32_t octant) {
    return child.level == parent.level + 1 && child.morton == (parent.morton << 3 | octant);
}

/// Checks a directory that is complete: every entry, and that the pages form a tree.
Result<void> checkDirectory(const std::string& file, const Dataset& d) {
    EntryCheck entries(file, d);
    uint64_t next = d.header.levels > 1 ? d.header.level[1].firstEntry : d.header.pages;
    uint64_t index = 0;
    for (uint32_t level = 0; level < d.header.levels; ++level)
        for (uint64_t i = 0; i < d.header.level[level].pages; ++i, ++index) {
            const PageEntry& e = d.pages[index];
            VCP_TRY(entries.check(index, e, level));
            if (e.childMask == 0) continue;
            if (level + 1 >= d.header.levels || e.firstChild != next)
                return brokenEntry(file, index, "wrong child pages");
            VCP_TRY(eachChild(e, [&](uint64_t child, uint32_t octant) -> Result<void> {
                if (child >= d.header.pages || !isChildAt(d.pages[child], e, octant))
                    return brokenEntry(file, index, "child pages do not match");
                return {};
            }));
            next += childrenOf(e).size();
        }
    if (next != d.header.pages) return brokenEntry(file, 0, "pages without a parent");
    return {};
}

/// Checks that a block holds `entries` and a hash, and is zero between.
Result<void> checkBlock(const std::string& file, uint64_t block, uint64_t entries, std::span<const std::byte> bytes) {
    const auto fail = [&](uint64_t byte, std::string message) {
        return broken(file, fmt::format("directory block {}", block), blockOffset(block) + byte, std::move(message));
    };
    uint64_t hash = 0;
    std::memcpy(&hash, bytes.data() + kBlockBytes - 8, 8);
    if (hashBytes(bytes.first(kBlockBytes - 8)) != hash)
        return fail(0, "hash does not match: the file was changed or damaged");
    for (uint64_t byte = entries * sizeof(PageEntry); byte < kBlockBytes - 8; ++byte)
        if (bytes[byte] != std::byte{0}) return fail(byte, "bytes behind the last entry must be zero");
    return {};
}

/// Reads `bytes` in pieces, the first of at most kFirstPiece, each as large as all before it, so that a false size
/// takes at most a few times the memory of what came. take(piece) -> Result<void>.
constexpr uint64_t kFirstPiece = 1 << 20;
constexpr uint64_t kLargestPiece = 16 << 20;
template <class Take>
Result<void> readInPieces(const ByteReader& reader, uint64_t offset, uint64_t bytes, Take&& take) {
    std::vector<std::byte> piece;
    for (uint64_t done = 0; done < bytes; done += piece.size()) {
        piece.resize(std::min({std::max(done, kFirstPiece), kLargestPiece, bytes - done}));
        VCP_TRY(reader.read(offset + done, piece));
        VCP_TRY(take(std::span<const std::byte>(piece)));
    }
    return {};
}

/// Reads the stored bytes of a page and checks them against their hash.
Result<std::vector<std::byte>> readStored(const ByteReader& reader, const std::string& element, uint64_t offset,
                                          uint32_t stored, uint64_t hash) {
    std::vector<std::byte> packed;
    if (stored <= kFirstPiece) {
        packed.resize(stored);
        VCP_TRY(reader.read(offset, packed));
    } else {
        VCP_TRY(readInPieces(reader, offset, stored, [&](std::span<const std::byte> piece) -> Result<void> {
            packed.insert(packed.end(), piece.begin(), piece.end());
            return {};
        }));
    }
    if (hashBytes(packed) != hash)
        return broken(reader, element, offset, "hash does not match: the page was changed or damaged");
    return packed;
}

/// A lock that one thread holds at a time; others wait.
class Turn {
public:
    explicit Turn(std::atomic_flag& taken) : taken_(taken) {
        while (taken_.test_and_set(std::memory_order_acquire)) taken_.wait(true, std::memory_order_relaxed);
    }
    ~Turn() {
        taken_.clear(std::memory_order_release);
        taken_.notify_one();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

private:
    std::atomic_flag& taken_;
};

}  // namespace

/// What a directory that comes in parts must know beside its entries.
struct PageDirectory::Parts {
    explicit Parts(size_t pages) : known(blocksOf(pages)), afterParents(pages) {}
    static constexpr uint32_t kNoPage = 0;

    std::atomic_flag admitting;
    SparseArray<std::atomic<uint8_t>> known;  // for each block: 1 after its entries were written
    std::atomic<uint64_t> blocksKnown{0};
    SparseArray<uint32_t> afterParents;  // for each page 1 more than its parent; 0: not known yet
};

PageDirectory::PageDirectory() = default;
PageDirectory::PageDirectory(const PageDirectory& other) { *this = other; }
PageDirectory::PageDirectory(PageDirectory&& other) noexcept = default;
PageDirectory& PageDirectory::operator=(PageDirectory&& other) noexcept = default;
PageDirectory::~PageDirectory() = default;

PageDirectory& PageDirectory::operator=(const PageDirectory& other) {
    if (this == &other) return *this;
    parts_.reset();
    sparse_ = {};
    entries_ = other.entries_;
    if (!other.parts_) return *this;
    const Turn turn(other.parts_->admitting);
    expect(other.size());
    for (size_t b = 0; b < parts_->known.size(); ++b) {
        if (other.parts_->known[b].load() == 0) continue;
        const size_t first = b * kEntriesPerBlock, count = std::min<size_t>(kEntriesPerBlock, size() - first);
        std::copy_n(other.sparse_.data() + first, count, sparse_.data() + first);
        for (size_t page = first; page < first + count; ++page)
            for (const uint64_t child : childrenOf(sparse_[page]))
                parts_->afterParents[child] = static_cast<uint32_t>(page + 1);
        parts_->known[b] = 1;
    }
    parts_->blocksKnown = other.parts_->blocksKnown.load();
    return *this;
}

void PageDirectory::expect(size_t pages) {
    entries_ = {};
    sparse_ = SparseArray<PageEntry>(pages);
    parts_ = std::make_unique<Parts>(pages);
}

bool PageDirectory::knowsBlock(uint64_t block) const {
    return !parts_ || parts_->known[block].load(std::memory_order_acquire) != 0;
}
uint64_t PageDirectory::blocksKnown() const {
    return parts_ ? parts_->blocksKnown.load(std::memory_order_acquire) : blocks();
}

/// Takes one block in: checks its entries by themselves, then against the known parents and children. Each page has one
/// parent, on the level above: so what is known is a tree, whatever the rest will be.
class BlockAdmission {
public:
    BlockAdmission(const Dataset& dataset, const std::string& file, uint64_t block)
        : d_(dataset),
          directory_(dataset.pages),
          file_(file),
          block_(block),
          first_(block * kEntriesPerBlock),
          count_(std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - first_)) {}

    Result<void> run(std::span<const std::byte> bytes) {
        PageDirectory::Parts& parts = *directory_.parts_;
        const Turn turn(parts.admitting);
        if (directory_.knowsBlock(block_)) return {};
        std::memcpy(&directory_.sparse_[first_], bytes.data(), count_ * sizeof(PageEntry));
        if (auto sound = check(); !sound) {
            // Entries that were refused are zeroed, so that nothing reads them.
            std::fill_n(&directory_.sparse_[first_], count_, PageEntry{});
            return sound;
        }
        parts.known[block_].store(1, std::memory_order_release);
        parts.blocksKnown.fetch_add(1, std::memory_order_release);
        return {};
    }

private:
    Result<void> check() const {
        EntryCheck entries(file_, d_);
        for (uint64_t page = first_; page < first_ + count_; ++page) {
            VCP_TRY(entries.check(page, directory_[page], levelOf(page)));
            VCP_TRY(linkChildren(page));
            VCP_TRY(checkParent(page));
        }
        return {};
    }
    [[nodiscard]] uint32_t levelOf(uint64_t page) const {
        uint32_t level = 0;
        while (page >= d_.header.level[level].firstEntry + d_.header.level[level].pages) ++level;
        return level;
    }
    [[nodiscard]] bool isThere(uint64_t page) const {
        return page / kEntriesPerBlock == block_ || directory_.knows(page);
    }

    Result<void> linkChildren(uint64_t page) const {
        const PageEntry& e = directory_[page];
        if (e.childMask == 0) return {};
        if (e.level + 1u >= d_.header.levels) return brokenEntry(file_, page, "wrong child pages");
        const LevelRow& below = d_.header.level[e.level + 1];
        if (e.firstChild < below.firstEntry || *childrenOf(e).end() > below.firstEntry + below.pages)
            return brokenEntry(file_, page, "wrong child pages");
        return eachChild(e, [&](uint64_t child, uint32_t octant) -> Result<void> {
            uint32_t& parent = directory_.parts_->afterParents[child];
            if (parent != PageDirectory::Parts::kNoPage && parent != page + 1)
                return brokenEntry(file_, page, "wrong child pages");
            parent = static_cast<uint32_t>(page + 1);
            if (isThere(child) && !isChildAt(directory_[child], e, octant))
                return brokenEntry(file_, page, "child pages do not match");
            return {};
        });
    }

    Result<void> checkParent(uint64_t page) const {
        const uint32_t after = directory_.parts_->afterParents[page];
        if (after == PageDirectory::Parts::kNoPage || !isThere(after - 1)) return {};
        const PageEntry& parent = directory_[after - 1];
        return eachChild(parent, [&](uint64_t child, uint32_t octant) -> Result<void> {
            if (child == page && !isChildAt(directory_[page], parent, octant))
                return brokenEntry(file_, page, "child pages do not match");
            return {};
        });
    }

    const Dataset& d_;
    const PageDirectory& directory_;
    const std::string& file_;
    uint64_t block_, first_, count_;
};

Result<void> admitBlock(const Dataset& dataset, const std::string& file, uint64_t block,
                        std::span<const std::byte> bytes) {
    if (dataset.pages.knowsBlock(block)) return {};
    VCP_TRY(checkBlock(file, block,
                       std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - block * kEntriesPerBlock), bytes));
    return BlockAdmission(dataset, file, block).run(bytes);
}

double Dataset::cellOf(uint32_t level) const {
    return std::ldexp(header.cell, static_cast<int>(header.levels - 1 - level));
}

double Dataset::edgeOf(const PageEntry& page) const {
    return std::ldexp(cellOf(page.level), static_cast<int>(header.log2Cells));
}

glm::dvec3 Dataset::originOf(const PageEntry& page) const {
    return glm::dvec3(header.origin[0], header.origin[1], header.origin[2]) +
           edgeOf(page) * glm::dvec3(mortonDecode(page.morton));
}

Result<std::shared_ptr<ByteReader>> openFile(const std::filesystem::path& path) {
    const auto file = openRegular(path);
    if (!file) return file.error();
    struct stat info {};
    if (::fstat(*file, &info) != 0) {
        ::close(*file);
        return Error{.code = ErrorCode::Io, .message = "its size cannot be asked", .file = path.string()};
    }
    return std::shared_ptr<ByteReader>(
        std::make_shared<LocalFile>(*file, static_cast<uint64_t>(info.st_size), path.string()));
}

namespace {

Result<FileHeader> readHeader(const ByteReader& reader) {
    if (reader.size() < kDirectoryOffset + kBlockBytes + sizeof(CommitRecord))
        return broken(reader, "header", reader.size(),
                      reader.size() == 0 ? "the file is empty" : "the file is too short for a .vcp file");
    FileHeader header;
    std::vector<std::byte> first(kDirectoryOffset);
    VCP_TRY(reader.read(0, first));
    std::memcpy(&header, first.data(), sizeof(FileHeader));
    VCP_TRY(checkHeader(reader.name(), header, first, reader.size()));
    if (blocksOf(header.pages) * kBlockBytes > reader.size() - kDirectoryOffset - sizeof(CommitRecord))
        return broken(reader, "header", 24, "the directory does not fit the file");
    return header;
}

/// `directoryHash`: hash of the directory's bytes, where all of them are there.
Result<void> checkCommitRecord(const ByteReader& reader, const FileHeader& header,
                               std::optional<uint64_t> directoryHash) {
    CommitRecord commit;
    const uint64_t offset = reader.size() - sizeof commit;
    VCP_TRY(reader.read(offset, std::as_writable_bytes(std::span(&commit, 1))));
    if (std::memcmp(commit.magic, CommitRecord{}.magic, 8) != 0 || commit.fileBytes != reader.size() ||
        commit.headerHash != header.hash || (directoryHash && commit.directoryHash != *directoryHash) ||
        commit.hash != hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash))))
        return broken(reader, "commit record", offset,
                      "does not match the file: it was not finished, changed or damaged");
    for (size_t i = 0; i < std::size(commit.reserved); ++i)
        if (commit.reserved[i] != 0)
            return broken(reader, "commit record", offset + offsetof(CommitRecord, reserved) + 8 * i,
                          "reserved bytes must be zero");
    return {};
}

/// Appends the entries of the blocks that follow those already there, each block checked against its hash.
Result<void> appendBlocks(Dataset& dataset, const std::string& file, std::span<const std::byte> blocks) {
    for (uint64_t from = 0; from < blocks.size(); from += kBlockBytes) {
        const std::span block = blocks.subspan(from, kBlockBytes);
        const uint64_t first = dataset.pages.size(),
                       count = std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - first);
        VCP_TRY(checkBlock(file, first / kEntriesPerBlock, count, block));
        for (uint64_t i = 0; i < count; ++i) {
            PageEntry entry;
            std::memcpy(&entry, block.data() + i * sizeof entry, sizeof entry);
            dataset.pages.push_back(entry);
        }
    }
    return {};
}

/// A file that claims more pages than it has fails at the first block that does not match its hash.
Result<Dataset> readWhole(const ByteReader& reader, const FileHeader& header) {
    Dataset dataset{header, {}};
    XXH3_state_t hash;
    XXH3_64bits_reset(&hash);
    VCP_TRY(readInPieces(reader, kDirectoryOffset, blocksOf(header.pages) * kBlockBytes,
                         [&](std::span<const std::byte> piece) {
                             XXH3_64bits_update(&hash, piece.data(), piece.size());
                             return appendBlocks(dataset, reader.name(), piece);
                         }));
    VCP_TRY(checkCommitRecord(reader, header, XXH3_64bits_digest(&hash)));
    VCP_TRY(checkDirectory(reader.name(), dataset));
    return dataset;
}

}  // namespace

Result<Dataset> readDataset(const ByteReader& reader) {
    const auto header = readHeader(reader);
    if (!header) return header.error();
    return readWhole(reader, *header);
}

Result<Dataset> readDatasetStart(const ByteReader& reader, uint64_t leadBytes) {
    const auto header = readHeader(reader);
    if (!header) return header.error();
    if (blocksOf(header->pages) * kBlockBytes <= wholeDirectoryBytes(leadBytes)) return readWhole(reader, *header);
    Dataset dataset{*header, {}};
    std::vector<std::byte> lead(leadBytes - kDirectoryOffset);
    VCP_TRY(reader.read(kDirectoryOffset, lead));
    VCP_TRY(checkCommitRecord(reader, *header, {}));
    try {
        dataset.pages.expect(header->pages);
    } catch (const std::bad_alloc&) {
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a directory of {} pages needs more addresses than this process may have",
                                            header->pages),
                     .file = reader.name()};
    }
    for (uint64_t b = 0; b < lead.size() / kBlockBytes; ++b)
        VCP_TRY(admitBlock(dataset, reader.name(), b, std::span(lead).subspan(b * kBlockBytes, kBlockBytes)));
    return dataset;
}

/// Checks that a page's header and its entry in the directory say the same.
static Result<void> checkAgainstEntry(const ByteReader& reader, const Dataset& dataset, uint64_t index,
                                      const PageHeader& page) {
    const PageEntry& e = dataset.pages[index];
    const auto fail = [&](std::string message) {
        return broken(reader, fmt::format("page {}", index), e.offset, std::move(message));
    };
    const uint64_t leaves = uint64_t{page.softLeaves} + page.hardLeaves;
    if (leaves != e.leaves || page.hardLeaves != e.hardLeaves)
        return fail(fmt::format("has {} leaves, {} of them hard; its directory entry says {} and {}", leaves,
                                page.hardLeaves, e.leaves, e.hardLeaves));
    // Both errors were rounded up to single precision, one in cells and one in world units.
    const double error = page.certifiedError * dataset.cellOf(e.level),
                 slack = 1e-6 * error + 4 * double(std::numeric_limits<float>::denorm_min());
    if (std::abs(error - e.certifiedError) > slack)
        return fail(
            fmt::format("has a certified error of {:g}, its directory entry says {:g}", error, e.certifiedError));
    return {};
}

Result<PageBytes> readPage(const ByteReader& reader, const Dataset& dataset, uint64_t index, bool withColour) {
    const PageEntry& e = dataset.pages[index];
    const std::string element = fmt::format("page {}", index);
    PageBytes page;
    const auto stored = readStored(reader, element, e.offset, e.storedBytes, e.hash);
    if (!stored) return stored.error();
    auto geometry = unpackGeometry(*stored, e.pageBytes);
    if (!geometry) return broken(reader, element, e.offset, geometry.error().message);
    page.geometry = *std::move(geometry);
    if (dataset.header.method == Method::Paper) {
        const auto paper = parsePaperPage(page.geometryBytes(), dataset.header.log2Cells);
        if (!paper) return broken(reader, element, e.offset, paper.error().line());
        if (paper->header.leaves != e.leaves)
            return broken(reader, element, e.offset,
                          fmt::format("has {} leaves, its directory entry says {}", paper->header.leaves, e.leaves));
        if (paper->header.packing != dataset.header.paper.packing)
            return broken(reader, element, e.offset, "its packing differs from the file's");
        return page;
    }
    const auto view = parsePage(page.geometryBytes());
    if (!view) return broken(reader, element, e.offset, view.error().line());
    if (view->header.log2Cells != dataset.header.log2Cells)
        return broken(reader, element, e.offset, "page size differs from the file's");
    VCP_TRY(checkAgainstEntry(reader, dataset, index, view->header));
    if (!withColour || e.colourBytes == 0) return page;
    const auto storedColour =
        readStored(reader, element + " colour", e.colourOffset, e.colourStoredBytes, e.colourHash);
    if (!storedColour) return storedColour.error();
    if (e.colourBytes != colourPageBytes(view->header))
        return broken(reader, element + " colour", e.colourOffset, "colour page does not decode to its page's size");
    auto colour = unpackColour(*storedColour, e.colourBytes, *view);
    if (!colour) return broken(reader, element + " colour", e.colourOffset, colour.error().message);
    page.colour = *std::move(colour);
    return page;
}

uint64_t hashBytes(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

uint64_t mortonEncode(glm::u32vec3 cell) {
    const auto spread = [](uint64_t v) {
        v &= 0x1fffff;
        v = (v | v << 32) & 0x1f00000000ffff;
        v = (v | v << 16) & 0x1f0000ff0000ff;
        v = (v | v << 8) & 0x100f00f00f00f00f;
        v = (v | v << 4) & 0x10c30c30c30c30c3;
        return (v | v << 2) & 0x1249249249249249;
    };
    return spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2;
}

glm::u32vec3 mortonDecode(uint64_t code) {
    const auto gather = [](uint64_t v) {
        v &= 0x1249249249249249;
        v = (v | v >> 2) & 0x10c30c30c30c30c3;
        v = (v | v >> 4) & 0x100f00f00f00f00f;
        v = (v | v >> 8) & 0x1f0000ff0000ff;
        v = (v | v >> 16) & 0x1f00000000ffff;
        return static_cast<uint32_t>((v | v >> 32) & 0x1fffff);
    };
    return {gather(code), gather(code >> 1), gather(code >> 2)};
}

}  // namespace vcp
