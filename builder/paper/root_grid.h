// The grid that octrees over their corners are built over, and a ray in its coordinates.
//
// Grid space: the unit is a finest cell, the origin the grid's lowest corner.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

namespace vcp {

/// A dense grid of root nodes, each 2^rootLevel finest cells an edge.
struct RootGrid {
    glm::dvec3 low{0};  ///< world
    double cell = 1;    ///< edge of a finest cell, world units
    int rootLevel = 0;
    glm::ivec3 roots{1};

    static constexpr int kRootsAcross = 16;
    static constexpr int kMaxCells = 1 << 20;

    [[nodiscard]] glm::ivec3 cells() const { return roots * (1 << rootLevel); }
    [[nodiscard]] glm::dvec3 gridFromWorld(glm::dvec3 p) const { return (p - low) / cell; }
    [[nodiscard]] glm::dvec3 worldFromGrid(glm::dvec3 p) const { return low + cell * p; }
    [[nodiscard]] int rootIndex(glm::ivec3 c) const {
        return ((c.z >> rootLevel) * roots.y + (c.y >> rootLevel)) * roots.x + (c.x >> rootLevel);
    }

    /// Makes a grid about the middle of a box, with at least `margin` cells around it. Precondition: the box is at most
    /// kMaxCells / 2 cells across.
    static RootGrid around(glm::dvec3 boxLow, glm::dvec3 boxHigh, double cell, int margin) {
        const glm::dvec3 wanted = (boxHigh - boxLow) / cell + 2.0 * margin;
        const double longest = std::max({wanted.x, wanted.y, wanted.z, 1.0});
        return around(boxLow, boxHigh, cell, margin, std::max(2, int(std::ceil(std::log2(longest / kRootsAcross)))));
    }
    /// Does so with roots of a given size.
    static RootGrid around(glm::dvec3 boxLow, glm::dvec3 boxHigh, double cell, int margin, int rootLevel) {
        RootGrid frame;
        frame.cell = cell;
        frame.rootLevel = rootLevel;
        const glm::dvec3 wanted = (boxHigh - boxLow) / cell + 2.0 * margin;
        frame.roots = glm::max(glm::ivec3(glm::ceil(wanted / double(1 << frame.rootLevel))), glm::ivec3(1));
        frame.low = 0.5 * (boxLow + boxHigh) - 0.5 * cell * glm::dvec3(frame.cells());
        return frame;
    }
};

/// A ray in grid space. `t` counts cells from `origin`, which lies in the grid.
struct GridRay {
    glm::vec3 origin, direction, inverse;
    float tMax = -1;    ///< where the ray leaves the grid; negative: it never enters
    double tStart = 0;  ///< cells from the eye to the origin
};

/// A peer's answer: t is infinite for a miss, not a number where it gave up; the normal need not be a unit vector.
struct GridHit {
    float t = std::numeric_limits<float>::infinity();
    glm::vec3 normal{0};
};

}  // namespace vcp
