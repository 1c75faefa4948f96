// Points of a triangle, and what the mesh has there.
#pragma once

#include <array>
#include <cstdint>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/stream/material.h"

namespace vcp {

/// How much each corner counts at a point of a triangle: whole numbers that sum up to kOne, so that they are exact, and
/// the same on an edge whichever triangle has it.
struct Weights {
    static constexpr int kLog2One = 26;
    static constexpr int32_t kOne = 1 << kLog2One;

    int32_t of[3];

    /// The point between corners `from` and the next one.
    static Weights onEdge(int from, int32_t ofNext) {
        Weights w{};
        w.of[from] = kOne - ofNext;
        w.of[(from + 1) % 3] = ofNext;
        return w;
    }
    bool operator==(const Weights&) const = default;
};

/// Returns twice the area of a triangle of points, positive where they go round to the left; exact.
inline int64_t turnOf(const Weights& a, const Weights& b, const Weights& c) {
    const auto along = [](const Weights& from, const Weights& to, int k) { return int64_t{to.of[k]} - from.of[k]; };
    return along(a, b, 1) * along(a, c, 2) - along(a, b, 2) * along(a, c, 1);
}

/// Returns a point's place in texels, of a triangle whose corners have these.
glm::dvec2 placeOf(const std::array<glm::dvec2, 3>& texels, const Weights& weights);

/// What a corner of a triangle has.
struct MaskCorner {
    glm::dvec3 position;
    glm::vec2 uv;
    Rgba8 colour;
    uint32_t normal;  ///< packDirection, or kUnknownNormal
};

/// Returns what is between the corners: a normal is unknown where one of those that count is. On an edge it depends on
/// nothing but the edge's ends, and not on their order.
MaskCorner blend(const std::array<MaskCorner, 3>& corners, const Weights& weights);

}  // namespace vcp
