#include "viewer/bench/picture/shading_normals.h"

#include <cmath>
#include <numbers>
#include <unordered_map>

#include <glm/geometric.hpp>

#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

// The cosine of the angle up to which a triangle takes a vertex' normal, and how large a part of the area around the
// vertex is a crease where it turns farther.
const double kCreaseCosine = std::cos(40 * std::numbers::pi / 180);
constexpr double kCreaseShare = 1.0 / 16;

struct PositionHash {
    size_t operator()(const glm::dvec3& p) const {
        size_t hash = 0;
        for (int axis = 0; axis < 3; ++axis) hash = hash * 0x9e3779b97f4a7c15u + std::hash<double>()(p[axis]);
        return hash;
    }
};

}  // namespace

std::vector<glm::vec3> shadingNormals(const IndexedMesh& mesh) {
    std::unordered_map<glm::dvec3, uint32_t, PositionHash> places;
    std::vector<uint32_t> place(mesh.positions.size());
    for (size_t v = 0; v < place.size(); ++v)
        place[v] = places.try_emplace(mesh.positions[v], uint32_t(places.size())).first->second;
    std::vector<glm::dvec3> sums(places.size(), glm::dvec3(0)), flat(mesh.triangles.size());
    for (size_t t = 0; t < flat.size(); ++t) {
        const auto corners = mesh.corners(t);
        flat[t] = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        for (const uint32_t vertex : mesh.triangles[t]) {
            glm::dvec3& sum = sums[place[vertex]];
            sum += glm::dot(sum, flat[t]) < 0 ? -flat[t] : flat[t];
        }
    }
    std::vector<double> turned(sums.size(), 0);
    for (size_t t = 0; t < flat.size(); ++t)
        for (const uint32_t vertex : mesh.triangles[t]) {
            const glm::dvec3 sum = sums[place[vertex]];
            const double size = glm::length(flat[t]);
            if (std::abs(glm::dot(sum, flat[t])) < kCreaseCosine * glm::length(sum) * size)
                turned[place[vertex]] += size;
        }
    std::vector<glm::vec3> normals(3 * flat.size());
    for (size_t t = 0; t < flat.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const uint32_t at = place[mesh.triangles[t][i]];
            const bool isCrease = turned[at] > 0 && turned[at] >= kCreaseShare * glm::length(sums[at]);
            const uint32_t own = mesh.normals.empty() ? kUnknownNormal : mesh.normals[t][size_t(i)];
            if (own != kUnknownNormal) {
                normals[3 * t + i] = glm::vec3(f64::cornerNormal(own, flat[t]));
                continue;
            }
            const glm::dvec3 n = isCrease ? flat[t] : glm::dot(sums[at], flat[t]) < 0 ? -sums[at] : sums[at];
            const double length = glm::length(n);
            normals[3 * t + i] = glm::vec3(length > 0 ? n / length : n);
        }
    return normals;
}

}  // namespace vcp
