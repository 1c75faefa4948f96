// The shared blend of slab leaves (octree/shared/slab_blend.h) in C++.
#pragma once

#include "octree/surface/leaf_math.h"

namespace vcp {

#define INLINE inline
namespace f32 {
#include "octree/shared/slab_blend.h"
}  // namespace f32

namespace f64 {
#include "octree/shared/slab_blend.h"
}  // namespace f64
#undef INLINE

}  // namespace vcp
