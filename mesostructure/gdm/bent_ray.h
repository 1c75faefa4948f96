// The way of a ray over a base that bends (mesostructure/gdm/bent_path.h) in double precision, for what is traced.
#pragma once

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/vec2.hpp>

namespace vcp::meso::bent {

using namespace glm;
using Real = double;
using Real2 = glm::dvec2;

#define INLINE inline
#define OUT(T) T&
#include "mesostructure/gdm/bent_path.h"
#undef INLINE
#undef OUT

}  // namespace vcp::meso::bent
