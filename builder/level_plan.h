// The passes of a build over its levels, finest first: the grid, the bins and the settings that each works with.
//
// Pass `levels` steps from the snapped triangles to the pages that hold the mesh; pass levels - 1 builds these, on
// whatever levels they are; pass l of those after it builds level l's pages, from its own bins or, where they are
// slabs, from the pages below; pass 0 is the last.
#pragma once

#include "builder/ingest.h"
#include "builder/lattice/finest_pages.h"
#include "builder/level/level_step.h"
#include "builder/level_pages.h"
#include "builder/page/exact_tree.h"

namespace vcp {

struct LevelPlan {
    GridFrame frame;
    FinestPages pages;       ///< those that hold the mesh
    PagePartition finest;    ///< bins of the deepest level
    double errorTarget = 0;  ///< tolerance of the finest level, world units
    bool isExact = true;     ///< whether the finest level has the mesh's triangles
    bool hasSlabs = false;   ///< whether coarser levels are slabs, made from the pages below and not from bins
    uint64_t pageBytes = 0;  ///< memory for a bin's mesh and its pages

    [[nodiscard]] int levels() const { return int(frame.levels); }
    /// Whether a pass steps to the next coarser level's bins.
    [[nodiscard]] bool steps(int pass) const { return pass > 0 && (!hasSlabs || pass == levels()); }
    /// Whether a pass makes its pages from those below.
    [[nodiscard]] bool isOfSlabs(int pass) const { return hasSlabs && pass + 1 < levels(); }
    /// Returns the level whose grid and bins a pass works on.
    [[nodiscard]] int levelOf(int pass) const { return pass < levels() ? pass : levels() - 1; }
    [[nodiscard]] PageGrid gridOf(int level) const { return {frame.log2Cells, uint32_t(level)}; }
    [[nodiscard]] PagePartition partitionOf(int level) const;
    /// Sets which pages hold the mesh. `base`: the frame whose finest level is their base level.
    void setPages(const GridFrame& base, FinestPages finestPages);
    /// Returns a level's settings, without the room that temporary files can make. `isFinest`: for its pages that hold
    /// the mesh.
    [[nodiscard]] LevelSettings settingsOf(int level, bool isFinest) const;
    /// How far around a page it needs triangles, in cells, while they are dealt.
    [[nodiscard]] double marginCells() const { return hasSlabs ? kExactMarginCells : kStepMarginCells; }
    /// Returns the first code after the pages of bin `bin` of a level's partition.
    [[nodiscard]] static uint64_t endOf(const PagePartition& partition, size_t bin, int level) {
        return bin + 1 < partition.bins() ? partition.first()[bin + 1] : uint64_t{1} << 3 * level;
    }
    /// Share of all passes' time before this one, the first not counted: each takes about a third of the one before.
    [[nodiscard]] double timeBefore(int pass) const;
};

}  // namespace vcp
