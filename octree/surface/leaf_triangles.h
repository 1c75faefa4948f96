// Finds which triangles each hard leaf of a page holds: all that touch it. The triangles and the nodes alone decide it,
// in integers, so that a page need not store the lists.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/surface/leaf_math.h"

namespace vcp {

/// 2^kCellShift steps of the lattice are a cell.
inline constexpr int kCellShift = std::countr_zero(unsigned(kLatticePerCell));

/// Returns the octants of a cube that closed bounds touch, as bits: octant x + 2 y + 4 z. `middle`: the cube's.
inline uint32_t octantsTouched(glm::i32vec3 low, glm::i32vec3 high, glm::i32vec3 middle) {
    // Products, since none of these can be foretold: branches would be slow.
    const uint32_t x = uint32_t{low.x <= middle.x} * 0x55u | uint32_t{high.x >= middle.x} * 0xaau;
    const uint32_t y = uint32_t{low.y <= middle.y} * 0x33u | uint32_t{high.y >= middle.y} * 0xccu;
    const uint32_t z = uint32_t{low.z <= middle.z} * 0x0fu | uint32_t{high.z >= middle.z} * 0xf0u;
    return x & y & z;
}

/// Exact overlap of a closed triangle with closed cubes whose bounding boxes overlap its own: the separating axis
/// test (Akenine-Moller 2001).
class CubeTest {
public:
    explicit CubeTest(const std::array<glm::i32vec3, 3>& triangle) : corners_(triangle) {}
    [[nodiscard]] bool touches(glm::i32vec3 lower, int edge);
    /// Returns which of some octants of a cube the triangle touches, as bits. `half`: an octant's edge. `among`: those
    /// that the triangle's bounds touch.
    [[nodiscard]] uint32_t touchedOctants(glm::i32vec3 middle, int half, uint32_t among);

private:
    void prepare();

    static constexpr int kAxes = 9;
    std::array<glm::i32vec3, 3> corners_;
    glm::i64vec3 normal_;
    int64_t offset_, normalSize_;
    bool prepared_ = false;  ///< some corner is in the cube, so the other tests are not needed
    // Products with the nine axes e x (x, y, z), doubled: all values are integers below 2^53, so doubles are exact.
    double along_[3][kAxes], least_[kAxes], most_[kAxes], size_[kAxes];
};

/// Longest edge of a triangle in a page, along an axis: 256 cells. The limit keeps products within 64 bits.
inline constexpr int kMaxEdgeSteps = 256 * kLatticePerCell;

/// The nodes of a page, to find places in. Lattice coordinates count from the page's lowest corner.
class NodePlaces {
public:
    /// `nodes`: node words whose internal nodes form a tree (groups after their parents' groups). They must
    /// outlive this.
    NodePlaces(uint32_t root, std::span<const uint32_t> nodes, uint32_t log2Cells);

    /// Returns the type of the leaf at a point; points outside the page are in kNodeEmpty.
    [[nodiscard]] uint32_t typeAt(glm::i32vec3 point) const;

    /// Calls `found(node word)` for every hard leaf that the closed triangle touches, in a fixed order. Returns
    /// the number of nodes looked at. Coordinates must be below 2^20 + 2^18 and edges at most kMaxEdgeSteps along
    /// each axis.
    template <class Found>
    uint64_t hardLeavesOf(const std::array<glm::i32vec3, 3>& triangle, Found&& found) const;

    /// Returns the number of cells that the closed box around a triangle touches: hardLeavesOf looks at one node in
    /// each, and in a cell that is divided at no more than mostNodesInCell() others.
    [[nodiscard]] uint64_t cellsAround(const std::array<glm::i32vec3, 3>& triangle) const {
        return CellRange(*this, triangle).size();
    }
    [[nodiscard]] uint64_t mostNodesInCell() const;

private:
    /// The cells that the closed box around a triangle touches.
    struct CellRange {
        CellRange(const NodePlaces& places, const std::array<glm::i32vec3, 3>& t) {
            for (int i = 0; i < 3; ++i) {
                low[i] = std::min(t[0][i], std::min(t[1][i], t[2][i]));
                high[i] = std::max(t[0][i], std::max(t[1][i], t[2][i]));
                first[i] = std::max((low[i] - 1) >> kCellShift, 0);
                last[i] = std::min(high[i] >> kCellShift, places.cells_ - 1);
            }
        }
        [[nodiscard]] uint64_t size() const {
            uint64_t cells = 1;
            for (int i = 0; i < 3; ++i) cells *= uint64_t(std::max(last[i] - first[i] + 1, 0));
            return cells;
        }
        glm::i32vec3 low, high;    ///< of the box, in steps of the lattice
        glm::i32vec3 first, last;  ///< cells
    };

    [[nodiscard]] uint64_t nodesIn(uint32_t word) const;
    void fillCells(uint32_t word, glm::i32vec3 lower, uint32_t log2Edge);
    [[nodiscard]] size_t cell(int x, int y, int z) const {
        return size_t(x + (y << log2Cells_)) + (size_t(z) << (2 * log2Cells_));
    }
    template <class Found>
    uint64_t withinCell(CubeTest& test, glm::i32vec3 low, glm::i32vec3 high, uint32_t word, glm::i32vec3 lower,
                        Found&& found) const;

    std::span<const uint32_t> nodes_;
    int cells_, log2Cells_;
    // By cell: the leaf that covers it or its internal node, and the binary logarithm of that node's edge in cells.
    std::vector<uint32_t> word_;
    std::vector<uint8_t> size_;
};

template <class Found>
uint64_t NodePlaces::hardLeavesOf(const std::array<glm::i32vec3, 3>& t, Found&& found) const {
    const auto [low, high, first, last] = CellRange(*this, t);
    CubeTest test(t);
    uint64_t visits = 1;
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) {
                ++visits;
                const uint32_t word = word_[cell(x, y, z)], type = nodeType(word);
                if (type == kNodeHard) {
                    // A leaf larger than a cell is looked at only in the first of its cells that comes up.
                    const int size = size_[cell(x, y, z)], rest = (1 << size) - 1;
                    if ((x > first.x && (x & rest) != 0) || (y > first.y && (y & rest) != 0) ||
                        (z > first.z && (z & rest) != 0))
                        continue;
                    if (test.touches(kLatticePerCell * glm::i32vec3(x & ~rest, y & ~rest, z & ~rest),
                                     kLatticePerCell << size))
                        found(word);
                } else if (type == kNodeInternal) {
                    visits += withinCell(test, low, high, word, kLatticePerCell * glm::i32vec3(x, y, z), found);
                }
            }
    return visits;
}

template <class Found>
uint64_t NodePlaces::withinCell(CubeTest& test, glm::i32vec3 low, glm::i32vec3 high, uint32_t top, glm::i32vec3 corner,
                                Found&& found) const {
    struct Visit {
        uint32_t word;
        int edge;
        glm::i32vec3 lower;
    };
    Visit stack[7 * kMaxSubcellDepth + 1];
    int waiting = 0;
    uint64_t visits = 0;
    stack[waiting++] = {top, kLatticePerCell, corner};
    while (waiting > 0) {
        const Visit v = stack[--waiting];
        ++visits;
        if (nodeType(v.word) == kNodeHard) {
            if (test.touches(v.lower, v.edge)) found(v.word);
            continue;
        }
        if (nodeType(v.word) != kNodeInternal) continue;
        const uint32_t group = v.word & kNodePayloadMask;
        const int half = v.edge / 2;
        for (uint32_t octants = octantsTouched(low, high, v.lower + half); octants != 0; octants &= octants - 1) {
            const int o = std::countr_zero(octants);
            stack[waiting++] = {nodes_[size_t{8} * group + uint32_t(o)], half,
                                v.lower + half * glm::i32vec3(o & 1, o >> 1 & 1, o >> 2)};
        }
    }
    return visits;
}

}  // namespace vcp
