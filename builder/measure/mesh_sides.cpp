#include "builder/measure/mesh_sides.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

/// A point that is nearer to an edge or vertex than this part of the triangle's height is on it.
constexpr double kOnEdge = 1e-9;

uint64_t edgeKey(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

glm::dvec3 unitNormal(const std::array<glm::dvec3, 3>& v) {
    const glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double length = glm::length(n);
    return length > 0 ? n / length : glm::dvec3(0);
}

double angleAt(glm::dvec3 apex, glm::dvec3 b, glm::dvec3 c) {
    const glm::dvec3 u = b - apex, v = c - apex;
    return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v));
}

std::vector<uint32_t> firstAtSamePlace(const std::vector<glm::dvec3>& positions) {
    std::vector<uint32_t> order(positions.size()), joined(positions.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](uint32_t i) {
        const glm::dvec3& p = positions[i];
        return std::array<double, 3>{p.x, p.y, p.z};
    };
    std::sort(order.begin(), order.end(),
              [&](uint32_t a, uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
    for (size_t i = 0; i < order.size(); ++i)
        joined[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? joined[order[i - 1]] : order[i];
    return joined;
}

}  // namespace

MeshSides::MeshSides(const IndexedMesh& mesh)
    : mesh_(&mesh), joined_(firstAtSamePlace(mesh.positions)), vertexNormals_(mesh.positions.size(), glm::dvec3(0)) {
    edgeNormals_.reserve(mesh.triangles.size() * 3 / 2);
    for (uint64_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto v = mesh.corners(t);
        const glm::dvec3 n = unitNormal(v);
        for (int k = 0; k < 3; ++k) {
            const uint32_t a = joined_[mesh.triangles[t][k]], b = joined_[mesh.triangles[t][(k + 1) % 3]];
            vertexNormals_[a] += angleAt(v[k], v[(k + 1) % 3], v[(k + 2) % 3]) * n;
            edgeNormals_[edgeKey(a, b)] += n;
        }
    }
}

glm::dvec3 MeshSides::pseudonormal(const NearestPoint& nearest) const {
    const auto& triangle = mesh_->triangles[nearest.triangle];
    const auto v = mesh_->corners(nearest.triangle);
    const glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double area2 = glm::dot(n, n);
    std::array<double, 3> weight{};
    for (int k = 0; k < 3; ++k)
        weight[k] =
            area2 > 0 ? glm::dot(n, glm::cross(v[(k + 2) % 3] - v[(k + 1) % 3], nearest.point - v[(k + 1) % 3])) / area2
                      : 0;
    const auto zero = [&](int k) { return weight[k] <= kOnEdge; };
    for (int k = 0; k < 3; ++k)
        if (zero((k + 1) % 3) && zero((k + 2) % 3)) return vertexNormals_[joined_[triangle[k]]];
    for (int k = 0; k < 3; ++k) {
        if (!zero(k)) continue;
        const auto found = edgeNormals_.find(edgeKey(joined_[triangle[(k + 1) % 3]], joined_[triangle[(k + 2) % 3]]));
        if (found != edgeNormals_.end()) return found->second;
    }
    return n;
}

bool MeshSides::isInside(glm::dvec3 p, const NearestPoint& nearest) const {
    return glm::dot(p - nearest.point, pseudonormal(nearest)) < 0;
}

}  // namespace vcp
