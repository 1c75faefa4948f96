// Manual pages, for `man vcp build`.
#pragma once

#include <string>

#include "viewer/command/manual/command_tree.h"

namespace vcp {

/// Returns the name of a command's page: "vcp-meso-build".
std::string manualName(const CommandEntry& command);

/// Returns the page in the macros of man(7), without the end of its last line. `version`: "vcp 0.1.0".
std::string manualPage(const CommandEntry& command, const std::string& version);

}  // namespace vcp
