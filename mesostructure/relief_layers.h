// Solids as relief mapping draws them: for each texel the heights at which a line down from the slab's top enters and
// leaves the solid (Policarpo and Oliveira 2006, multi-layer relief; they keep four in one texture's channels).
#pragma once

#include <cstdint>
#include <vector>

#include "mesostructure/shape.h"

namespace vcp::meso {

/// Texel (i, j) lies at the grid point (i, j) / size. Its bounds go down: entry, exit, entry... in 1/65535 of the
/// slab's height; what is missing is 0, the slab's bottom. Bounds are filtered each for itself, as published: where two
/// texels have other numbers of them, the filter makes a skirt between sheets that are not of one surface.
struct ReliefLayers {
    static constexpr int kMost = 16;

    glm::ivec2 size{0};
    glm::dvec3 extent{0};
    int layers = 0;                ///< bounds a texel
    std::vector<uint16_t> bounds;  ///< those of a texel together, texels x fastest
    uint32_t cutColumns = 0;       ///< texels with more bounds, of which the lowest are left out

    [[nodiscard]] uint64_t bytes() const { return bounds.size() * 2; }
};

/// Traces the bounds. Sheets thinner than 1/4096 of the slab may be missed. Errors: Usage (no texels, an odd number of
/// layers or one that is not from 2 to kMost).
Result<ReliefLayers> traceLayers(const Shape& shape, glm::ivec2 texels, int layers);

}  // namespace vcp::meso
