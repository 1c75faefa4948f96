// Surfaces given by a formula, for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace vcp::test {

/// A surface with a signed distance, in world space.
struct SignedDistance {
    double distance = 0;    ///< negative inside
    glm::dvec3 outward{0};  ///< unit gradient of the distance
};
using SignedDistanceField = std::function<SignedDistance(glm::dvec3)>;

inline SignedDistanceField sphere(glm::dvec3 centre, double radius) {
    return [=](glm::dvec3 p) -> SignedDistance {
        const glm::dvec3 v = p - centre;
        const double r = glm::length(v);
        return {r - radius, r > 0 ? v / r : glm::dvec3(0, 0, 1)};
    };
}

/// `normal` of length 1; inside is where dot(p, normal) < offset.
inline SignedDistanceField plane(glm::dvec3 normal, double offset) {
    return [=](glm::dvec3 p) -> SignedDistance { return {glm::dot(p, normal) - offset, normal}; };
}

inline SignedDistanceField torus(glm::dvec3 centre, double ring, double tube) {
    return [=](glm::dvec3 p) -> SignedDistance {
        const glm::dvec3 v = p - centre;
        const double around = std::max(std::hypot(v.x, v.y), 1e-12);
        const glm::dvec3 spine = glm::dvec3(v.x, v.y, 0) * (ring / around);
        const double r = std::max(glm::length(v - spine), 1e-12);
        return {r - tube, (v - spine) / r};
    };
}

}  // namespace vcp::test
