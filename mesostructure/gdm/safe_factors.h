// Distances by few factors that are made safe (ours, beside packed_factors.h): what the factors say, less a bound on
// how far they say too much, is never more than the distance. So it is a guess that a ray may follow blindly; what the
// guess falls short of is walked.
//
// The matrix is that of a distance map of narrow cones (beam_lengths.h): rows (x, y, azimuth), columns (elevation, z).
// Rows are in clusters. All of a row lies in `quads` groups of 16 bytes, of 8 values of 16 bits each, and so do a
// cluster's columns; a guess reads one of each a group:
//
//            half 0 to 5    half 6           half 7            other groups
//   row      six weights    the row's bound  its cluster       eight weights
//   column   six values     its bound        the mean          eight values
//
// length = mean + sum of weight * value - the lesser bound. A row's bound is over all columns, a column's over all rows
// of its cluster; both hold, so the lesser does.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "mesostructure/gdm/factors.h"

namespace vcp::meso {

struct SafeFactors {
    glm::ivec3 cells{0};
    int azimuths = 0, elevations = 0;
    int quads = 0, clusters = 0;
    float unit = 0;     ///< of means and bounds, tile units
    float product = 0;  ///< of a weight times a value, tile units
    std::vector<uint32_t> rows, columns;

    [[nodiscard]] size_t rowCount() const { return size_t(cells.x) * size_t(cells.y) * size_t(azimuths); }
    [[nodiscard]] size_t columnCount() const { return size_t(elevations) * size_t(cells.z); }
    [[nodiscard]] uint64_t bytes() const { return (rows.size() + columns.size()) * 4; }
    /// Returns the guess, which may be below 0.
    [[nodiscard]] double length(size_t row, size_t column) const;
};

/// The lengths that are factored, one byte each, cone by cone (elevation * azimuths + azimuth), cells x fastest.
struct ConeLengths {
    glm::ivec3 cells{0};
    int azimuths = 0, elevations = 0;
    float unit = 0;  ///< tile units of one step
    std::span<const uint8_t> steps;
    uint8_t unasked = 255;  ///< in place of the length of a cell in which no guess is made

    [[nodiscard]] uint8_t step(size_t row, size_t column) const;
};

struct SafeOptions {
    int quads = 1;      ///< 1 to 4: ranks 6, 14, 22, 30
    int clusters = 16;  ///< 1 to 256
    int rounds = 4;
};

/// Errors: as factorizeClusters'; Usage (quads out of range).
Result<SafeFactors> makeSafeFactors(const ConeLengths& lengths, const SafeOptions& options,
                                    const FactorProgress& progress = {});

}  // namespace vcp::meso
