// Dealing: the soup's triangles, on the finest level's lattice, into bins that fit memory.
#pragma once

#include <cstdint>
#include <functional>

#include "builder/ingest.h"
#include "builder/lattice/page_partition.h"
#include "builder/lattice_soup.h"
#include "builder/spill/record_bins.h"

namespace vcp {

/// What is dealt. The calling arena's threads do the work.
struct Dealing {
    const Soup& soup;
    const LatticeSnapper& snapper;
    PageGrid grid;  ///< grid of the finest level
    /// Called with the part of the soup that is read; false cancels. Any of the threads calls it.
    std::function<bool(double)> progress;
};

/// Chooses the bins: a single one where there are at most `limit` triangles, else by how many of them each page and its
/// surroundings need. Errors: Io, Cancelled.
Result<PagePartition> choosePartition(const Dealing& dealing, uint64_t limit);

/// Deals each triangle to the bins that its corners lie in, where their normals are found. `bins` are flushed. Errors:
/// Io, Cancelled.
Result<void> dealTriangles(const Dealing& dealing, const PagePartition& partition, RecordBins<LatticeTriangle>& bins);

}  // namespace vcp
