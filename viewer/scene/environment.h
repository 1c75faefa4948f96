// The surroundings whose light falls on what is shown.
#pragma once

#include <string>

#include "octree/io/result.h"
#include "render/frame_request.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

/// Whether a file is a picture of surroundings, by its name: it ends in .hdr or .exr.
bool isEnvironmentName(const std::string& name);

/// Reads the picture of surroundings, or makes those of a name (kEnvironmentNames). Errors: those of
/// readRadiancePicture; InvalidInput, where it is black.
Result<EnvironmentLight> openEnvironment(const EnvironmentChoice& choice);

/// Whether a scene has lights or surroundings of its own.
bool hasOwnLight(const OpenedScene& scene);

/// Sets the lights of a scene, and its surroundings; what it does not have is as in `usual`. Beside surroundings only a
/// scene's own lights are on.
void setSceneLight(Shading& shading, const OpenedScene& scene, const Shading& usual);

}  // namespace vcp
