// The end of a build: the finished pages of all levels become one dataset.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "builder/ingest.h"
#include "builder/spill/page_spool.h"
#include "octree/io/output_file.h"
#include "octree/io/result.h"
#include "octree/vcp_file.h"

namespace vcp {

/// Returns what the mesh and the grid say about a dataset. `errorTarget`: world units.
FileHeader headerOf(const SoupMeasures& measures, const GridFrame& frame, double errorTarget, bool hasColour);

/// Links parents and children, and writes the file. A page without a parent gets one that only leads to it. `levels`:
/// pages of each level, coarse first, in any order; their entries go. `header`: that of headerOf; levels,
/// pages, leaves and certified errors are filled in. `images`: those of the file (image_store.h); may be null.
/// Where each page lies follows from the sizes of those before it, so the calling arena's threads copy them, whatever
/// comes first. `progress` is given the part done, from any thread; false cancels. Returns the file's bytes. Errors:
/// Io, InvalidInput (a page is damaged), Cancelled.
Result<uint64_t> assembleDataset(std::vector<JoinedSpools>& levels, FileHeader& header,
                                 const std::filesystem::path& output, const OutputRules& rules, const PageSpool* images,
                                 const std::function<bool(double)>& progress);

}  // namespace vcp
