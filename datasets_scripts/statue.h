// The procedural statue: a winged, robed figure on a plinth, as parametric parts.
//
// Metres, y up, facing +z, about 2.8 m high. Parts interpenetrate, as pieces of a scan do.
// Closed parts are watertight once tessellated; the shawl, the second scan passes and the ribbon have borders.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp::scan {

/// A point of a part. `colour` is linear in [0, 1].
struct SurfacePoint {
    glm::dvec3 position;
    glm::dvec3 colour;
};

enum class Topology {
    Capped,  ///< u wraps, v ends in two poles: closed
    Torus,   ///< u and v wrap: closed
    Sheet,   ///< neither wraps: four borders, and holes
    Strip,   ///< one row of triangles between v = 0 and v = 1: takes any number of them
};

/// An ellipse of the (u, v) square without triangles.
struct Hole {
    double u, v, radiusU, radiusV;
};

struct Part {
    std::string name;
    Topology topology = Topology::Capped;
    double weight = 0;                                      ///< share of the triangles
    double aspect = 1;                                      ///< columns (u) for each row (v)
    std::function<SurfacePoint(double u, double v)> shape;  ///< u, v in [0, 1]; pure
    std::vector<Hole> holes = {};

    [[nodiscard]] bool closed() const { return topology == Topology::Capped || topology == Topology::Torus; }
};

/// The parts in the order in which they are written; the last is the one Strip. Weights add up to 1.
/// `edge`: expected length of a triangle's edge in metres; detail finer than that is left out.
std::vector<Part> statue(uint64_t seed, double edge);

}  // namespace vcp::scan
