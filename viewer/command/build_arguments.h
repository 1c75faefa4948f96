// The arguments that say how a mesh is built, and what a person is told while it is.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "builder/build.h"
#include "viewer/command/commands.h"
#include "viewer/command/progress_display.h"
#include "viewer/scene/build_settings.h"
#include "viewer/scene/dataset_opening.h"
#include "viewer/scene/source_settings.h"

namespace vcp {

void addBuildSettings(CLI::App& app, BuildSettings& settings);

/// What a display is told of a build.
ProgressDetails detailsOf(const BuildProgress& at);

/// Shows a build's progress on stderr until the function goes; the function is false once Ctrl-C came.
std::function<bool(const BuildProgress&)> shownProgress(ProgressStyle style);

/// openScene with its progress on stderr, cancelled by Ctrl-C.
Result<OpenedScene> openSceneShown(const std::vector<std::string>& inputs, const BuildSettings& build,
                                   const SourceSettings& source, ProgressStyle style);

}  // namespace vcp
