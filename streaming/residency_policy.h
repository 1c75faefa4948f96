// Decides which pages of a dataset are in the pool, where, and which are wished for. Pure: no threads, no clock, no
// GPU; a round's outcome depends on the views, the pages that were placed, the time it is told, and nothing else.
//
// A round, one for each update of a view:
//
//   policy.look(view, seconds);              // what the views want
//   for each page that was read:
//       placement = policy.place(page);      // makes room: evicts what is not wanted, moves pages together
//       carry out placement.moves, then write the page into placement.slot
//   outcome = policy.finish();               // what can be drawn, what to read next
//
// Several views, each with a number of its own, share the pool: what any of them wanted in its last look() is wanted
// (page_selection.h), until forgetView().
//
// Rules:
// - A page's units are counted once, in the pool's; what the views want always fits into the pool at once, with
//   its fragments moved together. So all still views settle, on pages that depend on the views, the pool's
//   size and the pages that cannot be read, and not on what was there before.
// - Parents before children; children are evicted before parents; what a view wants is not evicted, so
//   still views load no page twice. The coarsest page is wanted by all views.
// - Hysteresis: while a view moves, a page that came less than kSettlingSeconds ago is not evicted
//   for another, and pages that would need its place are not wished for.
// - Where the directory comes in parts, views wish for the blocks that they must know, before all pages but the
//   coarsest. What has come counts from the next look() on. A view whose pages may have children that are not
//   known has not settled.
// - While a view moves, what it would want a little later (its motion continued for kAheadSeconds) is
//   wished for last, and only into places that are free or hold what no view wants.
// - Where pages cover the surface of those below them, a view wants what its rays hit (pages_seen.h), as see() is told
//   after each frame. Where the pool has no room for that, views want all that is in their frustum, so that what they
//   settle on does not depend on what was there before; views that stand still again are asked anew. So they do where
//   all that takes few bytes a pixel: asking would cost more time than reading.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <tuple>
#include <vector>

#include "octree/dataset_reader.h"
#include "streaming/load_order.h"
#include "streaming/page_selection.h"
#include "streaming/request.h"
#include "streaming/slot_allocator.h"

namespace vcp {

inline constexpr double kSettlingSeconds = 0.5;
inline constexpr double kAheadSeconds = 0.2;
/// Where pages take no more bytes for each pixel of the views, rays are not asked which of them they hit.
inline constexpr double kFewBytesAPixel = 32;

/// Identifies a view among those that share a pool.
using ViewNumber = uint32_t;

/// A pool of slots of kPoolUnitBytes, in chunks that no slot crosses.
struct PoolShape {
    uint64_t units = 0, unitsPerChunk = 0;
};

/// Returns the largest useful pool within a budget: never more bytes, and no more than the dataset can fill; where only
/// part of its directory is known, no more than kMostGrowth times the file's bytes and a unit a page.
PoolShape poolShapeFor(const Dataset& dataset, bool withColour, uint64_t budgetBytes, uint64_t chunkBytes);

inline constexpr uint64_t kMostGrowth = 8;

/// Returns the units of a page: its geometry and, where asked for, its colour behind it, in one slot.
uint64_t pageUnits(const PageEntry& page, bool withColour);

struct PageMove {
    uint64_t page = 0;
    PoolSlot from, to;  ///< both in one chunk; they may overlap; `to` is the lower one
};

struct Placement {
    std::vector<PageMove> moves;   ///< to be carried out in this order, even where there is no slot
    std::optional<PoolSlot> slot;  ///< nothing: there is no place for the page now, or it has a place already
};

struct PolicyCounts {
    uint64_t loads = 0, evictions = 0, moves = 0;
    uint64_t unitsLoaded = 0, unitsMoved = 0;
    uint64_t refused = 0;  ///< pages that were read and had no place
    uint64_t reloads = 0;  ///< pages placed twice while the view stood still: must stay 0
};

struct PolicyOutcome {
    DrawableCut drawable;      ///< what this view draws
    std::vector<Wish> wishes;  ///< of all views
    uint64_t missing = 0;      ///< pages that some view wants and that are not resident
};

class ResidencyPolicy {
public:
    /// `pool` is made by poolShapeFor. `order` decides what is read first, and nothing else. `hiddenToo`: views want
    /// what no ray hits, too, also where pages cover what is below them.
    ResidencyPolicy(std::shared_ptr<const Dataset> dataset, bool withColour, PoolShape pool,
                    LoadOrder order = LoadOrder::Feedback, bool hiddenToo = false);

    /// Whether the coarsest page fits into the pool.
    [[nodiscard]] bool hasRoom() const { return !pageUnits_.empty() && pageUnits_[0] <= planned_; }

    /// Says what a view sees. `seconds`: the time on any clock; never less than before.
    void look(const SelectionView& view, double seconds, ViewNumber number = 0);
    /// Forgets a view that is gone.
    void forgetView(ViewNumber number);
    /// Takes in what the rays of a frame of `view` met: the pages they ask for are wished for first.
    void hear(const RayFeedback& feedback, const SelectionView& view) {
        priorities_.hear(feedback, view, views_.size());
    }
    /// Takes in which pages the rays of a frame hit, and where they began: a frame of `view`, which is what that view
    /// saw at its last look() or before. What it asks for is wanted from the next look() on.
    void see(const PagesHit& hit, const SelectionView& view, ViewNumber number = 0);
    /// Whether pages that rays ask for are there, or cannot be read: what rays hit is then known for good.
    [[nodiscard]] bool hasAll(const std::vector<uint64_t>& pages) const;
    Placement place(uint64_t page);
    /// Returns what the view can draw and what to read. Precondition: hasLooked(number).
    [[nodiscard]] PolicyOutcome finish(ViewNumber number = 0) const;
    [[nodiscard]] DrawableCut drawable(ViewNumber number) const;

    /// The page, or the pages of the directory's block, cannot be read: from the next look() their parents are drawn in
    /// their place. True the first time.
    bool giveUp(Request request);
    /// It can be read after all.
    void restore(Request request);
    /// Forgets all pages, because the pool's content was lost.
    void clear();
    /// Sets another pool, which is empty; from the next look() on, views want what fits into it. Forgets all pages, but
    /// not which of them cannot be read.
    void setPool(PoolShape pool);
    [[nodiscard]] bool hasLooked(ViewNumber number = 0) const { return motions_.contains(number); }
    /// Whether a view moved when it was last looked at.
    [[nodiscard]] bool isMoving() const { return moving_; }
    /// A counter that grows with each change that can affect a cut or a page's place.
    [[nodiscard]] uint64_t version() const { return version_; }
    /// Approximate bytes of memory that this takes at most: bounded by the dataset, whatever the number of rounds.
    [[nodiscard]] uint64_t bytesHeld() const;

    [[nodiscard]] bool isResident(uint64_t page) const { return resident_[page] != 0; }
    /// Returns a page's slot. Precondition: isResident(page).
    [[nodiscard]] PoolSlot slotOf(uint64_t page) const { return slots_.at(page).slot; }
    [[nodiscard]] uint64_t unitsTaken() const { return allocator_.unitsTaken(); }
    [[nodiscard]] size_t pagesResident() const { return slots_.size(); }
    /// Calls visit(page) for every resident page, ascending.
    template <class Visit>
    void forEachResident(Visit&& visit) const {
        for (const auto& [page, resident] : slots_) visit(page);
    }
    [[nodiscard]] const PolicyCounts& counts() const { return counts_; }

private:
    enum class Rank : uint8_t { Stale, Ahead, Wanted };
    struct Resident {
        PoolSlot slot;
        uint64_t lastWanted = 0;  // a round's number
        double loaded = 0;        // in seconds
    };
    struct Evictable {
        Rank rank;
        uint64_t lastWanted, page;

        /// Orders by what goes later: the least wanted goes first, then what was wanted longest ago; deeper levels come
        /// later in the directory.
        bool operator<(const Evictable& other) const {
            return std::tuple(other.rank, other.lastWanted, page) < std::tuple(rank, lastWanted, other.page);
        }
    };
    struct Motion {
        SelectionView view;
        double seconds = 0;                  // time of the last look
        std::optional<SelectionView> later;  // where the view will be, while it moves
        bool moves = false;
        PagesSeen seen;
    };
    [[nodiscard]] Rank rankOf(uint64_t page) const { return ranks_[page]; }
    /// Whether a page may go to make room for one of rank `forRank`.
    [[nodiscard]] bool mayEvict(uint64_t page, const Resident& resident, Rank forRank) const;
    bool evictOne(Rank forRank);
    void evict(uint64_t page);
    bool gather(uint64_t units, uint64_t most, std::vector<PageMove>& moves);
    void planFor(PoolShape pool);
    void learnBlocks();
    void choose();
    [[nodiscard]] PageChoice chosenFor(std::span<const SelectionView> views) const;
    /// Chooses what views_ want, and whether that depends on rays.
    void chooseForViews();
    /// What a view's rays hit; null: all pages count as hit.
    [[nodiscard]] const PagesSeen* seenBy(const Motion& motion) const {
        return asksRays_ && !wantsHidden_ ? &motion.seen : nullptr;
    }
    /// Has views want only what rays hit, as far as there is room.
    void askAgain();
    [[nodiscard]] std::span<uint8_t> statesOf(Request request);
    void wishForBlocks(const std::vector<uint64_t>& awaited, double urgency, std::set<uint64_t>& blocks,
                       std::vector<Wish>& wishes) const;
    [[nodiscard]] uint64_t unitsWithin(Rank forRank) const;

    std::shared_ptr<const Dataset> dataset_;
    SlotAllocator allocator_;
    SparseArray<uint64_t> pageUnits_;  // 0: the page's entry is not known yet
    uint64_t largestUnits_ = 1;        // largest of pageUnits_
    bool withColour_ = false;
    LoadPriorities priorities_;
    PoolShape pool_;
    uint64_t planned_ = 0;  // units that views may want together
    std::map<uint64_t, Resident> slots_;
    std::map<uint64_t, uint64_t> pageAt_;                      // by the first unit of its slot
    std::optional<std::priority_queue<Evictable>> evictable_;  // made once a page had to go; some may be gone
    SparseArray<uint8_t> resident_;
    SparseArray<uint8_t> states_;      // a PageState for each page
    SparseArray<uint8_t> blocksSeen_;  // for each block of the directory; empty: all are seen
    uint64_t blocksKnown_ = 0;         // the blocks that were seen
    SparseArray<uint64_t> loadedIn_;   // for each page, stillSince_ of the still view in which it was last placed

    std::map<ViewNumber, Motion> motions_;
    std::vector<SelectionView> views_;  // the views of motions_
    PageChoice choice_;
    PageChoice ahead_;  // what views will want where they are going, while they move
    SparseArray<Rank> ranks_;
    bool asksRays_ = false;     // pages cover the surface of those below them
    bool wantsHidden_ = false;  // views want all that is in their frustum
    bool lacksRoom_ = false;    // for what rays hit, as was found since views stand still
    bool moving_ = false, stale_ = true, emptied_ = false;
    double seconds_ = 0;
    uint64_t round_ = 0, stillSince_ = 0, version_ = 0;
    PolicyCounts counts_;
};

}  // namespace vcp
