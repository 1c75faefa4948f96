#include "viewer/export/diverging_colours.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>

#include "builder/stream/colour_encoding.h"

namespace vcp {

namespace {

constexpr glm::dvec3 kBelow(59 / 255.0, 76 / 255.0, 192 / 255.0), kMiddle(221 / 255.0, 221 / 255.0, 221 / 255.0),
    kAbove(180 / 255.0, 4 / 255.0, 38 / 255.0), kNoNumber(0.55, 0.55, 0.55);

// Linear sRGB to CIE XYZ, D65 (IEC 61966-2-1), by columns.
const glm::dmat3 kXyzFromLight(0.4124, 0.2126, 0.0193, 0.3576, 0.7152, 0.1192, 0.1805, 0.0722, 0.9505);
const glm::dvec3 kWhite(0.9505, 1, 1.089);
constexpr double kDelta = 6.0 / 29;

glm::dvec3 labOf(glm::dvec3 srgb) {
    glm::dvec3 light;
    for (int c = 0; c < 3; ++c) light[c] = srgbToLinear(srgb[c]);
    const glm::dvec3 xyz = kXyzFromLight * light / kWhite;
    glm::dvec3 f;
    for (int c = 0; c < 3; ++c)
        f[c] = xyz[c] > kDelta * kDelta * kDelta ? std::cbrt(xyz[c]) : xyz[c] / (3 * kDelta * kDelta) + 4.0 / 29;
    return {116 * f.y - 16, 500 * (f.x - f.y), 200 * (f.y - f.z)};
}

glm::dvec3 srgbOf(glm::dvec3 lab) {
    const double y = (lab.x + 16) / 116;
    const glm::dvec3 f(y + lab.y / 500, y, y - lab.z / 200);
    glm::dvec3 xyz;
    for (int c = 0; c < 3; ++c)
        xyz[c] = kWhite[c] * (f[c] > kDelta ? f[c] * f[c] * f[c] : 3 * kDelta * kDelta * (f[c] - 4.0 / 29));
    const glm::dvec3 light = glm::clamp(glm::inverse(kXyzFromLight) * xyz, 0.0, 1.0);
    return {linearToSrgb(light.x), linearToSrgb(light.y), linearToSrgb(light.z)};
}

}  // namespace

glm::dvec3 divergingColour(double value) {
    if (std::isnan(value)) return kNoNumber;
    static const glm::dvec3 below = labOf(kBelow), middle = labOf(kMiddle), above = labOf(kAbove);
    const double size = std::min(std::abs(value), 1.0);
    return srgbOf(glm::mix(middle, value < 0 ? below : above, size));
}

}  // namespace vcp
