// The cameras of the benchmarks: the same for every method, made from the mesh alone.
//
//   whole   all of the mesh in the picture
//   half    half as far
//   close   an eighth as far, at a point of the surface
//   cells   so near that a cell of the finest level is several pixels wide
//
// And two that look for holes:
//
//   lattice   parallel rays along axes and diagonals of the cells: every fourth ray runs in walls, edges and corners of
//             cells, subvolumes and levels
//   grazing   along the surface, from a few cells above a point of it
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/measure/mesh_bvh.h"
#include "render/camera.h"

namespace vcp {

/// How many pixels wide a finest cell is for the camera `cells`, at the point looked at.
inline constexpr double kCellsCameraPixels = 8;

/// How many pixels wide a finest cell is where a dive ends.
inline constexpr double kDiveCellPixels = 200;

/// Returns the names; the first four are those of a comparison.
const std::vector<std::string>& benchCameraNames();

/// A grid's corners: world position of one, and the edge of a cell.
struct CellGrid {
    glm::dvec3 origin{0};
    double cell = 1;
};

/// Returns view `view` of `views`, from directions spread evenly over the sphere; view 0 looks along -z. `lattice`
/// takes its directions in turn: 6 axes, 12 diagonals of faces, 8 of the cube. Returns nothing for an unknown
/// name.
std::optional<Camera> benchCamera(std::string_view name, const MeshBvh& mesh, const CellGrid& grid, glm::ivec2 size,
                                  int view, int views);

/// Returns the steps of a dive from `whole` to where a cell is kDiveCellPixels wide, at the point that `cells` looks
/// at: what is looked at moves there from the middle, and the distance shrinks by the same factor from step to step.
std::vector<Camera> diveCameras(const MeshBvh& mesh, const CellGrid& grid, glm::ivec2 size, int steps, int view,
                                int views);

}  // namespace vcp
