#include "builder/slab_pages.h"

#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "builder/ordered_pages.h"
#include "builder/page/page_encoder.h"
#include "builder/slab/slab_tree.h"

namespace vcp {

namespace {

/// A run of entries with one parent.
struct Siblings {
    size_t first, end;
};

std::vector<Siblings> siblingsOf(const std::vector<PageEntry>& entries) {
    std::vector<Siblings> runs;
    for (size_t i = 0; i < entries.size(); ++i) {
        if (i == 0 || entries[i].morton >> 3 != entries[i - 1].morton >> 3) runs.push_back({i, i});
        runs.back().end = i + 1;
    }
    return runs;
}

Result<PageSurface> surfaceAbove(const PageSpool& below, Siblings siblings, uint32_t log2Cells) {
    std::vector<PageSurface> pages;
    std::vector<uint32_t> octants;
    for (size_t i = siblings.first; i < siblings.end; ++i) {
        const PageEntry& entry = below.entries()[i];
        VCP_TRY_ASSIGN(const auto stored, below.read(entry));
        pages.push_back({.cells = surfaceCellsFrom(stored.geometry), .halves = surfaceCellsFrom(stored.colour)});
        octants.push_back(uint32_t(entry.morton & 7));
    }
    return foldPages(pages, octants, log2Cells);
}

Result<BuiltPage> buildPage(const LevelSettings& settings, const PageSpool& below, Siblings siblings) {
    VCP_TRY_ASSIGN(const auto surface, surfaceAbove(below, siblings, settings.grid.log2Cells));
    PageTree tree = buildSlabTree(surface, settings.grid.log2Cells);
    const EncodedPage encoded = encodeSlabPage(tree, settings.withColour);
    BuiltPage page;
    page.entry.morton = below.entries()[siblings.first].morton >> 3;
    page.entry.level = uint8_t(settings.grid.level);
    page.entry.leaves = encoded.leaves;
    page.entry.slabLeaves = encoded.slabLeaves;
    page.entry.certifiedError =
        std::nextafter(float(encoded.certifiedError * settings.cell), std::numeric_limits<float>::infinity());
    page.stored = compressPage(encoded.geometry, encoded.colour);
    page.surface = storedSurface(surface);
    return page;
}

/// Returns the memory to build a page above these: their cells, read and put together, and its bytes before and after
/// they are coded.
uint64_t workOf(const PageSpool& below, Siblings siblings) {
    uint64_t bytes = 0;
    for (size_t i = siblings.first; i < siblings.end; ++i) {
        const PageEntry& entry = below.entries()[i];
        bytes += entry.storedBytes + entry.colourStoredBytes;
    }
    return (4 << 20) + 5 * bytes;
}

}  // namespace

StoredPage storedSurface(const PageSurface& surface) {
    return {.geometry = bytesOf(surface.cells), .colour = bytesOf(surface.halves)};
}

size_t parentsOf(const PageSpool& below) { return siblingsOf(below.entries()).size(); }

Result<void> buildSlabPages(const LevelSettings& settings, const PageSpool& below, size_t first, size_t end,
                            PageSpool& pages, PageSpool& surfaces, const std::function<bool(double)>& progress) {
    const std::vector<Siblings> all = siblingsOf(below.entries());
    const auto parents = std::span(all).subspan(first, end - first);
    std::vector<uint64_t> work;
    for (const Siblings& each : parents) work.push_back(workOf(below, each));
    return buildInOrder({.work = work,
                         .pageBytes = settings.pageBytes,
                         .roomBytes = settings.roomBytes,
                         .makeRoom = settings.makeRoom,
                         .build = [&](size_t i) { return buildPage(settings, below, parents[i]); },
                         .description = [&](size_t) { return std::string("a subvolume holds too much surface"); },
                         .pages = pages,
                         .surfaces = &surfaces,
                         .progress = progress});
}

}  // namespace vcp
