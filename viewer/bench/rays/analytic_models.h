// Meshes of shapes whose answer is known: the ray benchmark measures them where no model is named.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "builder/measure/indexed_mesh.h"
#include "octree/io/result.h"

namespace vcp {

/// The shapes are about 2 world units across; with cells of this edge, 128 of them go across the sphere.
inline constexpr double kAnalyticModelCell = 1.0 / 64;

struct AnalyticModel {
    std::string name;
    IndexedMesh mesh;
};

/// Returns `sphere`, `torus` (both so finely tessellated that they err by less than 0.002 cell), and `plate`: a box
/// turned against the axes and 0.4 cell thick. All are closed and oriented outwards.
std::vector<AnalyticModel> analyticModels();

/// Writes all of them into `folder` and returns their files. Errors: Io.
Result<std::vector<std::filesystem::path>> writeAnalyticModels(const std::filesystem::path& folder);

/// Writes a binary PLY with double coordinates. Errors: Io.
Result<void> writePly(const IndexedMesh& mesh, const std::filesystem::path& path);

}  // namespace vcp
