// The pages that hold the mesh: those of one level, and where they would hold more triangles than a page should, those
// of finer levels. So a page is small wherever triangles are small: a statue in a building has levels of its own.
//
// All triangles lie on one lattice, the deepest level's. A page of a coarser level needs vertices that lie on its own,
// coarser lattice, and a triangle that several pages hold must be the same in all of them, or rays would slip through
// between. So:
//   - beside a page below the base level, within a fourth of its length, no edge is longer than kPartedEdgeCells of the
//     page's cells. So a triangle lies within that reach of each of its corners in such a page;
//   - a vertex lies on the lattice of the coarsest page within that reach (stepAt);
//   - near any page no edge is longer than kMaxEdgeCells of its cells. A triangle lies within the length of its longest
//     edge of this one's middle.
// All of this depends on vertices and edges alone, so that neighbours agree. A triangle then has its corners on the
// lattice of every page that it touches.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/gtc/type_precision.hpp>

#include "builder/lattice/page_partition.h"

namespace vcp {

/// Longest edge beside a page below the base level, in cells of that page.
inline constexpr int kPartedEdgeCells = 16;

class FinestPages {
public:
    /// Makes all pages of a level.
    explicit FinestPages(PageGrid base = {}) : grid_(base) {}
    /// `parted`: for the base level and each one below, the Morton codes of pages that are parted into eight, in any
    /// order; the pages above them are added.
    FinestPages(PageGrid base, std::vector<std::vector<uint64_t>> parted);

    [[nodiscard]] bool isUniform() const { return parted_.empty(); }
    [[nodiscard]] uint32_t base() const { return grid_.level; }
    [[nodiscard]] uint32_t deepest() const { return grid_.level + uint32_t(parted_.size()); }
    [[nodiscard]] PageGrid gridOf(uint32_t level) const { return {grid_.log2Cells, level}; }
    /// What makes the same pages again; ascending codes.
    [[nodiscard]] const std::vector<std::vector<uint64_t>>& parted() const { return parted_; }
    /// Returns the first code of the deepest level within a page.
    [[nodiscard]] uint64_t firstCode(uint32_t level, uint64_t code) const { return code << 3 * (deepest() - level); }

    /// Calls visit(level, Morton code) for every page whose cube, widened by `margin` of its cells, the triangle
    /// overlaps. `corner`: on the lattice of the deepest level, or of the level `lattice`.
    template <class Visit>
    void forPagesNear(const glm::i32vec3 (&corner)[3], double margin, uint32_t lattice, Visit&& visit) const;
    template <class Visit>
    void forPagesNear(const glm::i32vec3 (&corner)[3], double margin, Visit&& visit) const {
        forPagesNear(corner, margin, deepest(), visit);
    }

    /// Returns the distance between neighbouring vertices around a point, in steps of the deepest level's lattice:
    /// vertices lie on multiples of it.
    [[nodiscard]] int stepAt(glm::i32vec3 p) const;
    /// Where a vertex lies, and stepAt there.
    struct Vertex {
        glm::i32vec3 at;
        int step;
    };
    /// Returns the vertex of a point without negative coordinates; `at`: the point on the deepest lattice.
    [[nodiscard]] Vertex vertexOf(glm::dvec3 point, glm::i32vec3 at) const;
    /// Whether the edge between two points is too long for a page near it.
    [[nodiscard]] bool isTooLong(glm::i32vec3 a, glm::i32vec3 b) const;

private:
    struct Levels {
        uint32_t coarsest, deepest;
    };
    /// A parted page has the numbers of those of its eight parts that are parted themselves; kWhole for the others.
    using Parts = std::array<uint32_t, 8>;
    static constexpr uint32_t kWhole = 0xffffffff;

    /// Returns the number of a page of the base level, or kWhole.
    [[nodiscard]] uint32_t numberOf(uint64_t code) const;
    /// Returns the levels of the pages that touch the box of half edges `reach` around a point.
    [[nodiscard]] Levels levelsAround(glm::i32vec3 p, glm::i64vec3 reach) const;
    /// Adds the levels of the pages in page `number`, at `corner`, that touch a box.
    void addLevels(uint32_t level, uint32_t number, const glm::i64vec3& corner, const glm::i64vec3& low,
                   const glm::i64vec3& high, Levels& levels) const;
    /// Returns so many cells of a level, in steps.
    [[nodiscard]] int64_t stepsOf(int cells, uint32_t level) const {
        return int64_t{cells} << (PageGrid::kLog2LatticePerCell + deepest() - level);
    }
    [[nodiscard]] int log2PageSteps(uint32_t level) const {
        return int(grid_.log2Cells + PageGrid::kLog2LatticePerCell + deepest() - level);
    }

    PageGrid grid_;
    std::vector<std::vector<uint64_t>> parted_;  ///< [0]: of the base level; the last is not empty
    std::vector<Parts> parts_;                   ///< of all parted pages, level after level
    glm::i64vec3 first_{0}, last_{-1};           ///< box of pages of the base level that holds those that are parted
};

template <class Visit>
void FinestPages::forPagesNear(const glm::i32vec3 (&corner)[3], double margin, uint32_t lattice, Visit&& visit) const {
    if (isUniform()) return grid_.forPagesNear(corner, margin, [&](uint64_t code) { visit(base(), code); });
    // In pages of the base level.
    const int log2Steps = int(grid_.log2Cells + PageGrid::kLog2LatticePerCell + lattice - base());
    const double perStep = std::ldexp(1.0, -log2Steps), reach = margin / grid_.edgeCells();
    const BoxOverlap overlap(
        {glm::dvec3(corner[0]) * perStep, glm::dvec3(corner[1]) * perStep, glm::dvec3(corner[2]) * perStep});
    // The triangle's bounds choose the pages; where they leave more than one, it may still miss some.
    const auto visitRange = [&](const auto& self, uint32_t level, uint32_t above, glm::u32vec3 first,
                                glm::u32vec3 last) -> void {
        const double edge = std::ldexp(1.0, -int(level - base()));
        for (uint32_t z = first.z; z <= last.z; ++z)
            for (uint32_t y = first.y; y <= last.y; ++y)
                for (uint32_t x = first.x; x <= last.x; ++x) {
                    const glm::u32vec3 at(x, y, z);
                    const glm::dvec3 low = glm::dvec3(at) * edge, high = low + edge;
                    const bool isWithin = glm::all(glm::lessThanEqual(low, overlap.lower())) &&
                                          glm::all(glm::lessThanEqual(overlap.upper(), high));
                    if (!isWithin && !overlap.test((low + high) / 2.0, (0.5 + reach) * edge)) continue;
                    const uint64_t code = mortonEncode(at);
                    const uint32_t number = level == base() ? numberOf(code) : parts_[above][code & 7];
                    if (number == kWhole) {
                        visit(level, code);
                        continue;
                    }
                    const glm::dvec3 middle = (low + high) / 2.0;
                    const double wide = reach * edge / 2 + 1e-9;
                    self(self, level + 1, number,
                         at * 2u + glm::u32vec3(glm::greaterThan(overlap.lower() - wide, middle)),
                         at * 2u + glm::u32vec3(glm::greaterThanEqual(overlap.upper() + wide, middle)));
                }
    };
    const glm::dvec3 from = overlap.lower() - reach - 1e-9, to = overlap.upper() + reach + 1e-9;
    visitRange(visitRange, base(), kWhole, glm::u32vec3(glm::max(glm::i32vec3(glm::floor(from)), 0)),
               glm::u32vec3(glm::min(glm::i32vec3(glm::floor(to)), grid_.lastPage())));
}

}  // namespace vcp
