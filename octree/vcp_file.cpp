#include "octree/vcp_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "octree/page_codec.h"

namespace vcp {

namespace {

// A page is built from at most a few 10^5 leaves; anything above this is a lie.
constexpr uint64_t kMaxPageBytes = uint64_t{1} << 28;
constexpr uint64_t kMaxPages = uint64_t{1} << 31;

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

Error broken(const ByteReader& reader, std::string element, uint64_t byte, std::string message) {
    return {.code = ErrorCode::InvalidInput,
            .message = std::move(message),
            .file = reader.name(),
            .element = std::move(element),
            .byte = byte};
}

bool finite(const double* values, int count) { return std::all_of(values, values + count, [](double v) { return std::isfinite(v); }); }

Result<void> checkHeader(const ByteReader& reader, const FileHeader& h, std::span<const std::byte> bytes) {
    const auto fail = [&](uint64_t byte, std::string message) { return broken(reader, "header", byte, std::move(message)); };
    if (std::memcmp(h.magic, FileHeader{}.magic, sizeof h.magic) != 0) return fail(0, "not a .vcp file");
    const auto unsupported = [&](uint64_t byte, std::string message) {
        return Error{.code = ErrorCode::Unsupported, .message = std::move(message), .file = reader.name(), .element = "header", .byte = byte};
    };
    if (h.version < kFileVersion || h.version > kMethodFileVersion)
        return unsupported(8, fmt::format("file version {} is not known; this program reads version {} and version {}: {}", h.version, kFileVersion, kMethodFileVersion,
                                          h.version < kFileVersion ? "build it again" : "use a newer program"));
    std::vector<std::byte> unhashed(bytes.begin(), bytes.end());
    std::memset(unhashed.data() + offsetof(FileHeader, hash), 0, 8);
    if (hashBytes(unhashed) != h.hash) return fail(0, "the header's hash does not match: the file was changed or damaged");
    if (h.headerBytes != kDirectoryOffset) return fail(12, "wrong header size");
    if (h.fileBytes != reader.size())
        return fail(16, fmt::format("the file should have {} bytes, it has {}: it was truncated or appended to", h.fileBytes, reader.size()));
    const bool isPaper = h.method == Method::Paper;
    if ((h.method != Method::Certified) != (h.version == kMethodFileVersion)) return fail(140, "the method does not go with the version");
    if (h.method != Method::Certified && !isPaper)
        return unsupported(140, fmt::format("it was built by method {}, which this program does not know: use a newer program", static_cast<uint32_t>(h.method)));
    if (isPaper && (h.levels != 1 || h.pages != 1 || h.flags != 0)) return fail(128, "a file of this method has one page");
    if (h.levels < 1 || h.levels > kMaxLevels || h.log2Cells < 1 || h.log2Cells > (isPaper ? kMaxPaperLog2Cells : 7)) return fail(128, "levels or page size out of range");
    if (!(h.cell > 0) || !std::isfinite(h.cell) || !finite(h.origin, 3) || !finite(h.boundsMin, 3) || !finite(h.boundsMax, 3))
        return fail(32, "origin, cell or bounds are not finite");
    if (h.pages < 1 || h.pages > kMaxPages || h.pages > h.fileBytes / sizeof(PageEntry)) return fail(24, "page count out of range");
    uint64_t next = 0;
    for (uint32_t l = 0; l < h.levels; ++l) {
        const uint64_t byte = offsetof(FileHeader, level) + l * sizeof(LevelRow);
        if (h.level[l].firstEntry != next || h.level[l].pages < 1 || h.level[l].pages > h.pages - next) return fail(byte, "level table does not add up");
        if (!(h.level[l].certifiedError >= 0) || !std::isfinite(h.level[l].certifiedError)) return fail(byte + 16, "certified error is not a number");
        next += h.level[l].pages;
    }
    if (next != h.pages || h.level[0].pages != 1) return fail(184, "level table does not add up");
    return {};
}

/// Offsets ascend without overlap, sizes fit the file, the tree is one.
class DirectoryCheck {
public:
    DirectoryCheck(const ByteReader& reader, const Dataset& dataset) : reader_(reader), d_(dataset) {}

    Result<void> run() {
        end_ = kDirectoryOffset + (d_.header.pages + kEntriesPerBlock - 1) / kEntriesPerBlock * kBlockBytes;
        nextChild_ = d_.header.levels > 1 ? d_.header.level[1].firstEntry : d_.header.pages;
        for (uint32_t l = 0; l < d_.header.levels; ++l)
            for (uint64_t i = 0; i < d_.header.level[l].pages; ++i) VCP_TRY(entry(d_.header.level[l].firstEntry + i, l));
        if (nextChild_ != d_.header.pages) return fail(0, "pages without a parent");
        return {};
    }

private:
    Result<void> entry(uint64_t index, uint32_t level) {
        const PageEntry& e = d_.pages[index];
        if (e.level != level) return fail(index, "wrong level");
        VCP_TRY(extent(index, e.offset, e.storedBytes, e.pageBytes));
        if (e.colourStoredBytes == 0 && (e.colourBytes != 0 || (d_.hasColour() && e.leaves != 0))) return fail(index, "colour is missing");
        if (e.colourStoredBytes != 0) VCP_TRY(extent(index, e.colourOffset, e.colourStoredBytes, e.colourBytes));
        if (!(e.certifiedError >= 0) || !std::isfinite(e.certifiedError) || e.hardLeaves > e.leaves) return fail(index, "certified error or counts out of range");
        if (level == 0 && e.morton != 0) return fail(index, "the root is not at the origin");
        if (e.childMask == 0) return {};
        if (level + 1 >= d_.header.levels || e.firstChild != nextChild_) return fail(index, "wrong child pages");
        for (uint32_t octant = 0; octant < 8; ++octant) {
            if (!(e.childMask >> octant & 1)) continue;
            if (nextChild_ >= d_.header.pages || d_.pages[nextChild_].level != level + 1 || d_.pages[nextChild_].morton != (e.morton << 3 | octant))
                return fail(index, "child pages do not match");
            ++nextChild_;
        }
        return {};
    }

    Result<void> extent(uint64_t index, uint64_t offset, uint64_t stored, uint64_t bytes) {
        if (offset < end_ || offset % kPageAlignment != 0 || stored == 0 || stored > reader_.size() || offset > reader_.size() - stored)
            return fail(index, "page lies outside the file or overlaps another");
        if (bytes == 0 || bytes > kMaxPageBytes || bytes % 16 != 0) return fail(index, "page size out of range");
        end_ = offset + stored;
        return {};
    }

    Error fail(uint64_t index, std::string message) const {
        return broken(reader_, fmt::format("directory entry {}", index),
                      kDirectoryOffset + index / kEntriesPerBlock * kBlockBytes + index % kEntriesPerBlock * sizeof(PageEntry), std::move(message));
    }

    const ByteReader& reader_;
    const Dataset& d_;
    uint64_t end_ = 0, nextChild_ = 0;
};

/// The stored bytes of a page, checked against their hash.
Result<std::vector<std::byte>> readStored(const ByteReader& reader, const std::string& element, uint64_t offset, uint32_t stored, uint64_t hash) {
    std::vector<std::byte> packed(stored);
    VCP_TRY(reader.read(offset, packed));
    if (hashBytes(packed) != hash) return broken(reader, element, offset, "hash does not match: the page was changed or damaged");
    return packed;
}

}  // namespace

double Dataset::cellOf(uint32_t level) const { return std::ldexp(header.cell, static_cast<int>(header.levels - 1 - level)); }

double Dataset::edgeOf(const PageEntry& page) const { return std::ldexp(cellOf(page.level), static_cast<int>(header.log2Cells)); }

glm::dvec3 Dataset::originOf(const PageEntry& page) const {
    return glm::dvec3(header.origin[0], header.origin[1], header.origin[2]) + edgeOf(page) * glm::dvec3(mortonDecode(page.morton));
}

Result<std::shared_ptr<ByteReader>> openFile(const std::filesystem::path& path) {
    const auto fail = [&](std::string message) { return Error{.code = ErrorCode::Io, .message = std::move(message), .file = path.string()}; };
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return fail(std::string("cannot open: ") + std::strerror(errno));
    struct stat info {};
    if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        ::close(fd);
        return fail(S_ISDIR(info.st_mode) ? "is a folder; give a .vcp file" : "is not a regular file");
    }
    return std::shared_ptr<ByteReader>(std::make_shared<LocalFile>(fd, static_cast<uint64_t>(info.st_size), path.string()));
}

Result<Dataset> readDataset(const ByteReader& reader) {
    if (reader.size() < kDirectoryOffset + kBlockBytes + sizeof(CommitRecord))
        return broken(reader, "header", reader.size(), reader.size() == 0 ? "the file is empty" : "the file is too short for a .vcp file");
    Dataset dataset;
    std::vector<std::byte> first(kDirectoryOffset);
    VCP_TRY(reader.read(0, first));
    std::memcpy(&dataset.header, first.data(), sizeof(FileHeader));
    VCP_TRY(checkHeader(reader, dataset.header, first));

    const uint64_t blocks = (dataset.header.pages + kEntriesPerBlock - 1) / kEntriesPerBlock;
    if (blocks * kBlockBytes > reader.size() - kDirectoryOffset - sizeof(CommitRecord)) return broken(reader, "header", 24, "the directory does not fit the file");
    std::vector<std::byte> directory(blocks * kBlockBytes);
    VCP_TRY(reader.read(kDirectoryOffset, directory));
    dataset.pages.resize(dataset.header.pages);
    for (uint64_t b = 0; b < blocks; ++b) {
        const std::span block = std::span(directory).subspan(b * kBlockBytes, kBlockBytes);
        uint64_t hash = 0;
        std::memcpy(&hash, block.data() + kBlockBytes - 8, 8);
        if (hashBytes(block.first(kBlockBytes - 8)) != hash)
            return broken(reader, fmt::format("directory block {}", b), kDirectoryOffset + b * kBlockBytes, "hash does not match: the file was changed or damaged");
        const uint64_t count = std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - b * kEntriesPerBlock);
        std::memcpy(&dataset.pages[b * kEntriesPerBlock], block.data(), count * sizeof(PageEntry));
    }
    CommitRecord commit;
    const uint64_t commitOffset = reader.size() - sizeof commit;
    VCP_TRY(reader.read(commitOffset, std::as_writable_bytes(std::span(&commit, 1))));
    if (std::memcmp(commit.magic, CommitRecord{}.magic, 8) != 0 || commit.fileBytes != reader.size() || commit.headerHash != dataset.header.hash ||
        commit.directoryHash != hashBytes(directory) ||
        commit.hash != hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash))))
        return broken(reader, "commit record", commitOffset, "does not match the file: it was not finished, changed or damaged");
    VCP_TRY(DirectoryCheck(reader, dataset).run());
    return dataset;
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
        return page;
    }
    const auto view = parsePage(page.geometryBytes());
    if (!view) return broken(reader, element, e.offset, view.error().line());
    if (view->header.log2Cells != dataset.header.log2Cells) return broken(reader, element, e.offset, "page size differs from the file's");
    if (!withColour || e.colourBytes == 0) return page;
    const auto storedColour = readStored(reader, element + " colour", e.colourOffset, e.colourStoredBytes, e.colourHash);
    if (!storedColour) return storedColour.error();
    if (e.colourBytes != colourPageBytes(view->header)) return broken(reader, element + " colour", e.colourOffset, "colour page does not decode to its page's size");
    auto colour = unpackColour(*storedColour, e.colourBytes, *view);
    if (!colour) return broken(reader, element + " colour", e.colourOffset, colour.error().message);
    page.colour = *std::move(colour);
    return page;
}

Result<void> verifyFile(const ByteReader& reader, bool (*progress)(void*, uint64_t), void* user) {
    auto dataset = readDataset(reader);
    if (!dataset) return dataset.error();
    uint64_t end = kDirectoryOffset + (dataset->header.pages + kEntriesPerBlock - 1) / kEntriesPerBlock * kBlockBytes;
    const auto gap = [&](uint64_t to) -> Result<void> {
        if (to < end || to - end > kBlockBytes) return broken(reader, "padding", end, "unexpected bytes between pages");
        std::vector<std::byte> bytes(to - end);
        VCP_TRY(reader.read(end, bytes));
        for (size_t i = 0; i < bytes.size(); ++i)
            if (bytes[i] != std::byte{0}) return broken(reader, "padding", end + i, "is not zero: the file was changed or damaged");
        return {};
    };
    for (uint64_t i = 0; i < dataset->pages.size(); ++i) {
        const PageEntry& e = dataset->pages[i];
        VCP_TRY(gap(e.offset));
        if (auto page = readPage(reader, *dataset, i, true); !page) return page.error();
        end = e.offset + e.storedBytes;
        if (e.colourBytes != 0) {
            VCP_TRY(gap(e.colourOffset));
            end = e.colourOffset + e.colourStoredBytes;
        }
        if (progress != nullptr && !progress(user, end)) return Error{.code = ErrorCode::Cancelled, .message = "cancelled", .file = reader.name()};
    }
    return gap(reader.size() - sizeof(CommitRecord));
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
