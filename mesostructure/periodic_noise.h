// Noise that repeats, from integer hashes: the same on every machine.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "mesostructure/tile_grid.h"

namespace vcp::meso {

/// Returns a hash of the lattice point, in [0, 1).
inline double hashUnit(int x, int y, uint32_t seed) {
    uint32_t h = seed * 0x9e3779b9u ^ uint32_t(x) * 0x85ebca6bu ^ uint32_t(y) * 0xc2b2ae35u;
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return (h ^ h >> 16) * 0x1p-32;
}

/// Returns gradient noise in about [-0.7, 0.7], of period (nx, ny).
inline double gradientNoise(double x, double y, int nx, int ny, uint32_t seed) {
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const double u = x - i, v = y - j;
    const auto corner = [&](int a, int b) {
        const double angle = 6.283185307179586 * hashUnit(wrapped(i + a, nx), wrapped(j + b, ny), seed);
        return std::cos(angle) * (u - a) + std::sin(angle) * (v - b);
    };
    const auto fade = [](double s) { return s * s * s * (s * (6 * s - 15) + 10); };
    const double low = corner(0, 0) + fade(u) * (corner(1, 0) - corner(0, 0)),
                 high = corner(0, 1) + fade(u) * (corner(1, 1) - corner(0, 1));
    return low + fade(v) * (high - low);
}

}  // namespace vcp::meso
