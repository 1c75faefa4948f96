// The shared maths of light on hits (render/shared/hit_light.h) in C++, for one pixel.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

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

/// skyDirection, with what depends on the pixel's place alone found once.
class SkyDirections {
public:
    explicit SkyDirections(const frame::FrameConstants& frame) : spirals_(16 * size_t(frame.occlusionRays)) {
        for (uint32_t k = 0; k < spirals_.size(); ++k)
            spirals_[k] = f32::spiralDirection(k / 16, frame.occlusionRays, k % 16, frame.sampleNumber);
    }
    [[nodiscard]] glm::vec3 operator()(glm::vec3 normal, uint32_t ray, glm::uvec2 pixel) const {
        return f32::aboutNormal(normal, spirals_[16 * ray + f32::squareOf(pixel.x, pixel.y)]);
    }

private:
    std::vector<glm::vec3> spirals_;  // 16 a ray
};

/// Returns the number that the false colours of a FrameConstants::shadingMode end at: 1 where it is no count of work.
inline float mostShown(uint32_t shadingMode) {
    switch (shadingMode) {
        case frame::kShadeSteps:
            return frame::kMostShownSteps;
        case frame::kShadeCells:
            return frame::kMostShownCells;
        case frame::kShadeFetches:
            return frame::kMostShownFetches;
        default:
            return 1;
    }
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
