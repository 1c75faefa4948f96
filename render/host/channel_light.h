// The shared maths of light on surfaces with channels (render/shared/channel_light.h) in C++.
#pragma once

#include "render/host/hit_light.h"

namespace vcp::f32 {

#define INLINE inline
#include "render/shared/channel_light.h"
#undef INLINE

}  // namespace vcp::f32
