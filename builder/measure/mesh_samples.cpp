#include "builder/measure/mesh_samples.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

glm::dvec3 pointOf(const std::array<glm::dvec3, 3>& v, SampleRandom& random) {
    double a = random.unit(), b = random.unit();
    if (a + b > 1) a = 1 - a, b = 1 - b;
    return v[0] + a * (v[1] - v[0]) + b * (v[2] - v[0]);
}

}  // namespace

MeshSampler::MeshSampler(const IndexedMesh& mesh) : mesh_(mesh) {
    double sum = 0;
    for (uint64_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto v = mesh.corners(t);
        const double area = glm::length(glm::cross(v[1] - v[0], v[2] - v[0]));
        if (!(area > 0)) continue;
        triangles_.push_back(uint32_t(t));
        areaUpTo_.push_back(sum += area);
    }
}

glm::dvec3 MeshSampler::pointByArea(SampleRandom& random) const {
    const uint64_t triangle = byArea(random);
    return pointOf(mesh_.corners(triangle), random);
}

MeshSampler::Sample MeshSampler::sample(uint64_t number, SampleRandom& random) const {
    const uint64_t kind = number & 3;
    const uint64_t triangle = kind < 2 ? byArea(random) : triangles_[random.below(triangles_.size())];
    const auto v = mesh_.corners(triangle);
    glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double length = glm::length(n);
    n /= length;
    const uint64_t corner = random.below(3);
    if (kind == 3) return {v[corner], n};
    if (kind == 2) return {glm::mix(v[corner], v[(corner + 1) % 3], random.unit()), n};
    return {pointOf(v, random), n};
}

uint64_t MeshSampler::byArea(SampleRandom& random) const {
    const double at = random.unit() * areaUpTo_.back();
    const auto found = std::upper_bound(areaUpTo_.begin(), areaUpTo_.end(), at);
    return triangles_[std::min<size_t>(found - areaUpTo_.begin(), areaUpTo_.size() - 1)];
}

}  // namespace vcp
