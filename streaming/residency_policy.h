// Which pages of a dataset are in the pool, where, and which are wished for. Pure: no threads, no clock, no
// GPU; a round's outcome depends on the views, the pages that were placed, and nothing else.
//
// A round, one for each update of a view:
//
//   policy.look(view);                       // what this view wants
//   for each page that was read:
//       placement = policy.place(page);      // makes room: evicts what is not wanted, moves pages together
//       carry out placement.moves, then write the page into placement.slot
//   outcome = policy.finish();               // what can be drawn, what to read next
//
// Rules:
// - A page's units are counted once, in the pool's; what look() wants always fits into the pool at once, with
//   its fragments moved together. So every still view settles, on pages that depend on the view, the pool's
//   size and the pages that cannot be read, and not on what was there before.
// - Parents before children; children are evicted before parents; what this view wants is not evicted, so
//   a still view loads no page twice. The coarsest page is wanted by all views.
// - Hysteresis: while the view moves, a page that came less than kSettlingRounds rounds ago is not evicted
//   for another, and what would need its place is not wished for.
// - While the view moves, what it would want a little later (its motion continued for kAheadRounds rounds) is
//   wished for last, and only into places that are free or hold what neither view wants.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "octree/vcp_file.h"
#include "streaming/load_order.h"
#include "streaming/page_selection.h"
#include "streaming/request_queue.h"
#include "streaming/slot_allocator.h"

namespace vcp {

inline constexpr uint64_t kSettlingRounds = 30;
inline constexpr uint64_t kAheadRounds = 10;

/// A pool of slots of kPoolUnitBytes, in chunks that no slot crosses.
struct PoolShape {
    uint64_t units = 0, unitsPerChunk = 0;
};

/// The largest useful pool within a budget: never more bytes, and no more than the dataset can fill.
PoolShape poolShapeFor(const Dataset& dataset, bool withColour, uint64_t budgetBytes, uint64_t chunkBytes);

/// Units of a page: its geometry and, where asked for, its colour behind it, in one slot.
uint64_t pageUnits(const PageEntry& page, bool withColour);

struct PageMove {
    uint64_t page = 0;
    PoolSlot from, to;  ///< of one chunk; may overlap; `to` is the lower one
};

struct Placement {
    std::vector<PageMove> moves;   ///< to be carried out in this order, also where there is no slot
    std::optional<PoolSlot> slot;  ///< nothing: there is no place for it now, or it is there already
};

struct PolicyCounts {
    uint64_t loads = 0, evictions = 0, moves = 0;
    uint64_t refused = 0;   ///< pages that were read and had no place
    uint64_t reloads = 0;   ///< pages placed twice in one still view: must stay 0
};

struct PolicyOutcome {
    DrawableCut drawable;
    std::vector<PageRequest> wishes;
    uint64_t wanted = 0, missing = 0;  ///< pages, of this view
    bool relaxed = false;              ///< the pool is too small for the view's pixel error
};

class ResidencyPolicy {
public:
    /// `pool` from poolShapeFor. `order` decides what is read first, and nothing else.
    ResidencyPolicy(std::shared_ptr<const Dataset> dataset, bool withColour, PoolShape pool, LoadOrder order = LoadOrder::Feedback);

    /// Whether the coarsest page fits.
    [[nodiscard]] bool hasRoom() const { return !pageUnits_.empty() && pageUnits_[0] <= planned_; }

    void look(const SelectionView& view);
    /// What the rays of a frame of `view` met: its wishes come first.
    void hear(const RayFeedback& feedback, const SelectionView& view) { priorities_.hear(feedback, view); }
    Placement place(uint64_t page);
    [[nodiscard]] PolicyOutcome finish() const;

    /// The page cannot be read: from the next look() its parent is drawn in its place. True the first time.
    bool giveUp(uint64_t page);
    /// It can be read after all.
    void restore(uint64_t page);
    /// Forgets all pages: the pool's content was lost.
    void clear();
    /// Another pool, empty; from the next look() on, views want what fits into it. Forgets all pages, but not which
    /// cannot be read.
    void setPool(PoolShape pool);
    /// Whether finish() may be called.
    [[nodiscard]] bool hasLooked() const { return view_.has_value(); }

    [[nodiscard]] bool isResident(uint64_t page) const { return resident_[page] != 0; }
    /// Precondition: isResident(page).
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
        uint64_t lastWanted = 0;  // round
        uint64_t loaded = 0;      // round
    };
    [[nodiscard]] Rank rankOf(uint64_t page) const { return ranks_[page]; }
    /// Whether a page may go for one of rank `forRank`.
    [[nodiscard]] bool mayEvict(uint64_t page, const Resident& resident, Rank forRank) const;
    bool evictOne(Rank forRank);
    void evict(uint64_t page);
    bool gather(uint64_t units, std::vector<PageMove>& moves);
    void planFor(PoolShape pool);
    void lookAhead(const SelectionView& view, const SelectionView& before);
    [[nodiscard]] uint64_t unitsWithin(Rank forRank) const;

    std::shared_ptr<const Dataset> dataset_;
    SlotAllocator allocator_;
    std::vector<uint64_t> pageUnits_;
    LoadPriorities priorities_;
    uint64_t planned_ = 0;  // units that views may want together
    std::map<uint64_t, Resident> slots_;
    std::map<uint64_t, uint64_t> pageAt_;  // by the slot's first unit
    std::vector<uint8_t> resident_, unavailable_;
    std::vector<uint64_t> loadedIn_;  // the still view that a page was last placed in: its stillSince_

    std::optional<SelectionView> view_;
    PageChoice choice_;
    std::vector<WantedPage> ahead_;
    std::vector<Rank> ranks_;
    bool moving_ = false, stale_ = true, emptied_ = false;
    uint64_t round_ = 0, stillSince_ = 0;
    PolicyCounts counts_;
};

}  // namespace vcp
