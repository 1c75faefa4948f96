// Pages that are built on all threads within a memory limit and handed on in their order.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "builder/spill/page_spool.h"

namespace vcp {

/// Calls work(0) to work(count - 1) from the calling arena's threads, which take them one by one, in order. Where one
/// fails no more are taken, and its error is returned.
Result<void> forEachInOrder(size_t count, const std::function<Result<void>(size_t)>& work);

/// A page that is built, and the surface in it from which the page above is made (storedSurface).
struct BuiltPage {
    PageEntry entry;
    StoredPage stored;
    StoredPage surface;
};

struct PageTasks {
    std::span<const uint64_t> work;  ///< bytes that each page needs while it is built
    uint64_t pageBytes = 0;          ///< memory for pages under construction
    uint64_t roomBytes = 0;          ///< memory that makeRoom frees besides, for a page that is built alone
    std::function<Result<void>()> makeRoom;
    std::function<Result<BuiltPage>(size_t)> build;  ///< called from any thread
    std::function<std::string(size_t)> description;  ///< what a page holds, for an error
    PageSpool& pages;                                ///< takes the pages that have leaves
    bool emptyToo = false;                           ///< it takes the others, too
    PageSpool* surfaces;                             ///< takes the surfaces that are not empty; may be null
    const std::function<bool(double)>& progress;     ///< is given the part done; false stops
};

/// Builds pages 0 to work.size() - 1. Uses the calling arena's threads. Errors: those of `build`; Limit (a single page
/// needs more memory than pageBytes and roomBytes), Io, Cancelled.
Result<void> buildInOrder(const PageTasks& tasks);

}  // namespace vcp
