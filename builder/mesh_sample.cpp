#include "builder/mesh_sample.h"

#include <glm/common.hpp>

namespace vcp {

void MeshSample::addVertices(std::span<const glm::dvec3> positions) {
    if (positions.empty()) return;
    const std::scoped_lock lock(mutex_);
    if (version_ == 0) origin_ = low_ = high_ = positions.front();
    for (const glm::dvec3& p : positions) {
        low_ = glm::min(low_, p);
        high_ = glm::max(high_, p);
        if (vertices_.wantsNext()) vertices_.keep(glm::vec3(p - origin_));
    }
    ++version_;
}

void MeshSample::addTriangle(const WorldTriangle<double>& t) {
    if (!triangles_.wantsNext()) return;
    const std::scoped_lock lock(mutex_);
    triangles_.keep({.corner = {glm::vec3(t.corner[0] - origin_), glm::vec3(t.corner[1] - origin_),
                                glm::vec3(t.corner[2] - origin_)},
                     .colour = t.colour[0]});
    ++version_;
}

uint64_t MeshSample::version() const {
    const std::scoped_lock lock(mutex_);
    return version_;
}

MeshSample::Snapshot MeshSample::snapshot() const {
    const std::scoped_lock lock(mutex_);
    return {.origin = origin_,
            .low = low_,
            .high = high_,
            .vertices = vertices_.items(),
            .triangles = triangles_.items(),
            .trianglesEach = triangles_.each()};
}

}  // namespace vcp
