// The shared maths of rays through shells (render/shared/shell_cast.h) in C++.
#pragma once

#include <glm/common.hpp>
#include <glm/gtc/packing.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "mesostructure/harmonics.h"
#include "mesostructure/march_arrays.h"
#include "render/shared/meso_view.h"

namespace vcp::meso::f32::shell {

using namespace vcp::frame;

#include "mesostructure/shared/transfer_layout.h"
#include "render/shared/shell_records.h"

#define INLINE inline
#define INOUT(T) T&

/// Casts rays through one shell, one after the other. What is global in a shader is a member here, under the same name.
struct ShellCast : ArrayMarch {
    /// `inputs`: the shell's texels; `looks`: words of what is seen from far and of textures; `overBase`: of the light
    /// over the base.
    ShellCast(const MarchArrays& arrays, const MesoView& of, const vec4* texels, const uint64_t* words64,
              const uint64_t* overBase, uint textures, bool isFarDrawn)
        : ArrayMarch{arrays.record,         arrays.words.data(),      arrays.constants.walk,
                     arrays.constants.skip, arrays.constants.surface, arrays.constants.refinement},
          view(of),
          inputs(texels),
          looks(words64),
          baseLight(overBase),
          kTextures(textures),
          kFromFar(isFarDrawn ? 1 : 0) {}

    const MesoView& view;
    const vec4* inputs;
    const uint64_t* looks;
    const uint64_t* baseLight;
    uint kTextures, kFromFar, kShadow = 0;

    [[nodiscard]] vec4 fetchInput(int i) const { return inputs[i]; }
    [[nodiscard]] vec4 fetchLook(int i) const { return unpackHalf4x16(looks[i]); }
    [[nodiscard]] vec4 fetchBaseLight(int i) const { return unpackHalf4x16(baseLight[i]); }

#include "mesostructure/shared/transfer_lookup.h"
#include "render/shared/shell_cast.h"
};

#undef INLINE
#undef INOUT

}  // namespace vcp::meso::f32::shell
