// The pages of a level whose leaves are slabs, each made from what is known of the surface in the pages below it.
#pragma once

#include <functional>

#include "builder/level_pages.h"
#include "builder/slab/page_surface.h"

namespace vcp {

/// Returns a page's surface as its spool takes it: cells as `geometry`, halves as `colour`.
StoredPage storedSurface(const PageSurface& surface);

/// Builds the pages of a level above those whose surfaces are in `below`, from number `first` to before `end` among the
/// parents that there are, in Morton order. Appends pages to `pages` and their surfaces to `surfaces`. `progress`,
/// threads and errors are those of buildPages.
Result<void> buildSlabPages(const LevelSettings& settings, const PageSpool& below, size_t first, size_t end,
                            PageSpool& pages, PageSpool& surfaces, const std::function<bool(double)>& progress);

/// Returns how many pages have one of these below them.
size_t parentsOf(const PageSpool& below);

}  // namespace vcp
