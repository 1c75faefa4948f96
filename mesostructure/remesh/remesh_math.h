// The maths of remeshing that GLSL has as well (mesostructure/shared/remesh_math.h) in C++, in single precision as
// pictures are drawn and in double precision as the reference. The house compiles without
// contraction: a point of an edge is the same from both sides, bit for bit.
#pragma once

#include <cmath>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace vcp::meso {

namespace remeshing {

using namespace glm;
using uint = uint32_t;

#define INLINE static inline
#define CONST_REF(T) const T&
#define CONSTANT static constexpr

template <class T>
struct RemeshMath {
    using Real = T;
    using Real3 = glm::vec<3, T>;

#include "mesostructure/shared/remesh_math.h"
};

#undef INLINE
#undef CONST_REF
#undef CONSTANT

}  // namespace remeshing

using remeshing::RemeshMath;

}  // namespace vcp::meso
