// The end of a build: the finished pages of all levels become one dataset.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>

#include "builder/ingest.h"
#include "builder/spill/page_spool.h"
#include "octree/io/output_file.h"
#include "octree/io/result.h"
#include "octree/vcp_file.h"

namespace vcp {

/// Returns what the mesh and the grid say about a dataset. `errorTarget`: world units.
FileHeader headerOf(const SoupMeasures& measures, const GridFrame& frame, double errorTarget, bool hasColour);

/// Links parents and children, and writes the file. A page without a parent gets one that only leads to it. `levels`:
/// pages of each level, coarse first, in any order; entries are completed. `header`: that of headerOf; levels,
/// pages, leaves and certified errors are filled in. `images`: those of the file (image_store.h); may be null.
/// `progress` is given the part done; false cancels. Returns the file's bytes. Errors: Io, Cancelled.
Result<uint64_t> assembleDataset(std::deque<PageSpool>& levels, FileHeader& header, const std::filesystem::path& output,
                                 const OutputRules& rules, const PageSpool* images,
                                 const std::function<bool(double)>& progress);

}  // namespace vcp
