#include "builder/dataset_assembly.h"

#include <algorithm>
#include <atomic>

#include "builder/image_store.h"
#include "builder/ordered_pages.h"
#include "octree/page/page.h"
#include "octree/vcp_writer.h"

namespace vcp {

namespace {

/// Makes a page that only leads to finer ones: the surface moved out of it when the level was made.
StoredPage passagePage(uint32_t log2Cells) {
    PageHeader header;
    header.log2Cells = log2Cells;
    header.root = emptyNode(0);
    return compressPage(std::as_bytes(std::span(&header, 1)), {});
}

/// Gives every page a parent, and brings all into Morton order. The entry of a passage has no leaves.
void addPassages(std::vector<JoinedSpools>& levels) {
    for (JoinedSpools& level : levels) level.sortEntries();
    for (size_t level = levels.size() - 1; level > 0; --level) {
        std::vector<PageEntry>& parents = levels[level - 1].entries();
        std::vector<PageEntry> missing;
        for (const PageEntry& page : levels[level].entries()) {
            PageEntry passage;
            passage.morton = page.morton >> 3;
            passage.level = uint8_t(level - 1);
            if (!missing.empty() && missing.back().morton == passage.morton) continue;
            if (!std::ranges::binary_search(parents, passage.morton, {}, &PageEntry::morton))
                missing.push_back(passage);
        }
        parents.insert(parents.end(), missing.begin(), missing.end());
        levels[level - 1].sortEntries();
    }
}

/// Lets every parent name its children.
void linkChildren(std::vector<JoinedSpools>& levels) {
    uint64_t first = levels[0].entries().size();
    for (size_t level = 0; level + 1 < levels.size(); ++level) {
        size_t child = 0;
        const std::vector<PageEntry>& children = levels[level + 1].entries();
        for (PageEntry& page : levels[level].entries()) {
            page.firstChild = uint32_t(first + child);
            for (; child < children.size() && children[child].morton >> 3 == page.morton; ++child)
                page.childMask |= uint8_t(1u << (children[child].morton & 7));
            if (page.childMask == 0) page.firstChild = 0;
        }
        first += children.size();
    }
}

/// Tells of pages that do not know it themselves what parts the pages below them have.
void foldParts(std::vector<JoinedSpools>& levels) {
    for (size_t level = levels.size() - 1; level > 0; --level) {
        std::vector<PageEntry>& parents = levels[level - 1].entries();
        auto parent = parents.begin();
        bool isKnown = parent != parents.end() && parent->parts != 0;
        for (const PageEntry& page : levels[level].entries()) {
            for (; parent->morton != page.morton >> 3; isKnown = parent->parts != 0) ++parent;
            if (!isKnown) parent->parts |= page.parts & (kPageHasClosed | kPageHasOpen);
        }
    }
}

void describeLevels(const std::vector<JoinedSpools>& levels, FileHeader& header) {
    header.levels = uint32_t(levels.size());
    header.pages = 0;
    for (size_t level = 0; level < levels.size(); ++level) {
        LevelRow& row = header.level[level];
        row.firstEntry = header.pages;
        row.pages = levels[level].entries().size();
        for (const PageEntry& page : levels[level].entries())
            row.certifiedError = std::max(row.certifiedError, double(page.certifiedError));
        header.pages += row.pages;
    }
    FinestFigures finest;
    for (const JoinedSpools& level : levels)
        for (const PageEntry& entry : level.entries()) finest.add(entry);
    header.certifiedErrorMax = finest.certifiedError;
    header.leaves = finest.leaves;
    header.hardLeaves = finest.hardLeaves;
}

/// Copies the pages of a level to their places in the file, on all threads; what is not as it was written is found on
/// the way. The level's entries go.
Result<void> copyPages(JoinedSpools& level, VcpWriter& writer, const StoredPage& passage,
                       const std::function<Result<void>()>& copied) {
    size_t end = 0;
    for (PageEntry& entry : level.entries()) {
        if (entry.leaves == 0) passage.describe(entry);
        end = writer.place(entry) + 1;
    }
    const size_t count = level.entries().size(), first = end - count;
    const auto copy = [&](size_t i) -> Result<void> {
        const PageEntry& entry = level.entries()[i];
        VCP_TRY_ASSIGN(const auto page, entry.leaves > 0 ? level.read(entry) : Result<StoredPage>(passage));
        VCP_TRY(writer.write(first + i, page));
        return copied();
    };
    VCP_TRY(level.wake());
    VCP_TRY(forEachInOrder(count, copy));
    level.rest();
    std::vector<PageEntry>().swap(level.entries());
    return {};
}

Result<void> copyImages(const PageSpool& images, VcpWriter& writer, const std::function<Result<void>()>& copied) {
    VCP_TRY_ASSIGN(auto tables, storedTables(images));
    if (tables.images.empty()) return {};
    std::vector<uint64_t> offsets;
    const size_t tiles = tables.tiles.size();
    VCP_TRY(writer.beginImages(std::move(tables)));
    for (size_t i = 0; i < tiles; ++i) offsets.push_back(writer.placeTile(images.entries()[i].storedBytes));
    return forEachInOrder(tiles, [&](size_t i) -> Result<void> {
        VCP_TRY_ASSIGN(const auto tile, images.read(images.entries()[i]));
        VCP_TRY(writer.writeTile(offsets[i], tile.geometry));
        return copied();
    });
}

}  // namespace

FileHeader headerOf(const SoupMeasures& measures, const GridFrame& frame, double errorTarget, bool hasColour) {
    FileHeader header;
    for (int i = 0; i < 3; ++i) {
        header.origin[i] = frame.origin[i];
        header.boundsMin[i] = measures.boundsMin[i];
        header.boundsMax[i] = measures.boundsMax[i];
    }
    header.cell = frame.cell;
    header.log2Cells = frame.log2Cells;
    header.errorTarget = errorTarget;
    header.triangles = measures.triangles;
    header.degenerateTriangles = measures.degenerateTriangles;
    header.vertices = measures.vertices;
    header.flags = hasColour ? kFlagColour : 0;
    return header;
}

Result<uint64_t> assembleDataset(std::vector<JoinedSpools>& levels, FileHeader& header,
                                 const std::filesystem::path& output, const OutputRules& rules, const PageSpool* images,
                                 const std::function<bool(double)>& progress) {
    addPassages(levels);
    linkChildren(levels);
    foldParts(levels);
    describeLevels(levels, header);
    VCP_TRY_ASSIGN(auto writer, VcpWriter::create(output, header.pages, rules));
    const uint64_t count = header.pages + (images != nullptr ? images->entries().size() : 0) + 1;
    std::atomic<uint64_t> done = 0;
    const auto copied = [&]() -> Result<void> {
        return progress(double(++done) / double(count)) ? Result<void>() : Error::cancelled(output.string());
    };
    const StoredPage passage = passagePage(header.log2Cells);
    for (JoinedSpools& level : levels) VCP_TRY(copyPages(level, *writer, passage, copied));
    if (images != nullptr) VCP_TRY(copyImages(*images, *writer, copied));
    return writer->commit(header);
}

}  // namespace vcp
