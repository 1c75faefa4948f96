// The shared maths of light on hits (render/shared/hit_light.h) in C++, for one pixel.
#pragma once

#include <array>
#include <cstddef>

#include <glm/trigonometric.hpp>
#include <glm/vec4.hpp>

#include "octree/surface/leaf_math.h"
#include "render/shared/frame.h"

namespace vcp::f32 {

#define INLINE inline
#include "render/shared/hit_light.h"
#undef INLINE

}  // namespace vcp::f32

namespace vcp {

/// The light of each value that a byte stores of a colour (lightOfColour).
inline const std::array<float, 256>& lightOfColourBytes() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> light;
        for (size_t i = 0; i < light.size(); ++i) light[i] = f32::lightOfColour(glm::vec3(float(i) / 255)).x;
        return light;
    }();
    return table;
}

/// Returns a light as FrameConstants::lightDirection has it, and its bits of the part of the light that is seen, as the
/// shaders have them.
inline glm::vec4 lightNumbered(const frame::FrameConstants& frame, uint32_t number) {
    return number == 0 ? frame.lightDirection : frame.moreLights[number - 1];
}
inline uint8_t bitsOfLight(const frame::FrameConstants& frame, uint32_t number) {
    return uint8_t(frame.lightCount == 1 ? 255 : 1 << number);
}

}  // namespace vcp
