// Light between two walls, by radiosity: what path tracers and transfer are tested against.
#pragma once

#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace vcp::test {

/// The light on the strips of one wall of an endless groove of 90 degrees under a sky of 1, by radiosity: form factors
/// of strips by Hottel's crossed strings.
inline std::vector<double> grooveLight(int strips, double albedo) {
    const auto left = [&](int i) { return glm::dvec2(-1, 1) * (double(i) / strips); };
    const auto right = [&](int i) { return glm::dvec2(1, 1) * (double(i) / strips); };
    std::vector<double> light(size_t(strips), 1.0);
    for (int round = 0; round < 60; ++round) {
        std::vector<double> next;
        for (int i = 0; i < strips; ++i) {
            double across = 0, from = 0;
            for (int j = 0; j < strips; ++j) {
                const double factor = (glm::length(left(i + 1) - right(j)) + glm::length(left(i) - right(j + 1)) -
                                       glm::length(left(i) - right(j)) - glm::length(left(i + 1) - right(j + 1))) /
                                      (2 * glm::length(left(i + 1) - left(i)));
                across += factor, from += factor * albedo * light[size_t(j)];
            }
            next.push_back(1 - across + from);
        }
        light = next;
    }
    return light;
}

}  // namespace vcp::test
