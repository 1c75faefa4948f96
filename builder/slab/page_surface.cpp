#include "builder/slab/page_surface.h"

#include <algorithm>
#include <bit>

#include <glm/common.hpp>

#include "builder/slab/triangle_cutter.h"

namespace vcp {

namespace {

void reserve(SurfaceCells& cells, size_t count) {
    cells.codes.reserve(count);
    cells.cells.reserve(count);
}

size_t coarserCells(const SurfaceCells& eighths) {
    size_t count = 0;
    for (size_t i = 0; i < eighths.size(); ++i) count += i == 0 || eighths.codes[i] >> 3 != eighths.codes[i - 1] >> 3;
    return count;
}

}  // namespace

SurfaceCells foldCells(const SurfaceCells& eighths) {
    SurfaceCells folded;
    reserve(folded, coarserCells(eighths));
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

    /// Appends the half cells of a box and their eighths, in Morton order.
    void run(std::span<const uint32_t> triangles, CutterBox box, PageSurface& surface) const {
        if (cutAll(triangles, box, surface)) return;
        for (int octant = 0; octant < 8; ++octant) run(triangles, box.child(octant), surface);
    }

private:
    /// Returns false, and appends nothing, where there are too many pieces.
    bool cutAll(std::span<const uint32_t> triangles, CutterBox box, PageSurface& surface) const {
        TriangleCutter cutter(mesh_, origin_, depth_, box);
        for (const uint32_t k : triangles) {
            cutter.cut(k);
            if (cutter.pieces() > mostPieces_ && box.log2Edge > 0) return false;
        }
        cutter.appendTo(surface.halves, surface.quarters);
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
    SurfaceCutter(mesh, origin, depth, mostPieces).run(triangles, {glm::ivec3(0), depth}, surface);
    surface.cells = foldCells(surface.halves);
    return surface;
}

uint64_t halvesTouched(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                       uint32_t log2Cells) {
    constexpr int kHalf = kLatticePerCell / 2;
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    const int edge = 2 << log2Cells;
    std::vector<uint64_t> rows(size_t(edge) * size_t(edge));
    for (const uint32_t k : triangles) {
        const auto& [a, b, c] = mesh.triangles[k];
        const glm::i32vec3 p = mesh.positions[a], q = mesh.positions[b], r = mesh.positions[c];
        // Closed boxes touch the half cells on both sides of a wall that they lie in.
        const glm::i32vec3 low = glm::max((glm::min(p, glm::min(q, r)) - origin - 1) / kHalf, 0);
        const glm::i32vec3 high = glm::min((glm::max(p, glm::max(q, r)) - origin) / kHalf, edge - 1);
        if (high.x < low.x) continue;
        const uint64_t row = ~uint64_t{0} >> (63 - (high.x - low.x)) << low.x;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y) rows[size_t(z * edge + y)] |= row;
    }
    uint64_t halves = 0;
    for (const uint64_t row : rows) halves += uint64_t(std::popcount(row));
    return halves;
}

PageSurface foldSurface(const SurfaceCells& quarters, bool withColour) {
    PageSurface surface;
    surface.halves = foldCells(quarters);
    surface.cells = foldCells(surface.halves);
    surface.quarters.codes = quarters.codes;
    surface.quarters.boxes.reserve(quarters.size());
    if (withColour) surface.quarters.lights.reserve(quarters.size());
    for (const CellSurface& c : quarters.cells) {
        surface.quarters.boxes.emplace_back(c.lower, c.upper);
        if (withColour) surface.quarters.lights.push_back(litArea(c));
    }
    return surface;
}

}  // namespace vcp
