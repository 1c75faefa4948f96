// The grid that the peers' octrees are built over, and the camera's rays in its coordinates.
//
// Grid space: the unit is a finest cell, the origin the grid's lowest corner. Set-up of a ray is in double, what
// follows it in single precision: the ray starts where it enters the grid, so that a far eye costs no accuracy.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/camera.h"

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

    /// About the middle of a box, with at least `margin` cells around it. Precondition: the box is at most
    /// kMaxCells / 2 cells across.
    static RootGrid around(glm::dvec3 boxLow, glm::dvec3 boxHigh, double cell, int margin) {
        RootGrid frame;
        frame.cell = cell;
        const glm::dvec3 wanted = (boxHigh - boxLow) / cell + 2.0 * margin;
        const double longest = std::max({wanted.x, wanted.y, wanted.z, 1.0});
        frame.rootLevel = std::max(2, static_cast<int>(std::ceil(std::log2(longest / kRootsAcross))));
        frame.roots = glm::max(glm::ivec3(glm::ceil(wanted / double(1 << frame.rootLevel))), glm::ivec3(1));
        frame.low = 0.5 * (boxLow + boxHigh) - 0.5 * cell * glm::dvec3(frame.cells());
        return frame;
    }
};

/// Grid space. `t` counts cells from `origin`, which lies in the grid.
struct GridRay {
    glm::vec3 origin, direction, inverse;
    float tMax = -1;    ///< where the ray leaves the grid; negative: it never enters
    double tStart = 0;  ///< cells from the eye to the origin
};

/// What a peer answers: t infinite for a miss, not a number where it gave up; the normal need not be a unit vector.
struct GridHit {
    float t = std::numeric_limits<float>::infinity();
    glm::vec3 normal{0};
};

/// A perspective camera's rays through a frame.
class GridRays {
public:
    GridRays(const Camera& camera, glm::ivec2 size, const RootGrid& frame) : high_(frame.cells()) {
        const CameraBasis b = cameraBasis(camera, static_cast<uint32_t>(size.x), static_cast<uint32_t>(size.y));
        eye_ = frame.gridFromWorld(camera.eye);
        perX_ = b.right * (2 * b.halfWidth / size.x);
        perY_ = b.up * (-2 * b.halfHeight / size.y);
        corner_ = b.forward - b.right * b.halfWidth + b.up * b.halfHeight + 0.5 * perX_ + 0.5 * perY_;
    }

    /// Through the centre of pixel (x, y).
    [[nodiscard]] GridRay ray(int x, int y) const {
        return along(eye_, glm::normalize(corner_ + double(x) * perX_ + double(y) * perY_), high_);
    }

    /// From `eye` along the unit vector `d`, cut to the box from 0 to `high`.
    static GridRay along(glm::dvec3 eye, glm::dvec3 d, glm::dvec3 high) {
        // A direction of zero never divides by it.
        for (int axis = 0; axis < 3; ++axis)
            if (std::abs(d[axis]) < 1e-20) d[axis] = 1e-20;
        const glm::dvec3 inverse = 1.0 / d;
        const glm::dvec3 a = -eye * inverse, b = (high - eye) * inverse;
        const glm::dvec3 near = glm::min(a, b), far = glm::max(a, b);
        const double first = std::max({near.x, near.y, near.z, 0.0}), last = std::min({far.x, far.y, far.z});
        GridRay ray;
        if (!(first < last)) return ray;
        ray.tStart = first;
        ray.origin = glm::vec3(glm::clamp(eye + first * d, glm::dvec3(0), high));
        ray.direction = glm::vec3(d);
        ray.inverse = glm::vec3(inverse);
        ray.tMax = static_cast<float>(last - first);
        return ray;
    }

private:
    glm::dvec3 high_, eye_, corner_, perX_, perY_;
};

}  // namespace vcp
