// What the marchers of displacement maps and of slices read: distances as a table or as factors (mesostructure/gdm/),
// and the solid's density and normals in a volume, as the paper's textures hold them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "mesostructure/gdm/distance_table.h"
#include "mesostructure/gdm/packed_factors.h"
#include "mesostructure/gdm/safe_factors.h"
#include "mesostructure/octant_boxes.h"
#include "mesostructure/shape.h"

namespace vcp::meso {

struct Asset;

/// A normal of three signed bytes and a density of one, at grid points: x and y repeat, z goes from the slab's bottom
/// to its top. The density is a half on the surface, and 0 or 1 a point's distance off it.
struct PropertyVolume {
    glm::ivec3 points{0};
    glm::dvec3 extent{0};
    std::vector<uint32_t> texels;  ///< x fastest

    [[nodiscard]] uint64_t bytes() const { return texels.size() * 4; }
};
/// Errors: Usage (fewer than 2 points along an axis, or more than kMaxGridEdge), Limit.
Result<PropertyVolume> sampleProperties(const Shape& shape, glm::ivec3 points);

struct GdmOptions {
    glm::ivec3 points{32, 32, 16};  ///< of a map of the top alone, z is not read
    glm::ivec2 directions{16, 32};  ///< thetas, phis
    bool ofTop = false;             ///< a view-dependent displacement map
    Curvatures curvatures = {};     ///< of such a map
    uint64_t memoryBytes = uint64_t{1} << 30;
    /// Calls `fill(first, last)` for all of [0, count), in ranges that may run in several threads at once; false
    /// cancels. Empty: in this thread.
    std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill)> shareOut = {};
};

/// Traces the distances of an asset's shape: height fields exactly, others by the samples of their distances (boxes,
/// which miss nothing of them). Errors: those of emptyTable and of the marcher; Cancelled.
Result<DistanceTable> traceTable(const Asset& asset, const Shape& shape, const GdmOptions& options);

/// A table's rows for factorize; it refers to the table.
RowSource rowsOf(const DistanceTable& table);

struct GdmMap {
    DistanceTable table;  ///< `steps` and `hits` only as far as they are marched
    std::optional<PackedFactors> factors;
    int bits = 16;  ///< of the table's values
    bool withVisibility = false;
    PropertyVolume properties;

    [[nodiscard]] uint64_t bytes() const;
};

/// Makes the map that is marched. `rank` 0: the table itself, in 8 or 16 bits. Errors: those of factorize and
/// packFactors.
Result<GdmMap> packMap(DistanceTable table, int rank, int bits, bool withVisibility, PropertyVolume properties);

inline constexpr Cones kGuessCones{32, 16};
inline constexpr double kGuessCap = 1;  ///< tiles

/// Guesses safe lengths for the empty cells of a grid, in kGuessCones. Errors: those of buildDistanceMap and
/// makeSafeFactors.
Result<SafeFactors> buildGuesses(const Occupancy& occupancy, const SafeOptions& options);

}  // namespace vcp::meso
