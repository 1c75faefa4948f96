#include "builder/dataset_assembly.h"

#include <algorithm>
#include <vector>

#include "builder/image_store.h"
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
void addPassages(std::deque<PageSpool>& levels) {
    for (PageSpool& level : levels) level.sortEntries();
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
void linkChildren(std::deque<PageSpool>& levels) {
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
void foldParts(std::deque<PageSpool>& levels) {
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

void describeLevels(const std::deque<PageSpool>& levels, FileHeader& header) {
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
    for (const PageSpool& level : levels)
        for (const PageEntry& entry : level.entries()) finest.add(entry);
    header.certifiedErrorMax = finest.certifiedError;
    header.leaves = finest.leaves;
    header.hardLeaves = finest.hardLeaves;
}

Result<void> appendImages(const PageSpool& images, VcpWriter& writer) {
    VCP_TRY_ASSIGN(auto tables, storedTables(images));
    if (tables.images.empty()) return {};
    const size_t tiles = tables.tiles.size();
    VCP_TRY(writer.beginImages(std::move(tables)));
    for (size_t i = 0; i < tiles; ++i) {
        VCP_TRY_ASSIGN(const auto tile, images.read(images.entries()[i]));
        VCP_TRY(writer.appendTile(tile.geometry));
    }
    return {};
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

Result<uint64_t> assembleDataset(std::deque<PageSpool>& levels, FileHeader& header, const std::filesystem::path& output,
                                 const OutputRules& rules, const PageSpool* images,
                                 const std::function<bool(double)>& progress) {
    addPassages(levels);
    linkChildren(levels);
    foldParts(levels);
    describeLevels(levels, header);
    VCP_TRY_ASSIGN(auto writer, VcpWriter::create(output, header.pages, rules));
    uint64_t done = 0;
    for (const PageSpool& level : levels)
        for (const PageEntry& entry : level.entries()) {
            VCP_TRY_ASSIGN(auto page,
                           entry.leaves > 0 ? level.read(entry) : Result<StoredPage>(passagePage(header.log2Cells)));
            VCP_TRY(writer->append(entry, page));
            if (!progress(double(++done) / double(header.pages + 1))) return Error::cancelled(output.string());
        }
    if (images != nullptr) VCP_TRY(appendImages(*images, *writer));
    return writer->commit(header);
}

}  // namespace vcp
