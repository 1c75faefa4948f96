// Materials on their way from the part that read a mesh to those that need its colours. Images that the mesh holds go
// along, in a file of the part.
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "builder/spill/temp_space.h"
#include "builder/stream/material.h"
#include "octree/io/result.h"

namespace vcp {

/// Returns what to record of materials. Writes the images that they hold to `space`, durably. Errors: Io.
Result<nlohmann::json> recordMaterials(const std::vector<Material>& materials, TempSpace& space);

/// Returns the materials that were recorded; `space` is that of the part. Without `withImages`, images that the mesh
/// holds are empty. Errors: Io; InvalidInput (damaged).
Result<std::vector<Material>> recordedMaterials(const nlohmann::json& recorded, TempSpace& space, bool withImages);

}  // namespace vcp
