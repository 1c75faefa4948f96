#include "render/pixel_samples.h"

#include <algorithm>

#include "render/false_colours.h"
#include "render/frame_setup.h"

namespace vcp {

namespace {

constexpr uint32_t kSeed = 36;
constexpr uint32_t kMiddle = 1u << 31;  // 0.5 in 32 bits after the point

uint32_t reversed(uint32_t bits) {
    uint32_t result = 0;
    for (int i = 0; i < 32; ++i) result |= (bits >> i & 1u) << (31 - i);
    return result;
}

/// Scrambles a coordinate, 32 bits after the point: each bit is turned over or not by those before it.
uint32_t scrambled(uint32_t x) {
    x = reversed(x) + kSeed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reversed(x);
}

/// Returns the second coordinate of Sobol's point `i`; the first one is `i` with its bits reversed.
uint32_t sobolSecond(uint32_t i) {
    uint32_t y = 0;
    for (uint32_t direction = kMiddle; i != 0; i >>= 1, direction ^= direction >> 1)
        if ((i & 1u) != 0) y ^= direction;
    return y;
}

}  // namespace

glm::dvec2 sampleOffset(uint32_t sample) {
    const uint32_t toMiddle = scrambled(0) ^ kMiddle;
    const auto placed = [&](uint32_t x) { return double(scrambled(x) ^ toMiddle) / 0x1p32 - 0.5; };
    return {placed(reversed(sample)), placed(sobolSecond(sample))};
}

uint32_t samplesOf(const FrameRequest& request, uint32_t asked) {
    const bool showsNumbers = isFalseColour(request.shading.mode) || request.shading.mode == ShadingMode::Normals;
    return showsNumbers ? 1 : std::clamp(asked, 1u, kMostSamples);
}

Result<void> checkRefinable(const FrameRequest& request, uint32_t samples) {
    if (request.sample == 0 && samples < samplesOf(request, kMostSamples)) return {};
    return Error{.code = ErrorCode::Usage, .message = "the picture has all the samples that it can have"};
}

}  // namespace vcp
