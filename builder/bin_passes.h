// What is done with one bin of the finest level: by a whole build, and by a part of one (parts/build_parts.h).
#pragma once

#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "builder/build.h"
#include "builder/level/closed_parts.h"
#include "builder/level_plan.h"
#include "builder/memory_plan.h"
#include "builder/spill/page_spool.h"
#include "octree/vcp_file.h"

namespace vcp {

/// Which colours of the inputs a build keeps.
struct ColourUse {
    bool vertices = false, materials = false;
    [[nodiscard]] bool any() const { return vertices || materials; }
};
ColourUse colourUseOf(const BuildOptions& options, const SoupMeasures& measures);

/// Whether there are images to keep, as far as is known before they are read. `materials`: of all inputs.
bool mayKeepImages(const BuildOptions& options, const SoupMeasures& measures, std::span<const Material> materials);

/// Returns how many threads a build uses.
unsigned threadsOf(const BuildOptions& options);
/// Divides the memory that a build may take. Errors: planMemory's.
Result<MemoryPlan> memoryOf(const BuildOptions& options);

/// Returns the levels of a mesh, with pages of one level at their bottom, and a single bin. Errors: those of
/// chooseFrame and chooseError.
Result<LevelPlan> planLevels(const BuildOptions& options, const SoupMeasures& measures, uint32_t levelsLess);

/// Makes the mesh of a bin from all triangles at its vertices: what is thin is kept, normals and parts are found, and
/// the latter noted in `parts`. Uses the calling arena's threads. Errors: Io.
Result<LatticeMesh> meshWithNormals(const LevelPlan& plan, std::vector<LatticeTriangle> soup, size_t bin,
                                    bool withColour, PartNotes& parts);

/// Builds the pages that hold a bin's mesh, from code `first` to before `end`, on whatever levels they are. Leaves
/// `mesh` on the lattice of their coarsest level. `settings`: those of a level. `pages`, `surfaces`: as buildPages
/// takes them, by level; no surfaces where these are empty. `pass`: the pass that builds them. Errors: buildPages'.
struct BinPages {
    int pass;
    uint64_t first, end;
    std::function<LevelSettings(int level)> settings;
    std::deque<PageSpool>& pages;
    std::deque<PageSpool>& surfaces;
    std::function<bool(double)> progress;
};
Result<void> buildBinPages(const LevelPlan& plan, LatticeMesh& mesh, const BinPages& bin);

/// Returns the header of a dataset, but for what assembleDataset fills in.
FileHeader headerOf(const LevelPlan& plan, const SoupMeasures& measures, bool hasColour, const PartCounts& parts);

/// Takes over what the header of a finished dataset says.
void describe(const FileHeader& header, BuildFigures& figures);

/// Returns the most memory that this process had so far.
uint64_t peakRssBytes();

}  // namespace vcp
