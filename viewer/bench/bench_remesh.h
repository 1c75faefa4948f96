// vcp bench meso --remesh: what remeshing a height field costs and how far off it is, by cell and by filter levels
// (docs/remeshing.md). On the processor, in one thread; where a device is given, there as well, where the vertices are
// the same.
//
// The field lies on a quad, seen at 1920 x 1200 from near over it and from 45 degrees. Errors are distances on the
// screen between a point of a triangle and the displaced surface at the same place of the tile, in double, at four
// places a triangle, of those that are in the picture. The horizon is the highest point in each of 480 columns of the
// picture: of the mesh's vertices and edges against the map's texels and between them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "octree/io/result.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {

/// Measures the height fields among the assets, at cells of 1, 5 and 20 pixels, and with certified cells that may err
/// by 0.5, 1 and 4. `device`: as BenchMesoOptions::device. Errors: those of openMesoAsset, of RemeshMeter and of
/// remeshing.
Result<std::vector<RemeshRow>> benchRemesh(const std::vector<std::string>& assets,
                                           const std::optional<std::string>& device);

/// Draws the same views by the sweep and by the device's tessellator. The error of a pixel is how far from it, on the
/// screen, the displaced surface is at the place of the tile that it shows. Errors: as benchRemesh(); Unsupported.
Result<std::vector<RemeshDrawnRow>> benchTessellation(const std::vector<std::string>& assets,
                                                      const std::string& device);

/// Sets the paper's figures beside ours: the volume of fitted levels, storage, additions a quad, cells of grid space.
Result<std::vector<MesoPublished>> remeshPublished();

}  // namespace vcp
