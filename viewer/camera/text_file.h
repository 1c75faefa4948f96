// Reads small files of text that a person names.
#pragma once

#include <filesystem>
#include <string>

#include "octree/io/result.h"

namespace vcp {

/// Returns all of a file of at most `most` bytes, or of a pipe that a shell opened for this program (/dev/stdin,
/// /dev/fd/N). Any other pipe is refused, since it may never have a writer. `what` it should be, for errors: "a scene
/// file". `unopened`: what is said of a file that cannot be opened. Errors: Io; Limit.
Result<std::string> readText(const std::filesystem::path& path, size_t most, const std::string& what,
                             const std::string& unopened = "cannot be opened");

}  // namespace vcp
