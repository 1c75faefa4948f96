// Which pages the rays of one view hit: what lies behind others is not refined for it (page_selection.h). Pure.
//
// Rays report, frame by frame, the pages of the cut that they hit; where a page is drawn in place of a finer one, they
// ask for that one. What was hit or asked for counts, and so does all above it, as long as the view stays as it is:
// otherwise what is hit no more once it is finer would be drawn coarse, hit, and be refined again. When the view
// changes, what counted is a guess, until a frame of the new view is heard.
//
// A page covers the surface of those below it (kFlagCovering), so a ray that misses it there misses them. Hence what a
// ray passes on its way to a hit it passes however fine that is, and what rays ask for only grows as pages are refined:
// it comes to the same pages, the least that are enough, whatever the order in which pages arrive and frames are drawn.
// A ray that begins inside a page may miss it and hit what is below: such a page counts as hit.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "octree/dataset_reader.h"

namespace vcp {

/// The pages that the rays of one frame hit, or begin in, and those that they would have hit in the place of coarser
/// ones.
struct PagesHit {
    std::vector<uint64_t> byCamera;  ///< by rays of the picture, and of what looks through its section planes
    std::vector<uint64_t> byLight;   ///< by rays of shadows and occlusion
};

class PagesSeen {
public:
    [[nodiscard]] bool contains(uint64_t page) const { return seen_.contains(page) || guess_.contains(page); }
    /// The view changed.
    void begin();
    /// Takes in pages that a frame of the view hit, and drops the guess. Returns whether contains() changed.
    bool add(const Dataset& dataset, const std::vector<uint64_t>& pages);
    /// Takes pages that a frame of an earlier view hit as the guess, in place of the one before, until add() is called.
    void guess(const Dataset& dataset, const std::vector<uint64_t>& pages);
    void dropGuess() { guess_.clear(); }
    /// Whether a frame of the view was taken in.
    [[nodiscard]] bool isHeard() const { return isHeard_; }
    /// Approximate bytes of memory that this object takes.
    [[nodiscard]] uint64_t bytesHeld() const;

private:
    std::unordered_set<uint64_t> seen_, guess_;
    bool isHeard_ = false;
};

}  // namespace vcp
