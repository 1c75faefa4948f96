// The arguments of `vcp render` and `vcp view` that say how a dataset is shown.
#pragma once

#include "viewer/command/commands.h"
#include "viewer/scene/render_settings.h"

namespace vcp {

/// Adds --camera and --up.
void addCameraSettings(CLI::App& app, RenderSettings& settings);

void addRenderSettings(CLI::App& app, RenderSettings& settings);

/// Adds --samples, with the value that there is as the default.
void addSamples(CLI::App& app, uint32_t& samples, const std::string& description);

}  // namespace vcp
