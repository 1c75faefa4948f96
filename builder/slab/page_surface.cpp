#include "builder/slab/page_surface.h"

#include <algorithm>
#include <bitset>
#include <utility>

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

SurfaceCells surfaceOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                       uint32_t log2Cells, size_t mostPieces) {
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    const int depth = int(log2Cells) + 2;
    SurfaceCells quarters;
    SurfaceCutter(mesh, origin, depth, mostPieces).run(triangles, {glm::ivec3(0), depth}, quarters);
    return quarters;
}

uint64_t quartersTouched(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                         uint32_t log2Cells) {
    constexpr int kQuarter = kLatticePerCell / 4;
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    const int edge = 4 << log2Cells;
    constexpr size_t kMostEdge = 128;
    std::vector<std::bitset<kMostEdge>> rows(size_t(edge) * size_t(edge));
    for (const uint32_t k : triangles) {
        const auto& [a, b, c] = mesh.triangles[k];
        const glm::i32vec3 p = mesh.positions[a], q = mesh.positions[b], r = mesh.positions[c];
        // Closed boxes touch the quarters on both sides of a wall that they lie in.
        const glm::i32vec3 low = glm::max((glm::min(p, glm::min(q, r)) - origin - 1) / kQuarter, 0);
        const glm::i32vec3 high = glm::min((glm::max(p, glm::max(q, r)) - origin) / kQuarter, edge - 1);
        if (high.x < low.x) continue;
        const auto row = ~std::bitset<kMostEdge>() >> (kMostEdge - 1 - size_t(high.x - low.x)) << size_t(low.x);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y) rows[size_t(z * edge + y)] |= row;
    }
    uint64_t quarters = 0;
    for (const auto& row : rows) quarters += row.count();
    return quarters;
}

PageSurface foldSurface(SurfaceCells quarters) {
    PageSurface surface;
    surface.quarters = std::move(quarters);
    surface.halves = foldCells(surface.quarters);
    surface.cells = foldCells(surface.halves);
    return surface;
}

}  // namespace vcp
