// Cameras of a sequence of pictures: a turntable, or a path through given cameras. Pure.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "octree/io/result.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

/// Returns `count` cameras once around: `from`, turned about its up axis through `pivot`.
std::vector<OrbitCamera> turntable(const OrbitCamera& from, glm::dvec3 pivot, int count);

/// Returns `count` cameras from the first of `keys` to the last, at equal times between each two: a Catmull-Rom spline
/// of what they look at, the logarithm of the distance to it, and the orientation, straight at both ends. So two
/// cameras are joined by a straight line, and cameras about one point by an arc. The projection is that of the key
/// before. Precondition: there is a key.
std::vector<OrbitCamera> cameraPath(std::span<const OrbitCamera> keys, int count);

/// Reads a JSON array of what cameraToJson writes, 1 to 10000. `name` stands for the file in errors. The text may be
/// hostile. Errors: InvalidInput.
Result<std::vector<OrbitCamera>> camerasFromJson(std::string_view text, const std::string& name);

/// Does camerasFromJson of a file of at most 64 MiB. Errors: also Io.
Result<std::vector<OrbitCamera>> readCameras(const std::filesystem::path& path);

}  // namespace vcp
