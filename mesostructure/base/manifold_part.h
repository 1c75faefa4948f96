// What of a triangle mesh can be a surface of half-edges.
#pragma once

#include <cstdint>

#include "mesostructure/base_surface.h"

namespace vcp::meso {

/// Leaves out triangles with two equal corners, and those that run along an edge in the direction of an earlier one:
/// then each edge has two triangles at most, turned to one side. Corners must be joined (joinPositions). Returns how
/// many triangles went, but for those with equal corners. Memory: 48 bytes a triangle.
uint64_t keepManifoldPart(BaseSurface& surface);

/// Leaves out triangles that lie back to back, two and two, which simplifying makes of thin parts. What is closed stays
/// closed. Returns how many triangles went. Memory: 16 bytes a triangle.
uint64_t leaveOutFolds(BaseSurface& surface);

/// Parts sheets that touch along an edge, which then has more than two triangles: simplifying pinches thin parts so.
/// Each sheet gets corners of its own, a little away from the others'; closed ones of a few triangles go. Corners on
/// borders stay where they are and are not parted. What is closed stays closed. Corners that no triangle has are left.
/// Memory: 80 bytes a triangle.
void partSheets(BaseSurface& surface);

}  // namespace vcp::meso
