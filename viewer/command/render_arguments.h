// The arguments that say how a dataset is shown: of `vcp render` and `vcp view`.
#pragma once

#include "viewer/command/commands.h"
#include "viewer/scene/render_settings.h"

namespace vcp {

void addRenderSettings(CLI::App& app, RenderSettings& settings);

}  // namespace vcp
