#include "builder/stream/colour_difference.h"

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

}  // namespace vcp
