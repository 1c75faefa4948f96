// What a mesostructure is before any method stores it: a height field, a solid given by a formula, or a closed mesh.
//
// A Shape answers in double precision and says what a picture must show; methods are built from it and judged against
// it. Positions are in tile space (mesostructure/tile_grid.h), in any tile. Any thread may call const functions.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/height_texels.h"
#include "mesostructure/tile_grid.h"
#include "octree/io/result.h"

namespace vcp::meso {

struct TruthHit {
    bool hit = false;
    bool resolved = true;  ///< false: the search was given up (grazing a solid for long)
    double t = 0;          ///< along the ray, tile units
    glm::dvec3 normal{0};  ///< unit, out of the solid
};

class Shape {
public:
    explicit Shape(glm::dvec3 extent) : extent_(extent) {}
    virtual ~Shape() = default;

    [[nodiscard]] glm::dvec3 extent() const { return extent_; }
    /// A value above 0 outside, below 0 inside, 0 on the surface; its size is at most the distance to the surface.
    [[nodiscard]] virtual double field(glm::dvec3 point) const = 0;
    /// The distance to the surface, at most `cap`; for height fields and meshes up to a quarter of a texel above it.
    [[nodiscard]] virtual double distance(glm::dvec3 point, double cap) const = 0;
    /// Whether the surface may touch the closed box; never false where it does.
    [[nodiscard]] virtual bool mayTouch(glm::dvec3 lower, glm::dvec3 upper) const = 0;
    /// Returns the first crossing from outside to inside at 0 <= t <= tMax; the direction is a unit vector.
    [[nodiscard]] virtual TruthHit trace(glm::dvec3 origin, glm::dvec3 direction, double tMax) const = 0;

    /// Returns the gradient of the field by differences over `step` to either side, as a unit vector; 0 where it is 0.
    [[nodiscard]] glm::dvec3 normal(glm::dvec3 point, glm::dvec3 step) const {
        glm::dvec3 gradient(0);
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 off(0);
            off[axis] = step[axis];
            gradient[axis] = (field(point + off) - field(point - off)) / step[axis];
        }
        const double size = glm::length(gradient);
        return size > 0 ? gradient / size : glm::dvec3(0);
    }

private:
    glm::dvec3 extent_;
};

/// Most texels along an edge of a height map. Rays are marched over maps of kMaxGridEdge; larger ones are remeshed.
inline constexpr int kMaxMapEdge = 16384;

/// Heights on a grid of texels, periodic, bilinear between them. Texel (i, j) lies at the grid point (i, j) / size, and
/// its height is value / 65535 * range.
struct HeightMap {
    glm::ivec2 size{0};
    double range = 0;  ///< height of 65535, tile units; the slab's extent along z
    HeightTexels texels;

    [[nodiscard]] uint16_t texel(int x, int y) const {
        return texels[size_t(wrapped(x, size.x)) + size_t(size.x) * size_t(wrapped(y, size.y))];
    }
    [[nodiscard]] double height(int x, int y) const { return texel(x, y) * (range / 65535.0); }
    [[nodiscard]] glm::dvec3 extent() const { return {1.0, double(size.y) / double(size.x), range}; }
};

using TileTriangle = std::array<glm::dvec3, 3>;  ///< tile space; it may reach into neighbouring tiles

/// Errors of all three functions: InvalidInput, without a file; Limit for a height map of more than kMaxGridEdge texels
/// along an edge. The height map must outlive its shape.
Result<std::unique_ptr<Shape>> heightShape(const HeightMap& map);
/// mesostructure/solids.h lists the names.
Result<std::unique_ptr<Shape>> solidShape(const std::string& name, uint32_t seed);
/// The repeated triangles must enclose solids: lines enter them as often as they leave them, which is checked with a
/// few thousand lines (nonzero winding along the vertical counts as inside, so parts may overlap). Normals point
/// outwards by the right-hand rule.
Result<std::unique_ptr<Shape>> meshShape(const std::vector<TileTriangle>& triangles, glm::dvec3 extent);

}  // namespace vcp::meso
