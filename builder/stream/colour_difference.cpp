#include "builder/stream/colour_difference.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "builder/stream/colour_encoding.h"

namespace vcp {

glm::dvec3 okLabOf(glm::dvec3 light) {
    const double l = std::cbrt(0.4122214708 * light.x + 0.5363325363 * light.y + 0.0514459929 * light.z);
    const double m = std::cbrt(0.2119034982 * light.x + 0.6806995451 * light.y + 0.1073969566 * light.z);
    const double s = std::cbrt(0.0883024619 * light.x + 0.2817188376 * light.y + 0.6299787005 * light.z);
    return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
            1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
            0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

glm::dvec3 okLabOfStored(Rgba8 colour) {
    const auto& light = lightOfByte();
    return okLabOf({light[colour & 255u], light[colour >> 8 & 255u], light[colour >> 16 & 255u]});
}

double colourDifference(glm::dvec3 light, glm::dvec3 other) {
    return 100 * glm::distance(okLabOf(light), okLabOf(other));
}

void TintMean::add(const Tint& tint, double weight) {
    const glm::dvec3 mean(tint.mean);
    weight_ += weight;
    sum_ += weight * mean;
    squares_ += weight * (double(tint.spread) + glm::dot(mean, mean));
}

void TintMean::add(glm::dvec3 okLab, double weight) {
    weight_ += weight;
    sum_ += weight * okLab;
    squares_ += weight * glm::dot(okLab, okLab);
}

Tint TintMean::mean() const {
    if (!(weight_ > 0)) return kUnknownTint;
    const glm::dvec3 mean = sum_ / weight_;
    return {glm::vec3(mean), float(std::max(0.0, squares_ / weight_ - glm::dot(mean, mean)))};
}

double rmsDifference(const Tint& tint, Rgba8 colour) {
    if (tint.spread < 0) return 0;
    const glm::dvec3 off = okLabOfStored(colour) - glm::dvec3(tint.mean);
    return 100 * std::sqrt(double(tint.spread) + glm::dot(off, off));
}

}  // namespace vcp
