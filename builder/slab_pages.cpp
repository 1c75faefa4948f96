#include "builder/slab_pages.h"

#include <string>

#include "builder/ordered_pages.h"
#include "builder/page/page_encoder.h"
#include "builder/slab/slab_tree.h"

namespace vcp {

namespace {

/// What the pages below hand up, before it is read.
struct CountBelow {
    uint64_t halves = 0, slabs = 0;

    CountBelow(const PageSpool& below, Siblings siblings) {
        for (size_t i = siblings.first; i < siblings.end; ++i) {
            halves += storedCells(below.entries()[i].pageBytes);
            slabs += storedSlabs(below.entries()[i].colourBytes);
        }
    }
};

Result<SurfaceBelow> readSurface(const PageSpool& below, const PageEntry& entry) {
    VCP_TRY_ASSIGN(const auto stored, below.read(entry));
    auto surface = surfaceFrom(stored);
    if (!surface) return below.damaged(entry);
    return std::move(*surface);
}

Result<PageFold> foldBelow(const PageSpool& below, Siblings siblings, uint32_t log2Cells) {
    const CountBelow count(below, siblings);
    PageFold fold(log2Cells, count.halves, count.slabs);
    for (size_t i = siblings.first; i < siblings.end; ++i) {
        const PageEntry& entry = below.entries()[i];
        VCP_TRY_ASSIGN(const auto surface, readSurface(below, entry));
        fold.add(surface, uint32_t(entry.morton & 7));
    }
    return fold;
}

Result<BuiltPage> buildPage(const LevelSettings& settings, const PageSpool& below, Siblings siblings,
                            bool withSurface) {
    VCP_TRY_ASSIGN(auto fold, foldBelow(below, siblings, settings.grid.log2Cells));
    StoredPage surface;
    if (withSurface) surface = surfaceToHandUp(settings, foldSurface(fold.quarters, settings.withColour));
    fold.quarters = {};
    PageTree tree = slabTree(fold.slabs, settings.grid.log2Cells);
    const uint64_t code = below.entries()[siblings.first].morton >> 3;
    VCP_TRY_ASSIGN(auto page, builtPage(settings, code, encodeSlabPage(tree, settings.withColour)));
    page.entry.colourErrorP95 = colourErrorCode(tree.colourError.p95);
    page.entry.colourErrorMax = colourErrorCode(tree.colourError.max);
    page.surface = std::move(surface);
    return page;
}

/// Returns the memory to build a page above these: their cells, put together as they are read, and its octree; then its
/// bytes. Measured: at most 2 times the halves of cells below, of pages with few of them 3 times.
uint64_t workOf(const PageSpool& below, Siblings siblings) {
    const CountBelow count(below, siblings);
    return (4 << 20) + count.halves * (sizeof(CellSurface) + sizeof(uint32_t)) * 5 / 2 +
           count.slabs * sizeof(CellSlab) * 7;
}

}  // namespace

std::vector<Siblings> siblingsIn(const PageSpool& spool) {
    const std::vector<PageEntry>& entries = spool.entries();
    std::vector<Siblings> runs;
    for (size_t i = 0; i < entries.size(); ++i) {
        if (i == 0 || entries[i].morton >> 3 != entries[i - 1].morton >> 3) runs.push_back({i, i});
        runs.back().end = i + 1;
    }
    return runs;
}

Result<void> keepSurfaces(const PageSpool& below, Siblings siblings, PageSpool& kept) {
    for (size_t i = siblings.first; i < siblings.end; ++i) {
        const PageEntry& entry = below.entries()[i];
        VCP_TRY_ASSIGN(const auto surface, readSurface(below, entry));
        VCP_TRY(kept.append({.morton = entry.morton}, storedSurface(surface, true)));
    }
    return {};
}

Result<void> buildSlabPages(const LevelSettings& settings, const PageSpool& below, std::span<const Siblings> parents,
                            PageSpool& pages, PageSpool* surfaces, const std::function<bool(double)>& progress) {
    std::vector<uint64_t> work;
    for (const Siblings& each : parents) work.push_back(workOf(below, each));
    return buildInOrder({.work = work,
                         .pageBytes = settings.pageBytes,
                         .roomBytes = settings.roomBytes,
                         .makeRoom = settings.makeRoom,
                         .build = [&](size_t i) { return buildPage(settings, below, parents[i], surfaces != nullptr); },
                         .description = [&](size_t) { return std::string("a subvolume holds too much surface"); },
                         .pages = pages,
                         .surfaces = surfaces,
                         .progress = progress});
}

}  // namespace vcp
