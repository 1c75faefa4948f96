// The arguments of `vcp` for datasets on servers.
#pragma once

#include "viewer/commands.h"
#include "viewer/source_settings.h"

namespace vcp {

void addSourceSettings(CLI::App& app, SourceSettings& settings);

}  // namespace vcp
