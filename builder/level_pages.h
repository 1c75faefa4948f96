// The pages of one bin: built by all threads, handed on in Morton order.
#pragma once

#include <functional>

#include "builder/ingest.h"
#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice/page_partition.h"
#include "builder/ordered_pages.h"
#include "builder/page/bin_triangles.h"
#include "builder/page/page_encoder.h"
#include "builder/slab/page_surface.h"

namespace vcp {

/// The settings that all pages of a level share.
struct LevelSettings {
    PageGrid grid;
    double cell = 0;       ///< world units
    double tolerance = 0;  ///< in cells, for soft leaves; the finest level's includes the stray
    bool finest = false;
    bool withColour = false;
    bool exact = false;         ///< leaves hold the mesh's triangles, whatever the tolerance
    bool codesSurface = false;  ///< temporary files take less for the surface in the pages
    uint64_t pageBytes = 0;     ///< memory for the mesh and pages under construction
    uint64_t roomBytes = 0;     ///< memory that makeRoom frees besides, for a page that is built alone
    std::function<Result<void>()> makeRoom;

    /// Has pages built beside the temporary files of `space`, which may have so much in memory. It outlives this.
    void buildBeside(TempSpace& space, uint64_t tempBytes);
};

/// Returns a page of the level at a Morton code, coded, with its entry; without its surface. Errors: InvalidInput (it
/// holds more than a page can name).
Result<BuiltPage> builtPage(const LevelSettings& settings, uint64_t code, const EncodedPage& encoded);

/// Returns what a page hands up to the page above it, as temporary files keep it.
StoredPage surfaceToHandUp(const LevelSettings& settings, PageSurface surface);

/// Builds the pages of `bins`, numbers in the bin's mesh, and appends those with surface to `spool`; where `surfaces`
/// is not null, it takes the surface in each page, from which the level above is made (slab_pages.h). `progress` is
/// given the part done; false stops. Uses the calling arena's threads. Errors: Limit (a single page needs more memory
/// than pageBytes and roomBytes, or holds more than a page can name), Io, Cancelled.
Result<void> buildPages(const LevelSettings& settings, const LatticeMesh& mesh, const TriangleBins& bins,
                        PageSpool& spool, PageSpool* surfaces, const std::function<bool(double)>& progress);

}  // namespace vcp
