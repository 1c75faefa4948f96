// Which triangles each hard leaf of a page holds: all that touch it. Found from the triangles and the nodes
// alone, in integers, so that a page need not store the lists.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/leaf_math.h"

namespace vcp {

/// Steps of the lattice in the smallest leaf's edge.
inline constexpr int kSubcellSteps = kLatticePerCell >> kMaxSubcellDepth;

/// Longest edge of a triangle in a page, along an axis: 256 cells. Keeps products within 64 bits.
inline constexpr int kMaxEdgeSteps = 256 * kLatticePerCell;

/// The nodes of a page to find places in; lattice coordinates from the page's lowest corner.
class NodePlaces {
public:
    /// `nodes`: node words whose internal nodes form a tree (groups after their parents' groups). They must
    /// outlive this.
    NodePlaces(uint32_t root, std::span<const uint32_t> nodes, uint32_t log2Cells);

    /// Type of the leaf at a point; points outside the page are in kNodeEmpty.
    [[nodiscard]] uint32_t typeAt(glm::i32vec3 point) const;

    /// Calls `found(node word)` for every hard leaf that the closed triangle touches, in a fixed order. Returns
    /// the number of nodes looked at. Coordinates must be below 2^20 + 2^18 and edges at
    /// most kMaxEdgeSteps along each axis.
    template <class Found>
    uint64_t hardLeavesOf(const std::array<glm::i32vec3, 3>& triangle, Found&& found) const;

    [[nodiscard]] int edge() const { return edge_; }

private:
    uint32_t root_;
    std::span<const uint32_t> nodes_;
    int edge_;                        ///< of the page
    std::vector<uint8_t> hardBelow_;  ///< by group: bit i: child i is hard or leads to a hard leaf
};

/// Exact overlap of closed triangle and closed cube, whose bounding boxes overlap: the separating axis test
/// (Akenine-Moller 2001).
bool triangleTouchesCube(const std::array<glm::i32vec3, 3>& triangle, glm::i32vec3 lower, int edge);

template <class Found>
uint64_t NodePlaces::hardLeavesOf(const std::array<glm::i32vec3, 3>& t, Found&& found) const {
    struct Visit {
        uint32_t word;
        int edge;
        glm::i32vec3 lower;
    };
    const auto least = [&](int i) { return std::min(t[0][i], std::min(t[1][i], t[2][i])); };
    const auto most = [&](int i) { return std::max(t[0][i], std::max(t[1][i], t[2][i])); };
    const glm::i32vec3 low(least(0), least(1), least(2)), high(most(0), most(1), most(2));
    for (int i = 0; i < 3; ++i)
        if (low[i] > edge_ || high[i] < 0) return 1;
    // Eight children a level at most wait; pages have at most 10 levels.
    Visit stack[96];
    int top = 0;
    uint64_t visits = 0;
    stack[top++] = {root_, edge_, glm::i32vec3(0)};
    while (top > 0) {
        const Visit v = stack[--top];
        ++visits;
        if (v.word >> kNodeTypeShift == kNodeHard) {
            if (triangleTouchesCube(t, v.lower, v.edge)) found(v.word);
            continue;
        }
        if (v.word >> kNodeTypeShift != kNodeInternal) continue;
        const uint32_t group = v.word & kNodePayloadMask;
        const int half = v.edge / 2;
        const glm::i32vec3 middle = v.lower + half;
        // Octants whose boxes the bounding box touches, as bits: x and then 2 y and 4 z.
        const uint32_t x = (low.x <= middle.x ? 0x55u : 0u) | (high.x >= middle.x ? 0xaau : 0u);
        const uint32_t y = (low.y <= middle.y ? 0x33u : 0u) | (high.y >= middle.y ? 0xccu : 0u);
        const uint32_t z = (low.z <= middle.z ? 0x0fu : 0u) | (high.z >= middle.z ? 0xf0u : 0u);
        for (uint32_t octants = x & y & z & hardBelow_[group]; octants != 0; octants &= octants - 1) {
            const int o = std::countr_zero(octants);
            stack[top++] = {nodes_[8 * group + static_cast<uint32_t>(o)], half, v.lower + half * glm::i32vec3(o & 1, o >> 1 & 1, o >> 2)};
        }
    }
    return visits;
}

}  // namespace vcp
