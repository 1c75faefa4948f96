#include "builder/slab/slab_tree.h"

#include <algorithm>
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
    SlabMaker(const PageSurface& surface, bool withColour) : surface_(surface), withColour_(withColour) {}

    std::vector<CellSlab> run() {
        const SurfaceCells& cells = surface_.cells;
        slabs_.reserve(cells.size());
        for (size_t i = 0; i < cells.size(); ++i) addCell(cells.codes[i], cells.cells[i]);
        return std::move(slabs_);
    }

private:
    /// A run of halves or quarters: the eighths of a cell or of a half.
    struct Run {
        size_t first, count;
    };

    static Run eighthsOf(const std::vector<uint32_t>& codes, uint32_t of) {
        const auto begin = std::lower_bound(codes.begin(), codes.end(), of << 3);
        const auto end = std::lower_bound(begin, codes.end(), (of << 3) + 8);
        return {size_t(begin - codes.begin()), size_t(end - begin)};
    }
    [[nodiscard]] Run quartersOf(size_t half) const {
        return eighthsOf(surface_.quarters.codes, surface_.halves.codes[half]);
    }

    void addCell(uint32_t code, const CellSurface& cell) {
        const Run run = eighthsOf(surface_.halves.codes, code);
        const auto halves = std::span(surface_.halves.cells).subspan(run.first, run.count);
        takeOctants(surface_.halves.codes, run);
        const glm::dvec3 n = f64::decodeDirection(packSlabDirection(glm::dvec3(cell.axis)));
        CellSlab slab = slabOf(cell, code << 3, extentAlong(halves, octants_, n));
        if (isGood(slab, cell, run)) {
            lights_.clear();
            for (const CellSurface& half : halves) lights_.push_back(litArea(half));
            return add(slab, lights_, 0);
        }
        // Halves of cells are never parted: their error is small enough whatever lies in them.
        for (size_t i = run.first; i < run.first + run.count; ++i) addHalf(i);
    }

    void addHalf(size_t i) {
        const CellSurface& half = surface_.halves.cells[i];
        const Run run = quartersOf(i);
        takeOctants(surface_.quarters.codes, run);
        const glm::dvec3 n = f64::decodeDirection(packSlabDirection(glm::dvec3(half.axis)));
        CellSlab slab = slabOf(half, surface_.halves.codes[i], extentAlong(half, n));
        slab.isHalf = 1;
        const std::span<const glm::vec4> lights(surface_.quarters.lights);
        add(slab, lights.empty() ? lights : lights.subspan(run.first, run.count), 1);
    }

    void takeOctants(const std::vector<uint32_t>& codes, Run run) {
        octants_.clear();
        for (size_t i = run.first; i < run.first + run.count; ++i) octants_.push_back(codes[i] & 7u);
    }

    /// Returns the slab of a cell or a half, whose eighths with surface are in octants_, with the error of any.
    [[nodiscard]] CellSlab slabOf(const CellSurface& cell, uint32_t at, Extent extent) const {
        CellSlab slab{.at = at,
                      .code = packSlab(packSlabDirection(glm::dvec3(cell.axis)), extent.first, extent.last),
                      .colour = meanColour(cell),
                      .error = float(kAnySlabError),
                      .parts = uint8_t(cell.parts)};
        for (const uint32_t o : octants_) slab.octants = uint8_t(slab.octants | 1u << o);
        return slab;
    }

    /// Whether a cell needs no finer leaves. Sets the slab's error.
    bool isGood(CellSlab& slab, const CellSurface& cell, Run halves) {
        if (normalSpread(cell) > kMostNormalSpread) return false;
        quarters_.clear();
        for (size_t i = halves.first; i < halves.first + halves.count; ++i) {
            const Run run = quartersOf(i);
            for (size_t k = run.first; k < run.first + run.count; ++k)
                quarters_.push_back({surface_.quarters.codes[k] & 63u, surface_.quarters.boxes[k]});
        }
        const double middle = f64::slabOffset(slab.code), half = f64::slabHalfThickness(slab.code);
        const double error = slabError(f64::decodeDirection(slab.code >> kSlabDirectionShift),
                                       {middle - half, middle + half}, quarters_);
        if (error > kMostSlabError) return false;
        slab.error = std::nextafter(float(error), std::numeric_limits<float>::infinity());
        return true;
    }

    /// `lights`: of its eighths. `halvings`: of a cell's edge, to the slab's.
    void add(CellSlab slab, std::span<const glm::vec4> lights, int halvings) {
        if (withColour_) addColourError(slab, lights, halvings);
        slabs_.push_back(slab);
    }

    static void addColourError(CellSlab& slab, std::span<const glm::vec4> lights, int halvings) {
        const glm::dvec3 shown = okLabOfStored(slab.colour);
        double squares = 0, area = 0;
        for (const glm::vec4& light : lights) {
            if (!(light.w > 0)) continue;
            const double part = double(light.w);
            const glm::dvec3 off = okLabOf(glm::dvec3(light) / part) - shown;
            squares += part * glm::dot(off, off);
            area += part;
        }
        // Areas are in squares of an eighth's edge.
        if (!(area > 0)) return;
        slab.colourError = float(100 * std::sqrt(squares / area));
        slab.area = float(std::ldexp(area, -2 * halvings));
    }

    const PageSurface& surface_;
    bool withColour_;
    std::vector<CellSlab> slabs_;
    // Of the slab at hand.
    std::vector<uint32_t> octants_;
    std::vector<SurfaceQuarter> quarters_;
    std::vector<glm::vec4> lights_;
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
