// Sums of texels as light, weighted by alpha, so that transparent texels lend no colour.
#pragma once

#include <array>
#include <cstddef>

#include "builder/stream/colour_encoding.h"

namespace vcp {

/// Linear red, green and blue, weighted by alpha; and alpha.
using TexelLight = std::array<double, 4>;

inline void addTexel(TexelLight& sum, Rgba8 texel, double weight) {
    const auto& table = lightOfByte();
    const double alpha = weight * (texel >> 24) / 255;
    for (int c = 0; c < 3; ++c) sum[size_t(c)] += alpha * table[texel >> (8 * c) & 0xFF];
    sum[3] += alpha;
}

/// Encodes a sum of weights 1 as it is stored; colour without alpha does not matter.
inline Rgba8 encodedTexel(const TexelLight& sum) {
    if (!(sum[3] > 0)) return 0;
    return encodeRgba({sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], sum[3]});
}

}  // namespace vcp
