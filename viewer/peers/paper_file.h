// The octree of paper_octree.h as a dataset of the method `paper`: for the renderer, and as a .vcp file.
#pragma once

#include <memory>

#include "builder/build.h"
#include "octree/vcp_file.h"
#include "streaming/page_source.h"
#include "viewer/peers/paper_octree.h"

namespace vcp {

/// A dataset of one page (octree/paper_page.h), in memory.
struct PaperDataset {
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;
};

/// `mesh`: what the octree was built from. Errors: Limit where the page would have more than 256 MiB.
Result<PaperDataset> paperDataset(const PaperCaster& octree, const IndexedMesh& mesh);

/// Builds meshes into a .vcp file of the method `paper`. Holds mesh and octree in memory; of `options` it heeds inputs,
/// output, cell, threads and progress. The report's certified error is not a number. The same bytes for any number of
/// threads. Errors: what loadMesh, chooseFrame, PaperCaster::create, paperDataset and VcpWriter say; Cancelled.
Result<BuildReport> buildPaperFile(const BuildOptions& options, const PaperOptions& paper);

}  // namespace vcp
