// Dealing: the soup's triangles, on the deepest level's lattice, into bins that fit memory; and which pages hold them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "builder/ingest.h"
#include "builder/lattice/finest_pages.h"
#include "builder/lattice_soup.h"
#include "builder/level/level_step.h"
#include "builder/spill/record_bins.h"

namespace vcp {

/// A page is parted into eight while it holds more triangles than this.
inline constexpr uint64_t kMostPageTriangles = 1 << 17;
/// A page stays whole where its parts together would name more than this times its triangles: where these are as large
/// as pages, parts help nobody.
inline constexpr double kMostGrowth = 1.5;

/// Where pages, of all levels together, hold fewer triangles than this in the mean, the base level is a coarser one:
/// each takes some hundred bytes by itself. So many pages are free.
inline constexpr uint64_t kLeastPageTriangles = 24, kFreePages = 64;

struct FinestPageChoice {
    FinestPages pages;
    /// First codes of pages and how many triangles each needs, ascending; empty where there are so few triangles that
    /// nothing was counted.
    std::vector<std::pair<uint64_t, uint64_t>> counts;
    /// Where the base level's pages are too sparse, how many levels coarser it should be; nothing is chosen then.
    uint32_t levelsLess = 0;
};

/// How pages are chosen. The calling arena's threads do the work.
struct PageChoosing {
    std::span<const SoupShare> soups;
    GridFrame frame;                       ///< frame of the base level
    uint32_t mostLevelsBelow;              ///< 0: all pages are the base level's
    bool mayBeCoarser;                     ///< whether another base level may be asked for
    double marginCells;                    ///< how far around it a page needs triangles
    uint64_t uncounted;                    ///< so few triangles need no count
    uint64_t mostPages;                    ///< so many pages can be counted
    std::function<bool(double)> progress;  ///< as Dealing's
};

/// Chooses the pages that hold the mesh. Errors: Io, Cancelled; Limit (more pages than can be counted; the message
/// lacks what to do).
Result<FinestPageChoice> choosePages(const PageChoosing& choosing);

/// What is dealt. The calling arena's threads do the work.
struct Dealing {
    std::span<const SoupShare> soups;
    const LatticeSnapper& snapper;
    PageGrid grid;  ///< grid of the deepest level
    /// Take triangles with images, by the pages that need them; null: there are none.
    RecordBins<TexturedTriangle>* textures;
    const FinestPages& pages;
    double marginCells;           ///< how far around a page it needs them
    std::atomic<uint64_t>& tiny;  ///< counts the triangles that are less than two steps of the lattice along each axis
    /// Called with the part of the soup that is read; false cancels. Any of the threads calls it.
    std::function<bool(double)> progress;
};

/// Deals each triangle to the bins that its corners lie in, where their normals are found. `bins` are flushed. Errors:
/// Io, Cancelled.
Result<void> dealTriangles(const Dealing& dealing, const PagePartition& partition, RecordBins<LatticeTriangle>& bins);

/// Returns what to say where so many of a mesh's triangles are `tiny` (Dealing) that it shows; none where they are few.
std::optional<std::string> tinyWarning(uint64_t tiny, uint64_t triangles, const GridFrame& frame);

}  // namespace vcp
