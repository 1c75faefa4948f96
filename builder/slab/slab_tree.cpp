#include "builder/slab/slab_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/geometric.hpp>

#include "builder/slab/slab_error.h"
#include "builder/stream/colour_difference.h"
#include "octree/surface/morton.h"
#include "octree/surface/packing.h"

namespace vcp {

namespace {

class SlabTreeBuilder {
public:
    SlabTreeBuilder(const PageSurface& surface, uint32_t log2Cells, bool withColour)
        : levels_{&surface.cells, &surface.halves, &surface.quarters}, log2Cells_(log2Cells), withColour_(withColour) {
        tree_.cells = 1 << log2Cells;
        tree_.occupied.assign(size_t{1} << 3 * log2Cells, 0);
    }

    PageTree run() {
        tree_.nodes.emplace_back();
        tree_.nodes[0].box = {glm::ivec3(0), tree_.cells * kSubcells};
        const SurfaceCells& cells = *levels_[0];
        if (cells.size() > 0) build(0, {0, cells.size()}, log2Cells_);
        for (const uint32_t code : cells.codes) {
            const glm::ivec3 at(mortonDecode(code));
            tree_.occupied[size_t(at.x + tree_.cells * (at.y + tree_.cells * at.z))] = 1;
        }
        tree_.colourError = colourError();
        return std::move(tree_);
    }

private:
    /// A run of a list of cells.
    struct Run {
        size_t first, end;
    };

    /// Fills node `node` from a run of cells that is not empty; the node's edge is 2^bits cells.
    void build(uint32_t node, Run run, uint32_t bits) {
        if (bits == 0) return buildCell(node, 0, run.first);
        const std::vector<uint32_t>& codes = levels_[0]->codes;
        const uint32_t children = tree_.addChildren(node);
        while (run.first < run.end) {
            const uint32_t octant = codes[run.first] >> 3 * (bits - 1) & 7u;
            size_t end = run.first;
            while (end < run.end && (codes[end] >> 3 * (bits - 1) & 7u) == octant) ++end;
            build(children + octant, {run.first, end}, bits - 1);
            run.first = end;
        }
    }

    /// Returns the eighths of a cell, as a run of the next list.
    [[nodiscard]] Run eighthsOf(size_t level, size_t cell) const {
        const std::vector<uint32_t>& codes = levels_[level + 1]->codes;
        const uint32_t first = levels_[level]->codes[cell] << 3;
        const auto begin = std::lower_bound(codes.begin(), codes.end(), first);
        const auto end = std::lower_bound(begin, codes.end(), first + 8);
        return {size_t(begin - codes.begin()), size_t(end - codes.begin())};
    }

    void buildCell(uint32_t node, size_t level, size_t index) {
        const Run eighths = eighthsOf(level, index);
        SlabLeaf leaf = leafOf(tree_.nodes[node].box, level, index, eighths);
        // Halves of cells are never parted: their error is small enough whatever lies in them.
        if (level > 0 || isGood(leaf, index, eighths)) return makeSlab(node, leaf, level, index);
        const uint32_t children = tree_.addChildren(node);
        for (size_t i = eighths.first; i < eighths.end; ++i)
            buildCell(children + (levels_[level + 1]->codes[i] & 7u), level + 1, i);
    }

    void makeSlab(uint32_t node, const SlabLeaf& leaf, size_t level, size_t index) {
        tree_.makeSlab(node, leaf);
        if (!withColour_) return;
        const glm::dvec3 shown = okLabOfStored(leaf.colour);
        double squares = 0, area = 0;
        const Run eighths = eighthsOf(level, index);
        for (size_t i = eighths.first; i < eighths.end; ++i) {
            const CellSurface& eighth = levels_[level + 1]->cells[i];
            if (!(eighth.area > 0)) continue;
            const double part = double(eighth.area);
            const glm::dvec3 off = okLabOf(glm::dvec3(eighth.light) / part) - shown;
            squares += part * glm::dot(off, off);
            area += part;
        }
        // Areas are in squares of an eighth's edge.
        if (area > 0) differences_.push_back({100 * std::sqrt(squares / area), std::ldexp(area, -2 * int(level))});
    }

    /// A slab's colour error, and the area of the surface in it.
    struct Difference {
        double deltaE, area;
    };

    [[nodiscard]] ColourError colourError() {
        if (differences_.empty()) return {};
        std::sort(differences_.begin(), differences_.end(),
                  [](const Difference& a, const Difference& b) { return a.deltaE < b.deltaE; });
        double all = 0, below = 0;
        for (const Difference& each : differences_) all += each.area;
        size_t at = 0;
        while (at + 1 < differences_.size() && (below += differences_[at].area) < 0.95 * all) ++at;
        return {.p95 = differences_[at].deltaE, .max = differences_.back().deltaE};
    }

    /// Whether a cell needs no finer leaves. Sets the leaf's error.
    bool isGood(SlabLeaf& leaf, size_t index, Run eighths) {
        if (normalSpread(levels_[0]->cells[index]) > kMostNormalSpread) return false;
        quarters_.clear();
        for (size_t i = eighths.first; i < eighths.end; ++i) {
            const Run inside = eighthsOf(1, i);
            for (size_t k = inside.first; k < inside.end; ++k)
                quarters_.push_back({levels_[2]->codes[k] & 63u, &levels_[2]->cells[k]});
        }
        const double middle = f64::slabOffset(leaf.code), half = f64::slabHalfThickness(leaf.code);
        leaf.error = slabError(f64::decodeDirection(leaf.code >> kSlabDirectionShift), {middle - half, middle + half},
                               quarters_);
        return leaf.error <= kMostSlabError;
    }

    SlabLeaf leafOf(const NodeBox& box, size_t level, size_t index, Run eighths) {
        const CellSurface& cell = levels_[level]->cells[index];
        SlabLeaf leaf{.box = box, .parts = cell.parts, .error = kAnySlabError, .colour = meanColour(cell)};
        const uint32_t direction = packSlabDirection(glm::dvec3(cell.axis));
        const glm::dvec3 n = f64::decodeDirection(direction);
        octants_.clear();
        for (size_t i = eighths.first; i < eighths.end; ++i) octants_.push_back(levels_[level + 1]->codes[i] & 7u);
        for (const uint32_t o : octants_) leaf.octants |= 1u << o;
        const auto parts = std::span(levels_[level + 1]->cells).subspan(eighths.first, octants_.size());
        const Extent extent = extentAlong(parts, octants_, n);
        leaf.code = packSlab(direction, extent.first, extent.last);
        return leaf;
    }

    std::array<const SurfaceCells*, 3> levels_;  ///< cells, halves, quarters
    uint32_t log2Cells_;
    bool withColour_;
    PageTree tree_;
    std::vector<Difference> differences_;
    std::vector<uint32_t> octants_;
    std::vector<SurfaceQuarter> quarters_;
};

}  // namespace

PageTree buildSlabTree(const PageSurface& surface, uint32_t log2Cells, bool withColour) {
    return SlabTreeBuilder(surface, log2Cells, withColour).run();
}

}  // namespace vcp
