// The arguments of `vcp` for datasets on servers.
#pragma once

#include "viewer/command/commands.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

void addSourceSettings(CLI::App& app, SourceAccess& settings);

}  // namespace vcp
