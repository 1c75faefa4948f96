// A ray among the cells of a grid, in the grid's own units and single precision; t stays in tile units.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/march.h"

namespace vcp::meso {

inline constexpr float kFar = 1e30f;  ///< in place of a wall that a parallel ray never meets

/// Moves the origin into the tile at 0, exactly: rays of far tiles lose no precision to their place.
inline glm::dvec3 inFirstTile(glm::dvec3 origin, glm::dvec3 extent) {
    origin.x -= extent.x * std::floor(origin.x / extent.x);
    origin.y -= extent.y * std::floor(origin.y / extent.y);
    return origin;
}

struct GridWalk {
    glm::vec3 o, d, inverse;  ///< in cells; 1 / d, where d is not 0
    float t = 0, tMax = 0;
    glm::ivec3 cell;
    glm::ivec3 sign;  ///< +1, -1 or 0
    bool startsAtTop = false;

    GridWalk(const MarchRay& ray, const TileGrid& grid) {
        const glm::dvec3 origin = inFirstTile(ray.origin, grid.extent()) / grid.cell,
                         direction = ray.direction / grid.cell;
        o = glm::vec3(origin), d = glm::vec3(direction);
        tMax = float(std::min(ray.tMax, 1e6));
        startsAtTop = origin.z >= grid.cells.z && d.z < 0;
        for (int axis = 0; axis < 3; ++axis) {
            sign[axis] = (d[axis] > 0) - (d[axis] < 0);
            inverse[axis] = sign[axis] != 0 ? 1 / d[axis] : 0;
            cell[axis] = int(std::floor(o[axis]));
            // On a wall, the cell is the one that the ray enters.
            if (sign[axis] < 0 && o[axis] == std::floor(o[axis])) --cell[axis];
        }
    }

    [[nodiscard]] glm::vec3 at(float time) const { return o + time * d; }
    [[nodiscard]] float wall(int axis, int coordinate) const { return (float(coordinate) - o[axis]) * inverse[axis]; }
    /// Returns when the ray comes through the walls of the cell that it is in.
    [[nodiscard]] float entry() const {
        float latest = 0;
        for (int axis = 0; axis < 3; ++axis)
            if (sign[axis] != 0) latest = std::max(latest, wall(axis, cell[axis] + (sign[axis] < 0)));
        return latest;
    }
    /// Returns when it leaves a box of `further` more cells, and by which axis; tMax where it never does.
    [[nodiscard]] float exit(glm::ivec3 further, int& axisOut) const {
        float first = kFar;
        for (int axis = 0; axis < 3; ++axis) {
            if (sign[axis] == 0) continue;
            const float time = wall(axis, sign[axis] > 0 ? cell[axis] + further[axis] + 1 : cell[axis] - further[axis]);
            if (time < first) first = time, axisOut = axis;
        }
        return first;
    }
    /// Leaves the box by whole cells along the axis of its exit; along the others it stays within the box.
    void leave(glm::ivec3 further, float time, int axisOut) {
        t = std::max(t, time);
        const glm::vec3 p = at(t);
        for (int axis = 0; axis < 3; ++axis) {
            if (axis == axisOut)
                cell[axis] += sign[axis] * (further[axis] + 1);
            else if (further[axis] != 0)
                moveTo(axis, p[axis], further[axis]);
        }
    }
    /// Moves to a point of the ray that need not be on a wall.
    void jump(float time) {
        t = time;
        const glm::vec3 p = at(t);
        for (int axis = 0; axis < 3; ++axis) moveTo(axis, p[axis], 1 << 28);
    }

private:
    /// Moves never backwards, and by at most `further` cells.
    void moveTo(int axis, float p, int further) {
        const int target = int(std::floor(p));
        if (sign[axis] > 0) cell[axis] = std::clamp(target, cell[axis], cell[axis] + further);
        if (sign[axis] < 0) cell[axis] = std::clamp(target, cell[axis] - further, cell[axis]);
    }
};

}  // namespace vcp::meso
