// Decides which pages of a scene's datasets are in the pool, where, and which are wished for. Pure: no threads, no
// clock, no GPU; a round's outcome depends on the views, the pages that were placed, the time it is told, and nothing
// else.
//
// A round, one for each update of a view:
//
//   policy.look(view, seconds);              // what the views want
//   for each page that was read:
//       placement = policy.place(page);      // makes room: evicts what is not wanted, moves pages together
//       carry out placement.moves, then write the page into placement.slot
//   outcome = policy.finish();               // what can be drawn, what to read next
//
// The datasets share the pool, and it goes to what is seen: among the pages of all of them, the one that errs most in
// its view is refined first (page_selection.h). Pages and blocks of the second dataset are numbered behind those of the
// first, and so on (scene_numbers.h); what rays and cuts name are the numbers of a dataset's own.
//
// Several views, each with a number of its own, share the pool: what any of them wanted in its last look() is wanted
// (page_selection.h), until forgetView().
//
// Rules:
// - A page's units are counted once, in the pool's; what the views want always fits into the pool at once, with
//   its fragments moved together. So all still views settle, on pages that depend on the views, the pool's
//   size and the pages that cannot be read, and not on what was there before.
// - Parents before children; children are evicted before parents; what a view wants is not evicted, so
//   still views load no page twice. Each dataset's coarsest page is always wanted.
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
#include "streaming/scene_numbers.h"
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

/// A dataset whose pages are in the pool.
struct PooledDataset {
    std::shared_ptr<const Dataset> dataset;
    bool withColour = false;
};

/// Returns the largest useful pool within a budget: never more bytes, and no more than the datasets can fill; where
/// only part of a directory is known, no more for it than kMostGrowth times the file's bytes and a unit a page.
PoolShape poolShapeFor(std::span<const PooledDataset> datasets, uint64_t budgetBytes, uint64_t chunkBytes);

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
    /// Pages placed twice for views that stand still, since what their rays hit is no guess: must stay 0.
    uint64_t reloads = 0;
};

struct PolicyOutcome {
    std::vector<DrawableCut> cuts;  ///< for each dataset, what this view draws; empty where it does not show it
    std::vector<Wish> wishes;       ///< of all views
    std::vector<uint64_t> missing;  ///< for each dataset, the pages that some view wants and that are not resident
};

class ResidencyPolicy {
public:
    /// `pool` is made by poolShapeFor. `order` decides what is read first, and nothing else. `hiddenToo`: views want
    /// what no ray hits, too, also where pages cover what is below them.
    ResidencyPolicy(std::span<const PooledDataset> datasets, PoolShape pool, LoadOrder order = LoadOrder::Feedback,
                    bool hiddenToo = false);

    [[nodiscard]] const SceneNumbers& numbers() const { return numbers_; }
    /// The units that the coarsest pages of all datasets take, and whether the pool has room for them.
    [[nodiscard]] uint64_t coarsestUnits() const;
    [[nodiscard]] bool hasRoom() const { return coarsestUnits() <= planned_; }

    /// Says what a view sees: a view for each dataset, in its own coordinates, or none where it does not show it.
    /// `seconds`: the time on any clock; never less than before.
    void look(std::span<const std::optional<SelectionView>> views, double seconds, ViewNumber number = 0);
    /// Forgets a view that is gone; the other, that it showed a dataset.
    void forgetView(ViewNumber number);
    void forgetView(ViewNumber number, size_t dataset);
    /// Takes in what the rays of a frame of `view` met of a dataset: the pages they ask for are wished for first.
    void hear(const RayFeedback& feedback, const SelectionView& view, size_t dataset = 0);
    /// Takes in which pages of a dataset the rays of a frame hit, and where they began: a frame of `view`, which is
    /// what that view saw at its last look() or before. What it asks for is wanted from the next look() on.
    void see(const PagesHit& hit, const SelectionView& view, ViewNumber number = 0, size_t dataset = 0);
    /// Whether pages of a dataset that rays ask for are there, or cannot be read: what rays hit is then known for good.
    [[nodiscard]] bool hasAll(const std::vector<uint64_t>& pages, size_t dataset = 0) const;
    Placement place(uint64_t page);
    /// Returns what the view can draw and what to read. Precondition: it was looked at.
    [[nodiscard]] PolicyOutcome finish(ViewNumber number = 0) const;
    /// Returns what the view draws of a dataset. Precondition: hasLooked(number, dataset).
    [[nodiscard]] DrawableCut drawable(ViewNumber number, size_t dataset) const;

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
    /// Whether the view showed the dataset when it was last looked at.
    [[nodiscard]] bool hasLooked(ViewNumber number, size_t dataset) const;
    /// Whether a view moved when it was last looked at.
    [[nodiscard]] bool isMoving() const { return moving_; }
    /// A counter that grows with each change that can affect a cut of a dataset or the place of one of its pages.
    [[nodiscard]] uint64_t version(size_t dataset = 0) const { return trees_[dataset].version; }
    /// Approximate bytes of memory that this takes at most: bounded by the datasets, whatever the number of rounds.
    [[nodiscard]] uint64_t bytesHeld() const;

    [[nodiscard]] bool isResident(uint64_t page) const { return resident_[page] != 0; }
    /// Returns a page's slot. Precondition: isResident(page).
    [[nodiscard]] PoolSlot slotOf(uint64_t page) const { return slots_.at(page).slot; }
    [[nodiscard]] uint64_t unitsTaken() const { return allocator_.unitsTaken(); }
    [[nodiscard]] size_t pagesResident() const { return slots_.size(); }
    /// Returns the resident pages of a dataset, ascending.
    [[nodiscard]] std::vector<uint64_t> residentPages(size_t dataset) const;
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
    /// What a view sees of a dataset.
    struct Sight {
        std::optional<SelectionView> view;   // none: it is not shown
        std::optional<SelectionView> later;  // where the view will be, while it moves
        PagesSeen seen;
    };
    struct Motion {
        std::vector<Sight> sights;  // for each dataset
        double seconds = 0;         // time of the last look
        bool moves = false;
    };
    /// A dataset, the tree of its pages, and what views want of it. Pages have the dataset's own numbers here.
    struct Tree {
        std::shared_ptr<const Dataset> dataset;
        bool withColour = false;
        bool asksRays = false;  // pages cover the surface of those below them
        LoadPriorities priorities;
        SparseArray<uint8_t> blocksSeen;  // for each block of the directory; empty: all are seen
        uint64_t blocksKnown = 0;         // the blocks that were seen
        std::vector<SelectionView> views;
        PageChoice choice;
        PageChoice ahead;  // what views will want where they are going, while they move
        uint64_t version = 0;
    };
    [[nodiscard]] Rank rankOf(uint64_t page) const { return ranks_[page]; }
    /// Whether a page may go to make room for one of rank `forRank`.
    [[nodiscard]] bool mayEvict(uint64_t page, const Resident& resident, Rank forRank) const;
    bool evictOne(Rank forRank);
    void evict(uint64_t page);
    bool gather(uint64_t units, uint64_t most, std::vector<PageMove>& moves);
    void planFor(PoolShape pool);
    void learnBlocks();
    bool learnBlocks(size_t number);
    void choose();
    /// Chooses what views want, now or where they will be; a choice for each dataset.
    [[nodiscard]] std::vector<PageChoice> chosenFor(std::optional<SelectionView> Sight::*when) const;
    /// Chooses what views want now, and whether that depends on rays.
    void chooseForViews();
    [[nodiscard]] bool takesFewBytes(std::span<const PageChoice> choices) const;
    void rank(PageChoice Tree::*choice, Rank rank);
    /// What a view's rays hit of a dataset; null: all pages count as hit.
    [[nodiscard]] const PagesSeen* seenBy(const Motion& motion, size_t dataset) const {
        return trees_[dataset].asksRays && !wantsHidden_ ? &motion.sights[dataset].seen : nullptr;
    }
    /// The elements of an array that belong to a dataset.
    template <class T>
    [[nodiscard]] std::span<const T> ofTree(const SparseArray<T>& all, size_t dataset) const {
        return {all.data() + numbers_.firstPage(dataset), trees_[dataset].dataset->pages.size()};
    }
    [[nodiscard]] std::vector<WantedPage> ahead() const;
    void changed(uint64_t page) { ++trees_[numbers_.datasetOf(page)].version; }
    /// Has views want only what rays hit, as far as there is room.
    void askAgain();
    [[nodiscard]] std::span<uint8_t> statesOf(Request request);
    void wishForBlocks(PageChoice Tree::*choice, double urgency, std::set<uint64_t>& blocks,
                       std::vector<Wish>& wishes) const;
    [[nodiscard]] uint64_t unitsWithin(Rank forRank) const;

    SceneNumbers numbers_;
    SlotAllocator allocator_;
    SparseArray<uint64_t> pageUnits_;  // 0: the page's entry is not known yet
    uint64_t largestUnits_ = 1;        // largest of pageUnits_
    std::vector<Tree> trees_;
    PoolShape pool_;
    uint64_t planned_ = 0;  // units that views may want together
    std::map<uint64_t, Resident> slots_;
    std::map<uint64_t, uint64_t> pageAt_;                      // by the first unit of its slot
    std::optional<std::priority_queue<Evictable>> evictable_;  // made once a page had to go; some may be gone
    SparseArray<uint8_t> resident_;
    SparseArray<uint8_t> states_;     // a PageState for each page
    SparseArray<uint64_t> loadedIn_;  // for each page, stillSince_ of the still view for which it was last placed

    std::map<ViewNumber, Motion> motions_;
    SparseArray<Rank> ranks_;
    bool asksRays_ = false;     // some dataset's pages cover the surface of those below them
    bool wantsHidden_ = false;  // views want all that is in their frustum
    bool lacksRoom_ = false;    // for what rays hit, as was found since views stand still
    bool moving_ = false, stale_ = true, emptied_ = false;
    double seconds_ = 0;
    uint64_t round_ = 0, stillSince_ = 0;
    PolicyCounts counts_;
};

}  // namespace vcp
