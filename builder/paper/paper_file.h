// The octree of paper_octree.h as a .vcp file of the method `paper`.
#pragma once

#include "builder/build.h"
#include "builder/paper/paper_octree.h"
#include "octree/page_reader.h"

namespace vcp {

/// Returns an octree's page. `cellShift`: PaperPageHeader's. Errors: Limit where the page has over 256 MiB.
Result<PageBytes> paperPage(const CornerOctree& tree, PaperPacking packing, uint32_t cellShift = 0);

/// Returns what a file says of the octree's options.
PaperParameters parametersOf(const PaperOptions& options);

/// What such a file holds: one page (octree/page/paper_page.h).
struct PaperFile {
    FileHeader header;
    PageEntry entry;
    PageBytes page;
};

/// Makes the file's content. `mesh`: what the octree was built from. Errors: Limit where the page has over 256 MiB.
Result<PaperFile> paperFile(const PaperCaster& octree, const IndexedMesh& mesh);

/// Builds meshes into a .vcp file of the method `paper`: in subvolumes where these are asked for (paper_subvolumes.h).
/// Else it holds mesh and octree in memory; of `options` it uses inputs, output, cell, threads and progress. The
/// report's certified error is not a number. The bytes are the same for any number of threads. Errors: what loadMesh,
/// chooseFrame, PaperCaster::create, paperFile and VcpWriter say; Cancelled.
Result<BuildReport> buildPaperFile(const BuildOptions& options, const PaperOptions& paper);

}  // namespace vcp
