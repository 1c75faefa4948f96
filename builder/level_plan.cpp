#include "builder/level_plan.h"

#include <cmath>

namespace vcp {

namespace {

// Soft leaves of coarser levels may err by this many of their cells; they are seen where a cell is about a
// pixel.
constexpr double kCoarseErrorCells = 0.12;

}  // namespace

PagePartition LevelPlan::partitionOf(int level) const {
    PagePartition partition = finest;
    for (int l = levels() - 1; l > level; --l) partition = partition.coarser();
    return partition;
}

void LevelPlan::setPages(const GridFrame& base, FinestPages finestPages) {
    frame = base.withLevelsBelow(finestPages.deepest() - finestPages.base());
    pages = std::move(finestPages);
}

LevelSettings LevelPlan::settingsOf(int level, bool isFinest) const {
    LevelSettings settings;
    settings.grid = gridOf(level);
    settings.finest = isFinest;
    settings.exact = settings.finest && isExact;
    settings.cell = std::ldexp(frame.cell, levels() - 1 - level);
    settings.tolerance = settings.finest ? errorTarget / settings.cell : kCoarseErrorCells;
    settings.pageBytes = pageBytes;
    return settings;
}

double LevelPlan::timeBefore(int pass) const { return 1 - std::pow(1.0 / 3, double(frame.levels) - 1 - pass); }

}  // namespace vcp
