#include "builder/slab/page_surface.h"

#include <cstring>

#include "builder/slab/triangle_cutter.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

SurfaceCells foldCells(const SurfaceCells& eighths) {
    SurfaceCells folded;
    std::vector<uint32_t> octants;
    for (size_t i = 0; i < eighths.size();) {
        const uint32_t code = eighths.codes[i] >> 3;
        octants.clear();
        size_t end = i;
        for (; end < eighths.size() && eighths.codes[end] >> 3 == code; ++end)
            octants.push_back(eighths.codes[end] & 7u);
        folded.codes.push_back(code);
        folded.cells.push_back(foldEighths(std::span(eighths.cells).subspan(i, end - i), octants));
        i = end;
    }
    return folded;
}

PageSurface surfaceOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                      uint32_t log2Cells) {
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    TriangleCutter cutter(mesh, origin, int(log2Cells) + 1);
    for (const uint32_t k : triangles) cutter.cut(k);
    PageSurface surface;
    surface.halves = cutter.take();
    surface.cells = foldCells(surface.halves);
    return surface;
}

namespace {

/// Appends the cells of a page to those of the page above.
void append(SurfaceCells& to, const SurfaceCells& from, uint32_t octant, uint32_t depth) {
    to.codes.reserve(to.size() + from.size());
    for (const uint32_t code : from.codes) to.codes.push_back(octant << 3 * depth | code);
    to.cells.insert(to.cells.end(), from.cells.begin(), from.cells.end());
}

}  // namespace

PageSurface foldPages(std::span<const PageSurface> pages, std::span<const uint32_t> octants, uint32_t log2Cells) {
    PageSurface surface;
    for (size_t i = 0; i < pages.size(); ++i) {
        append(surface.halves, pages[i].cells, octants[i], log2Cells);
        append(surface.quarters, pages[i].halves, octants[i], log2Cells + 1);
    }
    surface.cells = foldCells(surface.halves);
    return surface;
}

std::vector<std::byte> bytesOf(const SurfaceCells& cells) {
    const size_t codes = cells.size() * sizeof(uint32_t), all = cells.size() * sizeof(CellSurface);
    std::vector<std::byte> bytes(codes + all);
    if (bytes.empty()) return bytes;
    std::memcpy(bytes.data(), cells.codes.data(), codes);
    std::memcpy(bytes.data() + codes, cells.cells.data(), all);
    return bytes;
}

SurfaceCells surfaceCellsFrom(std::span<const std::byte> bytes) {
    const size_t count = bytes.size() / (sizeof(uint32_t) + sizeof(CellSurface));
    SurfaceCells cells{std::vector<uint32_t>(count), std::vector<CellSurface>(count)};
    if (count == 0) return cells;
    std::memcpy(cells.codes.data(), bytes.data(), count * sizeof(uint32_t));
    std::memcpy(cells.cells.data(), bytes.data() + count * sizeof(uint32_t), count * sizeof(CellSurface));
    return cells;
}

StoredPage storedSurface(const PageSurface& surface) {
    return {.geometry = bytesOf(surface.cells), .colour = bytesOf(surface.halves)};
}

PageSurface surfaceFrom(const StoredPage& stored) {
    return {.cells = surfaceCellsFrom(stored.geometry), .halves = surfaceCellsFrom(stored.colour)};
}

}  // namespace vcp
