#include "builder/slab/slab_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "builder/slab/slab_error.h"
#include "builder/stream/colour_difference.h"
#include "octree/surface/morton.h"
#include "octree/surface/packing.h"

namespace vcp {

namespace {

class SlabMaker {
public:
    SlabMaker(const PageSurface& surface, bool withColour)
        : levels_{&surface.cells, &surface.halves, &surface.quarters}, withColour_(withColour) {}

    std::vector<CellSlab> run() {
        slabs_.reserve(levels_[0]->size());
        for (size_t i = 0; i < levels_[0]->size(); ++i) addCell(i);
        return std::move(slabs_);
    }

private:
    /// A run of a list of cells.
    struct Run {
        size_t first, end;
    };

    /// Returns the eighths of a cell, as a run of the next list.
    [[nodiscard]] Run eighthsOf(size_t level, size_t cell) const {
        const std::vector<uint32_t>& codes = levels_[level + 1]->codes;
        const uint32_t first = levels_[level]->codes[cell] << 3;
        const auto begin = std::lower_bound(codes.begin(), codes.end(), first);
        const auto end = std::lower_bound(begin, codes.end(), first + 8);
        return {size_t(begin - codes.begin()), size_t(end - codes.begin())};
    }

    void addCell(size_t cell) {
        const Run halves = eighthsOf(0, cell);
        CellSlab slab = slabOf(0, cell, halves);
        if (isGood(slab, cell, halves)) return add(slab, 0, halves);
        // Halves of cells are never parted: their error is small enough whatever lies in them.
        for (size_t i = halves.first; i < halves.end; ++i) {
            const Run quarters = eighthsOf(1, i);
            add(slabOf(1, i, quarters), 1, quarters);
        }
    }

    void add(CellSlab slab, size_t level, Run eighths) {
        if (withColour_) addColourError(slab, level, eighths);
        slabs_.push_back(slab);
    }

    void addColourError(CellSlab& slab, size_t level, Run eighths) const {
        const glm::dvec3 shown = okLabOfStored(slab.colour);
        double squares = 0, area = 0;
        for (size_t i = eighths.first; i < eighths.end; ++i) {
            const CellSurface& eighth = levels_[level + 1]->cells[i];
            if (!(eighth.area > 0)) continue;
            const double part = double(eighth.area);
            const glm::dvec3 off = okLabOf(glm::dvec3(eighth.light) / part) - shown;
            squares += part * glm::dot(off, off);
            area += part;
        }
        // Areas are in squares of an eighth's edge.
        if (!(area > 0)) return;
        slab.colourError = float(100 * std::sqrt(squares / area));
        slab.area = float(std::ldexp(area, -2 * int(level)));
    }

    /// Whether a cell needs no finer leaves. Sets the slab's error.
    bool isGood(CellSlab& slab, size_t cell, Run halves) {
        if (normalSpread(levels_[0]->cells[cell]) > kMostNormalSpread) return false;
        quarters_.clear();
        for (size_t i = halves.first; i < halves.end; ++i) {
            const Run inside = eighthsOf(1, i);
            for (size_t k = inside.first; k < inside.end; ++k)
                quarters_.push_back({levels_[2]->codes[k] & 63u, &levels_[2]->cells[k]});
        }
        const double middle = f64::slabOffset(slab.code), half = f64::slabHalfThickness(slab.code);
        const double error = slabError(f64::decodeDirection(slab.code >> kSlabDirectionShift),
                                       {middle - half, middle + half}, quarters_);
        slab.error = std::nextafter(float(error), std::numeric_limits<float>::infinity());
        return error <= kMostSlabError;
    }

    CellSlab slabOf(size_t level, size_t index, Run eighths) {
        const CellSurface& cell = levels_[level]->cells[index];
        CellSlab slab{.at = levels_[level]->codes[index] << (level == 0 ? 3 : 0),
                      .colour = meanColour(cell),
                      .error = float(kAnySlabError),
                      .parts = uint8_t(cell.parts),
                      .isHalf = uint16_t(level)};
        const uint32_t direction = packSlabDirection(glm::dvec3(cell.axis));
        const glm::dvec3 n = f64::decodeDirection(direction);
        octants_.clear();
        for (size_t i = eighths.first; i < eighths.end; ++i) octants_.push_back(levels_[level + 1]->codes[i] & 7u);
        for (const uint32_t o : octants_) slab.octants = uint8_t(slab.octants | 1u << o);
        const auto parts = std::span(levels_[level + 1]->cells).subspan(eighths.first, octants_.size());
        const Extent extent = extentAlong(parts, octants_, n);
        slab.code = packSlab(direction, extent.first, extent.last);
        return slab;
    }

    std::array<const SurfaceCells*, 3> levels_;  ///< cells, halves, quarters
    bool withColour_;
    std::vector<CellSlab> slabs_;
    std::vector<uint32_t> octants_;
    std::vector<SurfaceQuarter> quarters_;
};

class SlabTreeBuilder {
public:
    SlabTreeBuilder(std::span<const CellSlab> slabs, uint32_t log2Cells) : slabs_(slabs), log2Cells_(log2Cells) {
        tree_.cells = 1 << log2Cells;
        tree_.occupied.assign(size_t{1} << 3 * log2Cells, 0);
    }

    PageTree run() {
        tree_.nodes.emplace_back();
        tree_.nodes[0].box = {glm::ivec3(0), tree_.cells * kSubcells};
        if (!slabs_.empty()) build(0, slabs_, log2Cells_ + kQuarterBits);
        for (const CellSlab& slab : slabs_) {
            const glm::ivec3 at(mortonDecode(slab.at >> 3 * kQuarterBits));
            tree_.occupied[size_t(at.x + tree_.cells * (at.y + tree_.cells * at.z))] = 1;
        }
        tree_.colourError = colourError();
        return std::move(tree_);
    }

private:
    static constexpr uint32_t kQuarterBits = 2;  ///< a cell of the page is so many halvings above what slabs count in

    /// Fills node `node` from the slabs in it, of which there are some; the node's edge is 2^bits quarters of cells.
    void build(uint32_t node, std::span<const CellSlab> slabs, uint32_t bits) {
        if (bits == (slabs.front().isHalf != 0 ? 0u : 1u)) return makeSlab(node, slabs.front());
        const uint32_t children = tree_.addChildren(node);
        while (!slabs.empty()) {
            const auto octantOf = [&](const CellSlab& slab) { return slab.at >> 3 * (bits - 1) & 7u; };
            const uint32_t octant = octantOf(slabs.front());
            size_t count = 1;
            while (count < slabs.size() && octantOf(slabs[count]) == octant) ++count;
            build(children + octant, slabs.first(count), bits - 1);
            slabs = slabs.subspan(count);
        }
    }

    void makeSlab(uint32_t node, const CellSlab& slab) {
        tree_.makeSlab(node, {.box = tree_.nodes[node].box,
                              .code = slab.code,
                              .octants = slab.octants,
                              .parts = slab.parts,
                              .error = double(slab.error),
                              .colour = slab.colour});
    }

    [[nodiscard]] ColourError colourError() const {
        std::vector<const CellSlab*> counted;
        for (const CellSlab& slab : slabs_)
            if (slab.area > 0) counted.push_back(&slab);
        if (counted.empty()) return {};
        std::ranges::stable_sort(counted, {}, [](const CellSlab* slab) { return slab->colourError; });
        double all = 0, below = 0;
        for (const CellSlab* slab : counted) all += double(slab->area);
        size_t at = 0;
        while (at + 1 < counted.size() && (below += double(counted[at]->area)) < 0.95 * all) ++at;
        return {.p95 = double(counted[at]->colourError), .max = double(counted.back()->colourError)};
    }

    std::span<const CellSlab> slabs_;
    uint32_t log2Cells_;
    PageTree tree_;
};

}  // namespace

std::vector<CellSlab> slabsOf(const PageSurface& surface, bool withColour) {
    return SlabMaker(surface, withColour).run();
}

PageTree slabTree(std::span<const CellSlab> slabs, uint32_t log2Cells) {
    return SlabTreeBuilder(slabs, log2Cells).run();
}

}  // namespace vcp
