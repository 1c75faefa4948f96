// Compares the ray benchmark's rows with what Demir and Westermann 2015 published: bytes (their Table 1), time (Table
// 2) and, in numbers, picture quality at about equal bytes (Fig. 11), as ratios to their own method.
#pragma once

#include <string>

namespace vcp {

struct BenchRaysReport;

/// Returns a Markdown section; empty where no model has the rows for it: paper at eps 0.25, sdf at cell 1, and voxel at
/// cell 0.5 or svo-contours at cell 1, the resolutions of their Table 1.
std::string besidePaperMarkdown(const BenchRaysReport& report);

}  // namespace vcp
