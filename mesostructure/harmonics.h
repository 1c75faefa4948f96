// The spherical harmonics that C++ and GLSL share (mesostructure/shared/harmonics.h), in C++: f32 is what shaders
// compute, f64 what volumes of transfer are made with.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

namespace vcp::meso {

#define INLINE inline

namespace f32 {

using Real = float;
using Real3 = glm::vec3;
using Real3x3 = glm::mat3;
#include "mesostructure/shared/harmonics.h"

}  // namespace f32

namespace f64 {

using Real = double;
using Real3 = glm::dvec3;
using Real3x3 = glm::dmat3;
#include "mesostructure/shared/harmonics.h"

}  // namespace f64

#undef INLINE

}  // namespace vcp::meso
