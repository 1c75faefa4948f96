// The cameras of the benchmarks: the same for every method, from the mesh alone.
//
//   whole   all of the mesh in the picture
//   half    half as far
//   close   an eighth as far, at a point of the surface
//   cells   so near that a cell of the finest level is several pixels wide
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/mesh_bvh.h"
#include "render/camera.h"

namespace vcp {

/// How many pixels wide a finest cell is for the camera `cells`, at the point looked at.
inline constexpr double kCellsCameraPixels = 8;

/// The four names.
const std::vector<std::string>& benchCameraNames();

/// View `view` of `views`, from directions spread evenly over the sphere; view 0 looks along -z.
/// Nothing for an unknown name.
std::optional<Camera> benchCamera(std::string_view name, const MeshBvh& mesh, double cell, glm::ivec2 size, int view,
                                  int views);

}  // namespace vcp
