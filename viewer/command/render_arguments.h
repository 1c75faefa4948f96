// The arguments of `vcp render` and `vcp view` that say how a dataset is shown.
#pragma once

#include "viewer/command/commands.h"
#include "viewer/scene/render_settings.h"

namespace vcp {

void addRenderSettings(CLI::App& app, RenderSettings& settings);

}  // namespace vcp
