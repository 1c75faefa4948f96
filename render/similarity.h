// Several datasets in one picture: where each lies in the world, and its share of the budget. Pure.
//
// A dataset is drawn in its own space: camera, section planes and light are brought there. That keeps its lattice and
// its certified errors, and is why a dataset is placed by a similarity: angles stay, and lengths change by one factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "octree/io/result.h"

namespace vcp {

struct FrameRequest;
struct SectionPlane;

/// world = translation + scale * (rotation * point of the dataset).
struct Similarity {
    glm::dquat rotation{1, 0, 0, 0};  ///< unit
    double scale = 1;                 ///< above 0
    glm::dvec3 translation{0};

    bool operator==(const Similarity&) const = default;
    [[nodiscard]] glm::dvec3 toWorld(glm::dvec3 point) const { return translation + scale * (rotation * point); }
    [[nodiscard]] glm::dvec3 fromWorld(glm::dvec3 point) const {
        return glm::conjugate(rotation) * ((point - translation) / scale);
    }
    /// Turns a direction; its length stays.
    [[nodiscard]] glm::dvec3 turnedFromWorld(glm::dvec3 direction) const {
        return glm::conjugate(rotation) * direction;
    }
};

/// Makes a similarity from a 4 x 4 matrix, row by row, that takes columns (x, y, z, 1) to the world. Errors: Usage,
/// where it is no similarity: not affine, mirrored, or with other scales along other axes (to 1e-6).
Result<Similarity> similarityFromMatrix(std::span<const double, 16> rows);

/// Returns a plane of the world in a dataset's own space.
SectionPlane planeIn(const Similarity& placement, const SectionPlane& plane);

/// Returns the request as it is seen from a dataset's own space. Pixels, tiles and errors in pixels stay.
FrameRequest requestIn(const Similarity& placement, const FrameRequest& request);

}  // namespace vcp
