// The shared lookup of images (octree/shared/image_lookup.h) in C++.
#pragma once

#include "octree/surface/leaf_math.h"

namespace vcp {

#define INLINE inline
#define SELECT(condition, yes, no) ((condition) ? (yes) : (no))
namespace f32 {
#include "octree/shared/image_lookup.h"
#include "octree/shared/mapped_normal.h"
}  // namespace f32

namespace f64 {
#include "octree/shared/image_lookup.h"
#include "octree/shared/mapped_normal.h"
}  // namespace f64
#undef INLINE
#undef SELECT

}  // namespace vcp
