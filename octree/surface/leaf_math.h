// The shared leaf maths (octree/shared/leaf_math.h) in C++: namespace f32 is what the GPU computes,
// namespace f64 the reference.
#pragma once

#include <cstdint>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp {

using uint = uint32_t;
using uint4 = glm::u32vec4;

#define INLINE inline
#include "octree/shared/page_layout.h"

#define DONT_UNROLL
namespace f32 {
using namespace glm;
using uint = uint32_t;
using Real = float;
using Real2 = glm::vec2;
using Real3 = glm::vec3;
using Real4 = glm::vec4;
#define ROOT_RESIDUAL 1e-5f
#include "octree/shared/leaf_math.h"
#undef ROOT_RESIDUAL
}  // namespace f32

namespace f64 {
using namespace glm;
using uint = uint32_t;
using Real = double;
using Real2 = glm::dvec2;
using Real3 = glm::dvec3;
using Real4 = glm::dvec4;
#define ROOT_RESIDUAL 1e-14
#include "octree/shared/leaf_math.h"
#undef ROOT_RESIDUAL
}  // namespace f64
#undef INLINE
#undef DONT_UNROLL

}  // namespace vcp
