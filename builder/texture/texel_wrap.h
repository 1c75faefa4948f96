// Where a row of texels goes on beyond its ends.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "builder/stream/material.h"

namespace vcp {

/// Returns which of the texels 0 to size-1 is shown at place `texel`, which is whole and finite.
inline uint32_t wrappedTexel(double texel, uint32_t size, Wrap wrap) {
    const double edge = size;
    if (texel >= 0 && texel < edge) return uint32_t(texel);
    if (wrap == Wrap::Clamp) return uint32_t(std::clamp(texel, 0.0, edge - 1));
    const double period = wrap == Wrap::Mirror ? 2 * edge : edge;
    double inside = texel - std::floor(texel / period) * period;
    if (wrap == Wrap::Mirror && inside >= edge) inside = period - 1 - inside;
    return uint32_t(std::clamp(inside, 0.0, edge - 1));
}

}  // namespace vcp
