// The first stages of a build, for those that go on in parts (parts/build_parts.h).
#pragma once

#include <filesystem>

#include "builder/build.h"
#include "octree/io/result.h"

namespace vcp {

/// Returns how many threads a build uses.
unsigned threadsOf(const BuildOptions& options);

/// Reads the inputs and deals their triangles into bins in `folder`, which is made. Its journal then says what a
/// checkpoint of a build says before the first bin; besides, "first bins": the first bin of each of `parts` parts, and
/// the number of bins; and "warnings". Errors: buildOctree's; then `folder` is the caller's to remove.
Result<void> buildUntilDealt(const BuildOptions& options, const std::filesystem::path& folder, unsigned parts);

}  // namespace vcp
