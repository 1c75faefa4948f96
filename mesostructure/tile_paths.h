// A path tracer on a tile (Kajiya 1986): what light that comes from above does between the walls of a mesostructure.
//
// The solid repeats along x and y and stands on the closed bottom of its slab; all of it is matt and gives back one
// part of the light that it gets, its albedo. A path is followed backwards, from a point of the surface to where it
// leaves the slab by the top: the light that falls in from there, times the path's weight, arrives at the point. Double
// precision; the same random numbers give the same bits. Any thread may call const functions.
#pragma once

#include <cstdint>
#include <functional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/shape.h"

namespace vcp::meso {

/// Random numbers from a seed (splitmix64, Steele et al. 2014).
class PathRandom {
public:
    explicit PathRandom(uint64_t seed) : state_(seed) {}
    /// Returns the next one, from 0 to below 1.
    double next();
    /// Returns a seed that depends on all of two numbers.
    static uint64_t mixed(uint64_t seed, uint64_t number);

private:
    uint64_t state_;
};

/// A place on the surface, tile space, and its unit normal.
struct TilePoint {
    glm::dvec3 at{0}, normal{0, 0, 1};
};

/// Where a ray ends: on the surface, or beyond the slab's top.
struct TileMeeting {
    enum class Kind { Surface, Sky, Unresolved } kind = Kind::Unresolved;
    TilePoint point;  ///< of the surface
};

/// Where a path leaves the slab, and what part of the light from there arrives at its start; 0 where it ended before.
struct TileEscape {
    glm::dvec3 direction{0, 0, 1};
    double weight = 0;
};

/// Returns the i-th point of a sequence that fills the unit square evenly (Roberts 2018).
glm::dvec2 evenPoint(uint64_t i);
/// Turns a point of the unit square to a direction about n, distributed by the cosine (Duff et al. 2017).
glm::dvec3 directionByCosine(glm::dvec3 n, glm::dvec2 p);
/// Returns the unit vector of axes about n in which z is n.
glm::dvec3 turnedFromZ(glm::dvec3 n, glm::dvec3 local);

/// Follows a path from a point on, and about further points by their cosine. After a few of them it goes on by chance,
/// with the albedo as its chance, so its mean has no bias (Russian roulette, Arvo and Kirk 1990). `meet`: what the ray
/// from a point meets.
TileEscape followPath(const std::function<TileMeeting(const TilePoint& from, glm::dvec3 direction)>& meet,
                      double albedo, TilePoint from, glm::dvec3 direction, PathRandom& random);

class TilePaths {
public:
    /// `shape` must outlive this. `albedo`: from 0 to 1.
    TilePaths(const Shape& shape, double albedo) : shape_(shape), albedo_(albedo) {}

    [[nodiscard]] const Shape& shape() const { return shape_; }
    [[nodiscard]] double albedo() const { return albedo_; }

    /// Follows a ray from a place outside of the solid, at most `reach` far.
    [[nodiscard]] TileMeeting meet(glm::dvec3 from, glm::dvec3 direction, double reach) const;
    /// Returns where a ray against `view` first meets the surface; it enters the slab's top at `place`, tile units.
    [[nodiscard]] TileMeeting see(glm::dvec3 view, glm::dvec2 place) const;
    /// As followPath.
    [[nodiscard]] TileEscape follow(TilePoint from, glm::dvec3 direction, PathRandom& random) const;

    /// Returns the light that arrives at a point, over what a white, flat, open one gets under light of radiance 1 from
    /// everywhere: the mean over `paths` paths of radiance. `radiance`: by the direction that the light comes from.
    [[nodiscard]] glm::dvec3 lightAt(const TilePoint& point, const std::function<glm::dvec3(glm::dvec3)>& radiance,
                                     uint32_t paths, uint64_t seed) const;

private:
    const Shape& shape_;
    double albedo_;
};

}  // namespace vcp::meso
