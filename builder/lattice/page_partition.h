// How the pages of a level are dealt into bins that fit memory: runs of the Morton curve.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "builder/lattice/triangle_geometry.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/morton.h"

namespace vcp {

/// The grid of pages of one level: 2^level pages an axis, 2^log2Cells cells an edge.
struct PageGrid {
    uint32_t log2Cells = 5;
    uint32_t level = 0;

    [[nodiscard]] int lastPage() const { return (1 << level) - 1; }
    [[nodiscard]] double edgeCells() const { return double(1u << log2Cells); }
    /// Returns the Morton code of the page that a lattice point lies in.
    [[nodiscard]] uint64_t pageOf(glm::i32vec3 p) const {
        const glm::i32vec3 page = glm::min(p >> int(log2Cells + kLog2LatticePerCell), lastPage());
        return mortonEncode(glm::u32vec3(page));
    }
    /// Calls visit(Morton code) for every page whose cube, widened by `margin` cells, the triangle overlaps.
    template <class Visit>
    void forPagesNear(const glm::i32vec3 (&corner)[3], double margin, Visit&& visit) const {
        const double steps = double(kLatticePerCell);
        const glm::i32vec3 low = glm::min(corner[0], glm::min(corner[1], corner[2])),
                           high = glm::max(corner[0], glm::max(corner[1], corner[2]));
        // Touching counts, so the bounds are widened a little.
        const glm::dvec3 from = (glm::dvec3(low) / steps - margin) / edgeCells() - 1e-9,
                         to = (glm::dvec3(high) / steps + margin) / edgeCells() + 1e-9;
        const glm::i32vec3 first = glm::max(glm::i32vec3(glm::floor(from)), 0),
                           last = glm::min(glm::i32vec3(glm::floor(to)), lastPage());
        if (first == last) return visit(mortonEncode(glm::u32vec3(first)));
        const BoxOverlap overlap(
            {glm::dvec3(corner[0]) / steps, glm::dvec3(corner[1]) / steps, glm::dvec3(corner[2]) / steps});
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    if (overlap.test((glm::dvec3(x, y, z) + 0.5) * edgeCells(), edgeCells() / 2 + margin))
                        visit(mortonEncode(glm::u32vec3(x, y, z)));
    }

    static constexpr uint32_t kLog2LatticePerCell = 11;
    static_assert(1 << kLog2LatticePerCell == kLatticePerCell);
};

/// Bins are the runs between `first` codes; a page belongs to the last bin that begins at or before it.
class PagePartition {
public:
    /// Makes a single bin.
    PagePartition() : first_{0} {}
    /// `first`: ascending codes, from 0.
    explicit PagePartition(std::vector<uint64_t> first) : first_(std::move(first)) {}
    /// Makes as few bins as hold at most `limit` each; a single page may have more. `pages`: ascending (code, count).
    PagePartition(const std::vector<std::pair<uint64_t, uint64_t>>& pages, uint64_t limit) : first_{0} {
        uint64_t held = 0;
        for (const auto& [page, count] : pages) {
            if (held > 0 && held + count > limit) {
                first_.push_back(page);
                held = 0;
            }
            held += count;
        }
    }

    [[nodiscard]] size_t bins() const { return first_.size(); }
    [[nodiscard]] const std::vector<uint64_t>& first() const { return first_; }
    [[nodiscard]] size_t binOf(uint64_t page) const {
        return size_t(std::upper_bound(first_.begin(), first_.end(), page) - first_.begin()) - 1;
    }
    /// Returns the same bins on the next coarser level.
    [[nodiscard]] PagePartition coarser() const {
        std::vector<uint64_t> first{0};
        for (const uint64_t code : first_)
            if (code >> 3 > first.back()) first.push_back(code >> 3);
        return PagePartition(std::move(first));
    }

private:
    std::vector<uint64_t> first_;
};

}  // namespace vcp
