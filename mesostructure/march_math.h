// The maths of marchers that C++ and GLSL share (mesostructure/shared/) in C++: namespace f32 is what the marchers on
// the CPU and the shaders compute; of namespace f64 there is only the solving inside one cell, which the truths in
// double precision use.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/integer.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <glm/vector_relational.hpp>

namespace vcp::meso {

// As in a shader, all is inlined: a march is half as slow again where the compiler chooses.
#define INLINE [[gnu::always_inline]] inline
#define CONST_REF(T) const T&
#define INOUT(T) T&
#define OUT(T) T&

namespace f32 {

using namespace glm;
using uint = uint32_t;
using Real = float;
using Real2 = glm::vec2;
using Real3 = glm::vec3;
using Real4 = glm::vec4;

/// Takes no call, as glm's does: x86-64 cannot round before SSE 4.1.
inline float floor(float x) {
    const float whole = std::abs(x) < 8388608.0f ? float(int(x)) : x;
    return whole > x ? whole - 1.0f : whole;
}
inline glm::vec3 floor(glm::vec3 v) { return {floor(v.x), floor(v.y), floor(v.z)}; }

#include "mesostructure/shared/march_layout.h"
static_assert(sizeof(MesoRecord) == 192 + 16 * (kMesoMaxLevels + kMesoMostBorders) &&
              offsetof(MesoRecord, levels) == 192);

#include "mesostructure/shared/shell_layout.h"

#include "mesostructure/gdm/bent_path.h"

#define REAL_EPSILON 1.1920929e-7
#include "mesostructure/shared/cell_solve.h"
#undef REAL_EPSILON
#include "mesostructure/shared/grid_walk.h"
#include "mesostructure/shared/patch_solve.h"

/// Marches one ray through packed arrays. What is global in a shader is a member here, under the same name.
struct ArrayMarch {
    const MesoRecord& meso;
    const uint* words;
    uint kWalk, kSkip, kSurface, kRefinement;

    [[nodiscard]] uint fetchWord(uint i) const { return words[i]; }
    [[nodiscard]] uvec4 fetchQuad(uint i) const {
        const uint* quad = words + size_t{4} * i;
        return {quad[0], quad[1], quad[2], quad[3]};
    }

#include "mesostructure/shared/cone_lookup.h"
#include "mesostructure/shared/march.h"
#include "mesostructure/shared/march_cells.h"
#include "mesostructure/shared/march_data.h"
#include "mesostructure/shared/march_gdm.h"
};

/// Finds cones among borders that are in no record.
template <class Borders>
struct ConeLookup {
    const Borders& meso;

#include "mesostructure/shared/cone_lookup.h"
};

}  // namespace f32

namespace f64 {

using namespace glm;
using Real = double;
using Real2 = glm::dvec2;
using Real3 = glm::dvec3;
using Real4 = glm::dvec4;

#define REAL_EPSILON 2.220446049250313e-16
#include "mesostructure/shared/cell_solve.h"
#undef REAL_EPSILON

}  // namespace f64

#undef INLINE
#undef CONST_REF
#undef INOUT
#undef OUT

}  // namespace vcp::meso
