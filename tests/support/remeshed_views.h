// Cameras that surfaces are remeshed for, and whether what comes of it is closed.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <glm/geometric.hpp>

#include "mesostructure/remesh/remesher.h"

namespace vcp::meso::test {

/// A camera that looks at a point, `pixels` high at 60 degrees.
inline RemeshCamera lookFrom(glm::dvec3 eye, glm::dvec3 at, double pixels) {
    RemeshCamera camera;
    camera.eye = eye;
    camera.forward = glm::normalize(at - eye);
    camera.right = glm::normalize(glm::cross(camera.forward, glm::dvec3(0.1, 0.2, 1)));
    camera.up = glm::cross(camera.right, camera.forward);
    const double tangent = std::tan(0.5);
    camera.focal = pixels / 2 / tangent;
    camera.seen = {-tangent, -tangent, tangent, tangent};
    camera.nearest = 1e-3;
    return camera;
}

/// Counts the directed edges, by the bits of their ends' positions, that no triangle has the other way.
template <class Real>
uint64_t openEdges(const RemeshMesh<Real>& mesh) {
    using Place = std::array<Real, 3>;
    std::map<std::pair<Place, Place>, int> uses;
    for (size_t i = 0; i < mesh.indices.size(); i += 3)
        for (int k = 0; k < 3; ++k) {
            const auto placeOf = [&](size_t corner) {
                const auto& p = mesh.vertices[mesh.indices[corner]].position;
                return Place{p.x + Real(0), p.y + Real(0), p.z + Real(0)};
            };
            const Place from = placeOf(i + k), to = placeOf(i + (k + 1) % 3);
            if (from == to) continue;
            if (from < to)
                ++uses[{from, to}];
            else
                --uses[{to, from}];
        }
    return uint64_t(std::ranges::count_if(uses, [](const auto& use) { return use.second != 0; }));
}

}  // namespace vcp::meso::test
