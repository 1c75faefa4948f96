// How far a remeshed surface is off on the screen, in double precision.
//
// Each triangle is looked at in some places. Where its point is farther than `allowed` from the displaced surface's at
// the same place of the base, the nearest one of the surface around is looked for in the picture, and of the mesh the
// nearest to the surface's point; the farther of the two counts. Where the map jumps along an edge, walls between both
// sides are of the surface.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/remesh/remesher.h"

namespace vcp::meso::test {

using glm::dvec2, glm::dvec3;

inline double distanceToSegment(dvec2 p, dvec2 a, dvec2 b) {
    const dvec2 along = b - a;
    const double square = glm::dot(along, along);
    return glm::distance(p, a + (square > 0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0) * along);
}

inline double cross(dvec2 a, dvec2 b) { return a.x * b.y - a.y * b.x; }

inline double distanceToTriangle(dvec2 p, const std::array<dvec2, 3>& t) {
    const double u = cross(t[1] - t[0], p - t[0]), v = cross(t[2] - t[1], p - t[1]), w = cross(t[0] - t[2], p - t[2]);
    if ((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) return 0;
    return std::min(
        {distanceToSegment(p, t[0], t[1]), distanceToSegment(p, t[1], t[2]), distanceToSegment(p, t[2], t[0])});
}

/// One view's mesh against the displaced surface, which is not cut.
class RemeshErrors {
public:
    RemeshErrors(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshMesh<double>& mesh,
                 double allowed)
        : surface_(surface), camera_(camera), mesh_(mesh), allowed_(allowed) {
        for (const auto& vertex : mesh.vertices) pixels_.push_back(pixel(vertex.position));
    }

    /// Adds the pixels that are off in each place of which either is seen and no nearer than `nearest`.
    void measure(std::vector<float>& errors, double nearest = 0) {
        for (size_t i = 0; i < mesh_.indices.size(); i += 3) {
            const auto corners = cornersOf(i);
            const dvec2 a = corners[1]->uv - corners[0]->uv, b = corners[2]->uv - corners[0]->uv;
            if (std::abs(cross(a, b)) <= 1e-9 * (glm::dot(a, a) + glm::dot(b, b))) continue;  // a line
            for (const dvec3 w : {dvec3(1.0 / 3), dvec3(0.6, 0.2, 0.2), dvec3(0.2, 0.6, 0.2), dvec3(0.2, 0.2, 0.6),
                                  dvec3(0.5, 0.5, 0), dvec3(0, 0.5, 0.5), dvec3(0.5, 0, 0.5)}) {
                const dvec3 on = w.x * corners[0]->position + w.y * corners[1]->position + w.z * corners[2]->position;
                const dvec2 uv = w.x * corners[0]->uv + w.y * corners[1]->uv + w.z * corners[2]->uv;
                const dvec3 there = displaced(corners[0]->triangle, uv);
                if (!isSeen(on, nearest) && !isSeen(there, nearest)) continue;
                double error = glm::distance(pixel(on), pixel(there));
                if (error > allowed_) error = std::max(fromSurface(i, pixel(on), uv), fromMesh(i, pixel(there), uv));
                errors.push_back(float(error));
            }
        }
    }

private:
    using Corners = std::array<const RemeshVertex<double>*, 3>;

    [[nodiscard]] Corners cornersOf(size_t i) const {
        return {&mesh_.vertices[mesh_.indices[i]], &mesh_.vertices[mesh_.indices[i + 1]],
                &mesh_.vertices[mesh_.indices[i + 2]]};
    }
    [[nodiscard]] dvec2 pixel(dvec3 p) const { return camera_.focal * dvec2(p) / (camera_.isParallel ? 1 : p.z); }
    [[nodiscard]] bool isSeen(dvec3 p, double nearest) const {
        if (p.z < std::max(camera_.nearest, nearest)) return false;
        const dvec2 at = pixel(p) / camera_.focal;
        return at.x >= camera_.seen.x && at.y >= camera_.seen.y && at.x <= camera_.seen.z && at.y <= camera_.seen.w;
    }
    [[nodiscard]] dvec3 weights(size_t triangle, dvec2 uv) const {
        const auto& uvs = surface_.uvs[triangle];
        const dvec2 a(uvs[0]), b = dvec2(uvs[1]) - a, c = dvec2(uvs[2]) - a;
        const double area = cross(b, c), y = cross(uv - a, c) / area, z = cross(b, uv - a) / area;
        return {1 - y - z, y, z};
    }
    /// Returns a place of a base triangle, displaced, in eye space.
    [[nodiscard]] dvec3 displaced(size_t triangle, dvec2 uv) const {
        const dvec3 w = weights(triangle, uv);
        dvec3 p = surface_.origin - camera_.eye;
        const double height = surface_.heights->height(0, uv);
        for (int k = 0; k < 3; ++k) {
            const uint32_t corner = surface_.triangles[triangle][size_t(k)];
            p += w[k] * (dvec3(surface_.positions[corner]) + height * dvec3(surface_.directions[corner]));
        }
        return {glm::dot(p, camera_.right), glm::dot(p, camera_.up), glm::dot(p, camera_.forward)};
    }

    /// Returns the distance from a triangle's point to the surface in the picture, of places on the same base triangle
    /// around; where the map jumps, from what lies between the triangle's corners and the surface, too.
    [[nodiscard]] double fromSurface(size_t i, dvec2 on, dvec2 uv) const {
        const auto corners = cornersOf(i);
        const size_t triangle = corners[0]->triangle;
        double best = 1e300;
        dvec2 low(1e300), high(-1e300);
        for (const auto* corner : corners) {
            low = glm::min(low, corner->uv), high = glm::max(high, corner->uv);
            best =
                std::min(best, distanceToSegment(on, pixel(corner->position), pixel(displaced(triangle, corner->uv))));
        }
        dvec2 reach = high - low, middle = uv;
        constexpr int kSteps = 12;
        for (int round = 0; round < 5; ++round, reach *= 2.0 / kSteps) {
            dvec2 nearest = middle;
            for (int y = -kSteps; y <= kSteps; ++y)
                for (int x = -kSteps; x <= kSteps; ++x) {
                    const dvec2 at = middle + reach * dvec2(x, y) / double(kSteps);
                    const dvec3 w = weights(triangle, at);
                    if (std::min({w.x, w.y, w.z}) < 0) continue;
                    const double distance = glm::distance(on, pixel(displaced(triangle, at)));
                    if (distance < best) best = distance, nearest = at;
                }
            middle = nearest;
        }
        return best;
    }

    /// Returns the distance from the surface's point to the mesh in the picture, of triangles around.
    [[nodiscard]] double fromMesh(size_t i, dvec2 there, dvec2 uv) const {
        constexpr size_t kAround = 3 * 600;
        const auto own = cornersOf(i);
        dvec2 size(0);
        for (size_t k = 0; k < 3; ++k) size = glm::max(size, glm::abs(own[k]->uv - own[(k + 1) % 3]->uv));
        double best = 1e300;
        for (size_t j = i > kAround ? i - kAround : 0; j < std::min(i + kAround, mesh_.indices.size()); j += 3) {
            const auto corners = cornersOf(j);
            if (corners[0]->triangle != own[0]->triangle) continue;
            const dvec2 away = glm::abs(corners[0]->uv - uv);
            if (away.x > 2 * size.x || away.y > 2 * size.y) continue;
            best = std::min(best, distanceToTriangle(there, {pixels_[mesh_.indices[j]], pixels_[mesh_.indices[j + 1]],
                                                             pixels_[mesh_.indices[j + 2]]}));
        }
        return best;
    }

    const RemeshSurface& surface_;
    const RemeshCamera& camera_;
    const RemeshMesh<double>& mesh_;
    double allowed_;
    std::vector<dvec2> pixels_;
};

}  // namespace vcp::meso::test
