// Options that may stand without a value: `--occlusion scan.vcp` is the option, and then a file.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace vcp {

/// Returns the words of a command line, without the program's name, with "--name=VALUE" in place of each option whose
/// value may be left out and that another word follows: that word, where it is a number or one of the values that the
/// option checks for, else the option's usual value. What is said with "=" stays as it is.
std::vector<std::string> withOptionalValues(CLI::App& vcp, const std::vector<std::string>& words);

}  // namespace vcp
