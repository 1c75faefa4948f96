// Dealing: the soup's triangles, on the finest level's lattice, into bins that fit memory.
#pragma once

#include <cstdint>
#include <functional>

#include "builder/ingest.h"
#include "builder/lattice/page_partition.h"
#include "builder/lattice_soup.h"
#include "builder/spill/record_bins.h"

namespace vcp {

/// What is dealt. The calling arena's threads work.
struct Dealing {
    const Soup& soup;
    const LatticeSnapper& snapper;
    PageGrid grid;  ///< of the finest level
    /// Given the part of the soup that is read; false cancels. Called from any of the threads.
    std::function<bool(double)> progress;
};

/// The bins: one where all triangles are at most `limit`, else by how many of them each page needs, and what lies
/// around it. Errors: Io, Cancelled.
Result<PagePartition> choosePartition(const Dealing& dealing, uint64_t limit);

/// Deals each triangle to the bins that its corners lie in: that is where their normals are found. `bins` are flushed.
/// Errors: Io, Cancelled.
Result<void> dealTriangles(const Dealing& dealing, const PagePartition& partition, RecordBins<LatticeTriangle>& bins);

}  // namespace vcp
