// The arrays of a mesostructure method as shaders read them: one run of 32-bit words, a record of where each begins,
// and the specialization constants of the one pipeline that marches them (shared/meso_layout.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/method.h"

namespace vcp {

namespace frame {

using uint = uint32_t;
using vec4 = glm::vec4;
using ivec4 = glm::ivec4;
using uvec4 = glm::uvec4;

#include "render/shared/meso_layout.h"

static_assert(sizeof(MesoRecord) == 144 + 16 * (kMesoMaxLevels + kMesoMostBorders) &&
              offsetof(MesoRecord, levels) == 144);
static_assert(sizeof(MesoView) == 208 && offsetof(MesoView, picture) == 96);

}  // namespace frame

struct MesoArrays {
    frame::MesoRecord record{};
    std::array<uint32_t, 4> constants{};  ///< kWalk, kSkip, kSurface, kRefinement
    std::vector<uint32_t> words;          ///< a multiple of 4
};

/// Packs a method's arrays. Pure; the method is not referred to afterwards. Errors: Usage (a method without its
/// arrays), Limit (2^32 words, or cells of more than kMesoMaxLevels levels).
Result<MesoArrays> packMesoArrays(const meso::Method& method);

}  // namespace vcp
