// The arguments of `vcp` for datasets on servers.
#pragma once

#include "viewer/command/commands.h"
#include "viewer/scene/source_settings.h"

namespace vcp {

void addSourceSettings(CLI::App& app, SourceSettings& settings);

}  // namespace vcp
