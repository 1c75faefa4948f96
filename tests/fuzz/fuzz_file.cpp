// What must hold for every header, directory and directory block behind right hashes, however hostile: they are
// refused, or what they say can be relied on. Read in parts the directory is the same; the tree is one; each page
// decodes or is refused. The input: hostile_file.h.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "octree/dataset_reader.h"
#include "octree/header_check.h"
#include "octree/vcp_verify.h"
#include "tests/fuzz/hostile_file.h"

namespace {

using namespace vcp;
using fuzz::fileOf;
using fuzz::MemoryFile;

constexpr uint64_t kMostBytes = 1 << 18, kMostPageBytes = 1 << 17;

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
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
