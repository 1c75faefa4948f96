// Pictures of one scene, one for each method of mesostructure, side by side: `vcp render --methods`.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "render/picture_renderer.h"
#include "viewer/command/commands.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

/// What one method showed and cost.
struct MethodPanel {
    std::string method;
    Picture picture;
    FrameStats stats;
    double msPerFrame = 0;                 ///< median
    std::optional<double> iterationsMean;  ///< over all pixels, where it was asked for
};

/// Makes the surfaces of a scene as if it named `method` for each. Errors: those of makeMesoScene.
Result<MesoScene> surfacesBy(const std::string& method, SceneFile scene, const SurfaceProgress& progress);

/// Reads back what was drawn last. Errors: those of the renderer.
Result<MethodPanel> readPanel(PictureRenderer& renderer, const std::string& method, bool withIterations,
                              const FrameStats& stats, double msPerFrame);

/// Puts pictures of one size beside each other, the first on the left. Precondition: there is one.
Picture sideBySide(std::span<const MethodPanel> panels);

Json toJson(const MethodPanel& panel);
/// Returns one line about it.
std::string summary(const MethodPanel& panel);

}  // namespace vcp
