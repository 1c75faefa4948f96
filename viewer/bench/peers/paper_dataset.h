// The octree of paper_octree.h as a dataset in memory, for the renderer.
#pragma once

#include <memory>

#include "builder/paper/paper_octree.h"
#include "streaming/page_source.h"

namespace vcp {

/// A dataset of one page (octree/page/paper_page.h), in memory.
struct PaperDataset {
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;
};

/// Makes the dataset. `mesh`: what the octree was built from. Errors: those of paperFile.
Result<PaperDataset> paperDataset(const PaperCaster& octree, const IndexedMesh& mesh);

}  // namespace vcp
