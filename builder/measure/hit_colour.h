// The colour of a dataset's surface where a ray of the reference caster hit it.
#pragma once

#include <optional>

#include "octree/image/image_set.h"
#include "octree/reference_caster.h"

namespace vcp {

/// Returns the weights of a triangle's corners that blend to a point of its plane; those of the first corner alone
/// where it has no area.
glm::dvec3 cornerWeights(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c);

/// Returns the linear light, 0 to 1, that the renderer shows there without light, seen so near that a pixel is narrower
/// than a texel; nothing where the dataset has no colour. `images`: all of the file's; null: colours are those of
/// vertices and slabs. Precondition: `hit` is of a ray through pages of `cache`.
std::optional<glm::dvec3> lightOfHit(const PageCache& cache, const RayHit& hit, const ImageSet* images = nullptr);

}  // namespace vcp
