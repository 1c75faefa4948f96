// Factors as textures hold them: four terms a texel, 8 or 16 bits each, with one unit for all weights and one for all
// eigen-maps. Filtering each factor is filtering their product, along the axes of each.
#pragma once

#include "mesostructure/gdm/factors.h"

namespace vcp::meso {

struct PackedFactors {
    size_t rows = 0, columns = 0;
    int rank = 0;                   ///< a multiple of 4; missing terms are 0
    int bits = 16;                  ///< of a value: 8 or 16
    float unit = 0;                 ///< of the product of a weight and an eigen-map's value, tile units
    std::vector<uint32_t> weights;  ///< group of four terms by group, row by row: bits / 8 words, low first
    std::vector<uint32_t> eigen;    ///< the same of the columns

    [[nodiscard]] uint64_t bytes() const { return (weights.size() + eigen.size()) * 4; }
    /// Returns an entry of the product, tile units.
    [[nodiscard]] double value(size_t row, size_t column) const;
};

/// Packs the first `rank` terms. Errors: Usage (bits neither 8 nor 16, rank above the factors').
Result<PackedFactors> packFactors(const Factors& factors, int rank, int bits);

}  // namespace vcp::meso
