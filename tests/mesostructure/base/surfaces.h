// Small surfaces with known edges, for the tests of base surfaces.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "mesostructure/base_surface.h"

namespace vcp::meso::test {

inline BaseSurface tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}, {}};
}

/// Two cones of n triangles each over one ring: corners of n and of 4 triangles.
inline BaseSurface doubleCone(uint32_t n) {
    BaseSurface made{{{0, 0, 1}, {0, 0, -1}}, {}, {}};
    for (uint32_t i = 0; i < n; ++i) {
        const double turn = 2 * std::numbers::pi * i / n;
        made.positions.push_back({std::cos(turn), std::sin(turn), 0});
        const uint32_t here = 2 + i, next = 2 + (i + 1) % n;
        made.triangles.push_back({0, here, next}), made.triangles.push_back({1, next, here});
    }
    return made;
}

/// A square of n x n cells with its map, from (0, 0) to (1, 1), moved out of its plane by `bump`.
inline BaseSurface square(uint32_t n, double bump = 0) {
    BaseSurface made;
    std::minstd_rand random(7);
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i)
            made.positions.push_back({double(i) / n, double(j) / n, bump * double(random() % 1000) / 1000});
    const auto uv = [&](uint32_t corner) { return glm::dvec2(made.positions[corner]); };
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = i + (n + 1) * j, b = a + 1, c = b + n + 1, d = a + n + 1;
            made.triangles.push_back({a, b, c}), made.uvs.push_back({uv(a), uv(b), uv(c)});
            made.triangles.push_back({a, c, d}), made.uvs.push_back({uv(a), uv(c), uv(d)});
        }
    return made;
}

inline BaseSurface shape(const char* name) { return *makeBaseSurface(name, 1); }

/// Both surfaces as one, the second moved.
inline BaseSurface both(BaseSurface a, const BaseSurface& b, glm::dvec3 by) {
    const auto first = uint32_t(a.positions.size());
    for (const glm::dvec3 p : b.positions) a.positions.push_back(p + by);
    for (const auto& t : b.triangles) a.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    a.uvs.insert(a.uvs.end(), b.uvs.begin(), b.uvs.end());
    return a;
}

}  // namespace vcp::meso::test
