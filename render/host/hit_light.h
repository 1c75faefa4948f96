// The shared maths of light on hits (render/shared/hit_light.h) in C++, for one pixel.
#pragma once

#include <glm/trigonometric.hpp>

#include "octree/surface/leaf_math.h"

namespace vcp::f32 {

#define INLINE inline
#include "render/shared/hit_light.h"
#undef INLINE

}  // namespace vcp::f32
