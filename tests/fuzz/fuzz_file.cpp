// What must hold for every header, directory and directory block behind right hashes, however hostile: they are
// refused, or what they say can be relied on. Read in parts the directory is the same; the tree is one; each page
// decodes or is refused.
//
// The input: a FileHeader, the number of entries that follow (16 bits), PageEntries, then the bytes of the pages from
// the first page's place on. The rest of the file is zero. Hashes, the number of bytes and the commit record are made
// here, so that what they guard is reached.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "octree/dataset_reader.h"
#include "octree/header_check.h"
#include "octree/io/content_hash.h"
#include "octree/vcp_verify.h"

namespace {

using namespace vcp;

constexpr uint64_t kMostBytes = 1 << 18, kMostPageBytes = 1 << 17;

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

class MemoryFile final : public ByteReader {
public:
    explicit MemoryFile(std::vector<std::byte> content) : bytes(std::move(content)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> out) const override {
        require(offset <= bytes.size() && out.size() <= bytes.size() - offset, "reads stay within the file");
        if (!out.empty()) std::memcpy(out.data(), &bytes[offset], out.size());
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return bytes.size(); }
    [[nodiscard]] const std::string& name() const override { return name_; }

    std::vector<std::byte> bytes;

private:
    std::string name_ = "fuzz.vcp";
};

template <class T>
T take(std::span<const std::byte>& from) {
    T value{};
    const size_t size = std::min(sizeof value, from.size());
    if (size > 0) std::memcpy(static_cast<void*>(&value), from.data(), size);
    from = from.subspan(size);
    return value;
}

/// A page's hash is that of the bytes where it says it lies.
void hashPage(const std::vector<std::byte>& file, uint64_t offset, uint32_t stored, uint64_t& hash) {
    if (stored > 0 && offset < file.size() && stored <= file.size() - offset)
        hash = hashBytes(std::span(file).subspan(offset, stored));
}

/// The file that the input stands for.
std::vector<std::byte> fileOf(std::span<const std::byte> input) {
    auto header = take<FileHeader>(input);
    std::vector<PageEntry> entries(std::min<size_t>(take<uint16_t>(input), input.size() / sizeof(PageEntry)));
    for (PageEntry& entry : entries) entry = take<PageEntry>(input);
    const uint64_t pages = blockOffset(blocksOf(entries.size()));
    const uint64_t end =
        (pages + input.size() + kPageAlignment - 1) / kPageAlignment * kPageAlignment + sizeof(CommitRecord);
    std::vector<std::byte> file(end);
    if (!input.empty()) std::memcpy(&file[pages], input.data(), input.size());
    for (size_t i = 0; i < entries.size(); ++i) {
        hashPage(file, entries[i].offset, entries[i].storedBytes, entries[i].hash);
        if (entries[i].colourStoredBytes > 0)
            hashPage(file, entries[i].colourOffset, entries[i].colourStoredBytes, entries[i].colourHash);
        std::memcpy(&file[blockOffset(i / kEntriesPerBlock) + i % kEntriesPerBlock * sizeof(PageEntry)], &entries[i],
                    sizeof(PageEntry));
    }
    for (uint64_t at = kDirectoryOffset; at < pages; at += kBlockBytes) {
        const uint64_t hash = hashBytes(std::span(file).subspan(at, kBlockBytes - 8));
        std::memcpy(&file[at + kBlockBytes - 8], &hash, sizeof hash);
    }
    header.fileBytes = file.size();
    header.hash = 0;
    std::memcpy(file.data(), &header, sizeof header);
    header.hash = hashBytes(std::span(file).first(kDirectoryOffset));
    std::memcpy(file.data(), &header, sizeof header);
    CommitRecord commit;
    commit.fileBytes = file.size();
    commit.headerHash = header.hash;
    const uint64_t directory = std::min(blocksOf(header.pages), blocksOf(entries.size())) * kBlockBytes;
    commit.directoryHash = hashBytes(std::span(file).subspan(kDirectoryOffset, directory));
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    std::memcpy(&file[file.size() - sizeof commit], &commit, sizeof commit);
    return file;
}

void checkEntry(const Dataset& d, uint64_t page, uint64_t fileBytes) {
    const PageEntry& e = d.pages[page];
    require(e.level < d.header.levels && e.offset + e.storedBytes <= fileBytes && e.pageBytes > 0,
            "an entry's numbers");
    require(e.certifiedError >= 0 && e.certifiedError <= d.header.level[e.level].certifiedError,
            "an entry's error is within its level's");
    require(e.colourBytes == 0 || d.hasColour(), "colour as the header says");
    for (const uint64_t child : childrenOf(e)) require(child > page && child < d.header.pages, "children follow");
}

/// What a traversal, a camera and a pool rely on.
void checkDataset(const Dataset& d, uint64_t fileBytes) {
    const FileHeader& h = d.header;
    require(d.pages.size() == h.pages && h.levels >= 1 && h.levels <= kMaxLevels, "counts");
    require(h.cell > 0 && std::isfinite(h.cell) && std::isfinite(d.edgeOf(d.pages[0])), "cell");
    require(h.certifiedErrorMax >= 0 && std::isfinite(h.certifiedErrorMax), "certified error");
    std::vector<uint8_t> parents(h.pages, 0);
    for (uint64_t page = 0; page < h.pages; ++page) {
        checkEntry(d, page, fileBytes);
        for (const uint64_t child : childrenOf(d.pages[page])) {
            require(d.pages[child].level == d.pages[page].level + 1, "children lie below");
            ++parents[child];
        }
    }
    require(std::all_of(parents.begin() + 1, parents.end(), [](uint8_t n) { return n == 1; }),
            "each page has one parent");
}

/// The directory a block at a time, the last one first. True: each was admitted.
bool admitAll(const MemoryFile& file, const Dataset& parts) {
    bool all = true;
    for (uint64_t b = parts.pages.blocks(); b-- > 0;)
        all = admitBlock(parts, file.name(), b, std::span(file.bytes).subspan(blockOffset(b), kBlockBytes)).ok() && all;
    return all;
}

/// What is accepted as a whole is accepted in parts; what is not meets only the checks of each block.
void readInParts(const MemoryFile& file, const Dataset* whole) {
    FileHeader header;
    std::memcpy(static_cast<void*>(&header), file.bytes.data(), sizeof header);
    if (!checkHeader(file.name(), header, std::span(file.bytes).first(kDirectoryOffset), file.size()).ok() ||
        blockOffset(blocksOf(header.pages)) > file.size())
        return;
    Dataset parts{header, {}};
    parts.pages.expect(header.pages);
    const bool all = admitAll(file, parts);
    for (uint64_t page = 0; page < header.pages; ++page)
        if (parts.pages.knows(page)) checkEntry(parts, page, file.size());
    if (whole == nullptr) return;
    require(all && parts.pages.blocksKnown() == parts.pages.blocks(), "good blocks are admitted");
    require(std::memcmp(parts.pages.data(), whole->pages.data(), whole->pages.size() * sizeof(PageEntry)) == 0,
            "entries in parts are the same");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size > kMostBytes) return 0;
    const MemoryFile file(fileOf(std::as_bytes(std::span(data, size))));
    const auto dataset = readDataset(file);
    readInParts(file, dataset.ok() ? &*dataset : nullptr);
    if (!dataset.ok()) {
        require(!dataset.error().file.empty() && dataset.error().byte && !verifyFile(file).ok(),
                "what is refused says where");
        return 0;
    }
    checkDataset(*dataset, file.size());
    // Pages have a target of their own, fuzz_page; of many bytes they take a long time here.
    uint64_t bytes = 0;
    for (const PageEntry& e : dataset->pages) bytes += uint64_t{e.pageBytes} + e.colourBytes;
    if (bytes <= kMostPageBytes) static_cast<void>(verifyFile(file));
    return 0;
}
