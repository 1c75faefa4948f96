// Decimation of a scan's mesh to a base mesh: half-edge collapses by quadric errors (Garland and Heckbert 1997), by
// OpenMesh's decimater.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "mesostructure/base_surface.h"

namespace vcp::meso {

struct DecimationOptions {
    size_t triangles = 0;  ///< to be reached or gone below by one
    /// Of each triangle of the surface, how many times its own changes count; empty: once. They outlive the call.
    std::span<const float> weights = {};
    /// Takes the part that is done, from 0 to 1; returning false cancels.
    std::function<bool(double fraction)> progress = {};
};

/// Collapses edges, those first that change the surface least, until so many triangles are left or none may be
/// collapsed any more. What is left are positions of the mesh itself, to the bit. A closed surface stays closed and
/// keeps its parts and their genus; no triangle turns by more than 60 degrees at once. Borders and seams of the map
/// stay where they are, but for corners along them; ends of seams and places where several meet stay. Corners must be
/// joined (joinPositions). Errors: those of edgesOf; InvalidInput (no triangle with three different corners); Limit (20
/// million triangles, 4096 at a corner); Cancelled.
Result<BaseSurface> decimated(const BaseSurface& surface, const DecimationOptions& options);

}  // namespace vcp::meso
