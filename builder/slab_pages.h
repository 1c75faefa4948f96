// The pages of a level whose leaves are slabs, each made from what is known of the surface in the pages below it.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "builder/level_pages.h"

namespace vcp {

/// A run of entries, numbers `first` to before `end`, of pages with one parent.
struct Siblings {
    size_t first, end;
};

/// Returns the pages of a spool by their parents, in Morton order.
std::vector<Siblings> siblingsIn(const PageSpool& spool);

/// Appends the surfaces of some pages to another spool, coded. Errors: Io, InvalidInput (damaged).
Result<void> keepSurfaces(const PageSpool& below, Siblings siblings, PageSpool& kept);

/// Builds the pages above those whose surfaces are in `below`. `parents`: some of siblingsIn(below). Appends pages to
/// `pages` and, where that is not null, their surfaces to `surfaces`. `progress`, threads and errors are those of
/// buildPages.
Result<void> buildSlabPages(const LevelSettings& settings, const PageSpool& below, std::span<const Siblings> parents,
                            PageSpool& pages, PageSpool* surfaces, const std::function<bool(double)>& progress);

}  // namespace vcp
