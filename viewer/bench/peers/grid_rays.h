// A camera's rays in the coordinates of a root grid.
//
// A ray is set up in double, and what follows is in single precision: the ray starts where it enters the grid, so that
// a far eye costs no accuracy.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/paper/root_grid.h"
#include "render/camera.h"

namespace vcp {

/// A perspective camera's rays through a frame.
class GridRays {
public:
    GridRays(const Camera& camera, glm::ivec2 size, const RootGrid& frame) : high_(frame.cells()) {
        const CameraBasis b = cameraBasis(camera, uint32_t(size.x), uint32_t(size.y));
        eye_ = frame.gridFromWorld(camera.eye);
        perX_ = b.right * (2 * b.halfWidth / size.x);
        perY_ = b.up * (-2 * b.halfHeight / size.y);
        corner_ = b.forward - b.right * b.halfWidth + b.up * b.halfHeight + 0.5 * perX_ + 0.5 * perY_;
    }

    /// Returns the ray through the centre of pixel (x, y).
    [[nodiscard]] GridRay ray(int x, int y) const {
        return along(eye_, glm::normalize(corner_ + double(x) * perX_ + double(y) * perY_), high_);
    }

    /// Returns the ray from `eye` along the unit vector `d`, cut to the box from 0 to `high`.
    static GridRay along(glm::dvec3 eye, glm::dvec3 d, glm::dvec3 high) {
        // A component of zero is never divided by.
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
        ray.tMax = float(last - first);
        return ray;
    }

private:
    glm::dvec3 high_, eye_, corner_, perX_, perY_;
};

}  // namespace vcp
