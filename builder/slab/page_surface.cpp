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

namespace {

/// Cuts triangles, box by box where they make too many pieces at once.
class SurfaceCutter {
public:
    SurfaceCutter(const LatticeMesh& mesh, glm::i32vec3 origin, int depth, size_t mostPieces)
        : mesh_(mesh), origin_(origin), depth_(depth), mostPieces_(mostPieces) {}

    /// Appends the cells of a box, in Morton order.
    void run(std::span<const uint32_t> triangles, CutterBox box, SurfaceCells& cells) const {
        if (cutAll(triangles, box, cells)) return;
        for (int octant = 0; octant < 8; ++octant) run(triangles, box.child(octant), cells);
    }

private:
    /// Returns false, and appends nothing, where there are too many pieces.
    bool cutAll(std::span<const uint32_t> triangles, CutterBox box, SurfaceCells& cells) const {
        TriangleCutter cutter(mesh_, origin_, depth_, box);
        for (const uint32_t k : triangles) {
            cutter.cut(k);
            if (cutter.pieces() > mostPieces_ && box.log2Edge > 0) return false;
        }
        cutter.appendTo(cells);
        return true;
    }

    const LatticeMesh& mesh_;
    glm::i32vec3 origin_;
    int depth_;
    size_t mostPieces_;
};

}  // namespace

PageSurface surfaceOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                      uint32_t log2Cells, size_t mostPieces) {
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    const int depth = int(log2Cells) + 1;
    PageSurface surface;
    SurfaceCutter(mesh, origin, depth, mostPieces).run(triangles, {glm::ivec3(0), depth}, surface.halves);
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
