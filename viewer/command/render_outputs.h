// Which picture goes where, where `vcp render` makes one of each input.
#pragma once

#include <string>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

/// Whether an output stands for a picture of each input: it has "{}" in it, ends in "/", or is a folder.
bool isForEachInput(const std::string& output);

/// Returns the file for an input: "{}" becomes its name, without folder and endings, "scan" of "a/scan.ply.gz"; in a
/// folder it is NAME.png.
std::string outputFor(const std::string& output, const std::string& input);

/// Returns the file for each input. Errors: Usage, where two would be the same.
Result<std::vector<std::string>> outputsFor(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace vcp
