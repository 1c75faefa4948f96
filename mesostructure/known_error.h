// What is known of how far the hits of a method lie from its asset's surface.
#pragma once

#include <optional>

#include "mesostructure/march_arrays.h"

namespace vcp::meso {

/// Returns a bound, in tile units, for every hit of the method; nothing where none holds. 0 where the asset's own
/// height field is marched, solved in closed form; the diagonal of a cell where a grid is, for each hit lies in a cell
/// that the asset's surface passes. Rounding, and what bends the tile over its base, come in addition.
std::optional<double> knownError(const MarchArrays& arrays);

}  // namespace vcp::meso
