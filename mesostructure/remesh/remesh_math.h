// The maths of remeshing that GLSL has as well (mesostructure/shared/remesh_math.h) in C++, in single precision as
// pictures are drawn and in double precision as the reference. The house compiles without
// contraction: a point of an edge is the same from both sides, bit for bit.
#pragma once

#include <cmath>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp::meso {

namespace remeshing {

using namespace glm;
using uint = uint32_t;

/// Takes no call, as glm's does: x86-64 cannot round before SSE 4.1.
inline float floor(float x) {
    const float whole = std::abs(x) < 8388608.0f ? float(int(x)) : x;
    return whole > x ? whole - 1.0f : whole;
}
inline double floor(double x) { return std::floor(x); }

#define INLINE static inline
#define CONST_REF(T) const T&
#define CONSTANT static constexpr
#define PRECISE

template <class T>
struct RemeshMath {
    using Real = T;
    using Real2 = glm::vec<2, T>;
    using Real3 = glm::vec<3, T>;

#include "mesostructure/shared/remesh_layout.h"
#include "mesostructure/shared/remesh_math.h"
};

#undef INLINE
#define INLINE [[gnu::always_inline]] inline
#undef CONSTANT

/// The heights of filter levels, and normals; `Levels` has RemeshLevel and what remesh_heights.h says.
template <class T, class Levels>
struct RemeshHeights : Levels {
    using Real = T;
    using Real2 = glm::vec<2, T>;
    using Real3 = glm::vec<3, T>;
    using Levels::remeshLevel, Levels::remeshLevels, Levels::remeshTexels, Levels::remeshThere;
    using typename Levels::RemeshLevel;

#include "mesostructure/shared/remesh_heights.h"
#include "mesostructure/shared/remesh_normal.h"
};

/// The sweep of a piece; `Piece` has what remesh_sweep.h says.
template <class T, class Piece>
struct RemeshSweeping : RemeshMath<T>, Piece {
    using Real = T;
    using Real2 = glm::vec<2, T>;
    using Real3 = glm::vec<3, T>;
    using Math = RemeshMath<T>;
    using Math::remeshBetween, Math::remeshColumn, Math::remeshDepth, Math::remeshEdge, Math::remeshNearestPart,
        Math::remeshPart, Math::remeshPlan, Math::kRemeshMap, Math::kRemeshMost;
    using Piece::remeshAddTriangle, Piece::remeshAddVertex, Piece::remeshCell, Piece::remeshCorner,
        Piece::remeshFootprint, Piece::remeshHeight, Piece::remeshHeightLevel, Piece::remeshLevels,
        Piece::remeshMapWidth, Piece::remeshParts, Piece::remeshSeam, Piece::view;
    using typename Math::RemeshColumn, typename Math::RemeshCorner, typename Math::RemeshPlan,
        typename Math::RemeshSeam;
    using typename Piece::RemeshFootprint;

#include "mesostructure/shared/remesh_sweep.h"
};

#undef INLINE
#undef CONST_REF
#undef PRECISE

}  // namespace remeshing

using remeshing::RemeshMath;

}  // namespace vcp::meso
