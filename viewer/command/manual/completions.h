// What shells complete after `vcp`: commands, options, the words that an option takes, files and folders.
#pragma once

#include <array>
#include <string>

#include "viewer/command/manual/command_tree.h"

namespace vcp {

inline constexpr std::array<const char*, 3> kShells{"bash", "zsh", "fish"};

/// Returns the script that the shell reads. `shell`: one of kShells.
std::string completions(const CommandEntry& root, const std::string& shell);

}  // namespace vcp
