#include "streaming/residency_policy.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

#include "streaming/page_source.h"

namespace vcp {

namespace {

// Wishes for what a view wants later are less urgent than any for what is in view.
constexpr double kAheadUrgency = 1e-9;
// The urgency of blocks of the directory: only the coarsest page comes before them.
constexpr double kBlockUrgency = std::numeric_limits<double>::max();
// Moving pages aside costs a frame its time: at most so many times a page's units are moved for it, before pages that
// no view wants are evicted.
constexpr uint64_t kCheapMoves = 2;
// Motion is continued for at most so many steps.
constexpr double kMostAhead = 20;

/// The units of the page that each chunk leaves room for: a fixed least size, so that what fits does not depend on
/// which pages are known so far; where chunks are small, the largest known page.
uint64_t largestPlanned(uint64_t largestKnown, uint64_t unitsPerChunk) {
    constexpr uint64_t kLeastBytes = 32 << 20;
    return std::max(largestKnown, std::min(kLeastBytes / kPoolUnitBytes, unitsPerChunk / 32));
}

/// The units that first fit may leave unused: in every chunk, less than the largest page needs. A single chunk can be
/// gathered whole.
uint64_t unusableUnits(PoolShape pool, uint64_t largestKnown) {
    const uint64_t chunks = (pool.units + pool.unitsPerChunk - 1) / pool.unitsPerChunk;
    return chunks > 1 ? chunks * (largestPlanned(largestKnown, pool.unitsPerChunk) - 1) : 0;
}

/// Returns where a view that went from `before` to `view` in so many seconds will be.
std::optional<SelectionView> aheadOf(const SelectionView& view, const SelectionView& before, double seconds) {
    if (view.orthographic != before.orthographic || seconds <= 0) return std::nullopt;
    const double times = std::min(kAheadSeconds / seconds, kMostAhead);
    SelectionView later = view;
    later.eye += times * (view.eye - before.eye);
    for (size_t i = 0; i < later.planes.size(); ++i) later.planes[i] += times * (view.planes[i] - before.planes[i]);
    return later;
}

bool isWhole(const Dataset& dataset) { return dataset.pages.blocksKnown() == dataset.pages.blocks(); }

/// Returns the units of each page; only zeros where the directory comes in parts, as look() learns them later.
SparseArray<uint64_t> unitsOfAll(const Dataset& dataset, bool withColour) {
    SparseArray<uint64_t> units(dataset.pages.size());
    if (isWhole(dataset))
        std::transform(dataset.pages.begin(), dataset.pages.end(), units.data(),
                       [&](const PageEntry& page) { return pageUnits(page, withColour); });
    return units;
}

}  // namespace

uint64_t pageUnits(const PageEntry& page, bool withColour) {
    return unitsOf(uint64_t{page.pageBytes} + (withColour ? page.colourBytes : 0));
}

PoolShape poolShapeFor(const Dataset& dataset, bool withColour, uint64_t budgetBytes, uint64_t chunkBytes) {
    const uint64_t chunk = chunkBytes / kPoolUnitBytes;
    if (!isWhole(dataset))
        return {std::min(unitsOf(kMostGrowth * dataset.header.fileBytes) + dataset.pages.size(),
                         budgetBytes / kPoolUnitBytes),
                chunk};
    uint64_t all = 0, largest = 1;
    for (const PageEntry& page : dataset.pages) {
        all += pageUnits(page, withColour);
        largest = std::max(largest, pageUnits(page, withColour));
    }
    uint64_t useful = std::max<uint64_t>(all, 1);
    if (all > chunk && chunk > largest) {
        largest = largestPlanned(largest, chunk);
        const uint64_t chunks = (all + chunk - largest) / (chunk - largest + 1);
        useful = all + chunks * (largest - 1);
    }
    return {std::min(useful, budgetBytes / kPoolUnitBytes), chunk};
}

ResidencyPolicy::ResidencyPolicy(std::shared_ptr<const Dataset> dataset, bool withColour, PoolShape pool,
                                 LoadOrder order, bool hiddenToo)
    : dataset_(std::move(dataset)),
      allocator_(pool.units, pool.unitsPerChunk),
      pageUnits_(unitsOfAll(*dataset_, withColour)),
      priorities_(dataset_, pageUnits_, order) {
    pool_ = pool;
    const size_t pages = dataset_->pages.size();
    resident_ = SparseArray<uint8_t>(pages);
    states_ = SparseArray<uint8_t>(pages);
    loadedIn_ = SparseArray<uint64_t>(pages);
    ranks_ = SparseArray<Rank>(pages);
    withColour_ = withColour;
    asksRays_ = dataset_->isCovering() && !hiddenToo;
    if (isWhole(*dataset_)) {
        if (pages > 0) largestUnits_ = *std::max_element(pageUnits_.data(), pageUnits_.data() + pages);
    } else {
        blocksSeen_ = SparseArray<uint8_t>(dataset_->pages.blocks());
        learnBlocks();
    }
    planFor(pool);
}

/// Takes over what became known of the directory since the last call.
void ResidencyPolicy::learnBlocks() {
    const PageDirectory& pages = dataset_->pages;
    if (blocksSeen_.empty() || blocksKnown_ == pages.blocksKnown()) return;
    for (uint64_t block = 0; block < blocksSeen_.size(); ++block) {
        if (blocksSeen_[block] != 0 || !pages.knowsBlock(block)) continue;
        blocksSeen_[block] = 1;
        ++blocksKnown_;
        const uint64_t first = block * kEntriesPerBlock,
                       end = std::min<uint64_t>(first + kEntriesPerBlock, pages.size());
        for (uint64_t page = first; page < end; ++page) {
            pageUnits_[page] = pageUnits(pages[page], withColour_);
            largestUnits_ = std::max(largestUnits_, pageUnits_[page]);
            priorities_.learn(page, pageUnits_[page]);
            if (states_[page] != kAvailable) states_[page] = kAvailable;
        }
    }
    stale_ = true;
    planFor(pool_);
    // A page too large for a pool of several parts is refused, but the coarsest page always has its place.
    if (pool_.units > 0) planned_ = std::max(planned_, pageUnits_[0]);
}

void ResidencyPolicy::planFor(PoolShape pool) {
    pool_ = pool;
    const uint64_t unusable = unusableUnits(pool, largestUnits_);
    planned_ = pool.units > unusable ? pool.units - unusable : 0;
}

void ResidencyPolicy::setPool(PoolShape pool) {
    clear();
    allocator_ = SlotAllocator(pool.units, pool.unitsPerChunk);
    planFor(pool);
    askAgain();
}

void ResidencyPolicy::askAgain() {
    lacksRoom_ = false;
    stale_ = true;
}

void ResidencyPolicy::look(const SelectionView& view, double seconds, ViewNumber number) {
    ++round_;
    seconds_ = seconds;
    evictable_.reset();
    learnBlocks();
    const auto [known, isNew] = motions_.try_emplace(number);
    Motion& motion = known->second;
    const bool moves = isNew || motion.view != view;
    motion.later.reset();
    if (moves && !isNew) motion.later = aheadOf(view, motion.view, seconds - motion.seconds);
    if (moves) motion.seen.begin();
    // A view that stands still plans nothing ahead.
    stale_ = stale_ || moves || motion.moves;
    if (moves || emptied_) stillSince_ = round_;
    emptied_ = false;
    motion.view = view;
    motion.seconds = seconds;
    const bool stops = std::exchange(motion.moves, moves) && !moves;
    moving_ = std::any_of(motions_.begin(), motions_.end(), [](const auto& each) { return each.second.moves; });
    if (stops && !moving_) askAgain();
    if (stale_) choose();
    for (const WantedPage& wanted : choice_.wanted)
        if (const auto at = slots_.find(wanted.page); at != slots_.end()) at->second.lastWanted = round_;
}

void ResidencyPolicy::forgetView(ViewNumber number) {
    motions_.erase(number);
    askAgain();
}

void ResidencyPolicy::see(const PagesHit& hit, const SelectionView& view, ViewNumber number) {
    const auto known = motions_.find(number);
    if (!asksRays_ || known == motions_.end()) return;
    // Rays of light begin where the camera's rays hit: as long as those ask for finer pages, it is not known where.
    std::vector<uint64_t> pages = hit.byCamera;
    if (hasAll(hit.byCamera)) pages.insert(pages.end(), hit.byLight.begin(), hit.byLight.end());
    Motion& motion = known->second;
    if (motion.view != view)
        motion.seen.guess(*dataset_, pages);
    else if (motion.seen.add(*dataset_, pages))
        stale_ = true;
}

bool ResidencyPolicy::hasAll(const std::vector<uint64_t>& pages) const {
    return std::all_of(pages.begin(), pages.end(),
                       [&](uint64_t page) { return isResident(page) || states_[page] == kUnavailable; });
}

PageChoice ResidencyPolicy::chosenFor(std::span<const SelectionView> views) const {
    std::vector<const PagesSeen*> seen;
    for (const auto& [number, motion] : motions_) seen.push_back(seenBy(motion));
    return choosePages(*dataset_, views, planned_, pageUnits_, states_, seen);
}

void ResidencyPolicy::choose() {
    views_.clear();
    std::vector<SelectionView> later;
    for (const auto& [number, motion] : motions_) {
        views_.push_back(motion.view);
        later.push_back(motion.later.value_or(motion.view));
    }
    for (const WantedPage& wanted : ahead_.wanted) ranks_[wanted.page] = Rank::Stale;
    for (const WantedPage& wanted : choice_.wanted) ranks_[wanted.page] = Rank::Stale;
    chooseForViews();
    ahead_ = {};
    if (later != views_) ahead_ = chosenFor(later);
    for (const WantedPage& wanted : ahead_.wanted) ranks_[wanted.page] = Rank::Ahead;
    for (const WantedPage& wanted : choice_.wanted) ranks_[wanted.page] = Rank::Wanted;
    stale_ = false;
    ++version_;
}

void ResidencyPolicy::chooseForViews() {
    wantsHidden_ = true;
    choice_ = chosenFor(views_);
    if (!asksRays_ || lacksRoom_) return;
    double pixels = 0;
    for (const SelectionView& view : views_) pixels += view.pixels;
    const bool isAllKnown = choice_.awaited.empty() && !choice_.relaxed;
    if (isAllKnown && double(choice_.bytes * kPoolUnitBytes) <= kFewBytesAPixel * pixels) return;
    wantsHidden_ = false;
    PageChoice hit = chosenFor(views_);
    if (hit.relaxed && !moving_) {
        // What still views want must not depend on what was seen before.
        for (auto& [number, motion] : motions_) motion.seen.dropGuess();
        hit = chosenFor(views_);
    }
    lacksRoom_ = wantsHidden_ = hit.relaxed;
    if (lacksRoom_)
        stillSince_ = round_;
    else
        choice_ = std::move(hit);
}

bool ResidencyPolicy::mayEvict(uint64_t page, const Resident& resident, Rank forRank) const {
    if (page == 0 || rankOf(page) >= forRank) return false;
    return !moving_ || resident.loaded + kSettlingSeconds <= seconds_;
}

bool ResidencyPolicy::evictOne(Rank forRank) {
    if (!evictable_) {
        evictable_.emplace();
        for (const auto& [page, resident] : slots_)
            if (mayEvict(page, resident, Rank::Wanted)) evictable_->push({rankOf(page), resident.lastWanted, page});
    }
    while (!evictable_->empty() && evictable_->top().rank < forRank) {
        const uint64_t page = evictable_->top().page;
        evictable_->pop();
        if (!isResident(page)) continue;
        evict(page);
        return true;
    }
    return false;
}

void ResidencyPolicy::evict(uint64_t page) {
    const PoolSlot slot = slots_.at(page).slot;
    allocator_.release(slot);
    pageAt_.erase(slot.firstUnit);
    slots_.erase(page);
    resident_[page] = 0;
    ++version_;
    ++counts_.evictions;
}

/// Moves pages down until `units` free ones are contiguous; moves few units, or as few as possible. Returns false where
/// no chunk has so many free, or where it takes more than `most` units.
bool ResidencyPolicy::gather(uint64_t units, uint64_t most, std::vector<PageMove>& moves) {
    struct Window {
        uint64_t begin = 0, end = 0, cost = UINT64_MAX;  // in units
    } best;
    const uint64_t perChunk = allocator_.unitsPerChunk();
    for (uint64_t chunk = 0; chunk < allocator_.units(); chunk += perChunk) {
        const uint64_t chunkEnd = std::min(chunk + perChunk, allocator_.units());
        // The slots of the chunk and the gap before each; the last entry is the gap at the end.
        std::vector<PoolSlot> gaps;
        uint64_t at = chunk;
        for (auto slot = pageAt_.lower_bound(chunk); slot != pageAt_.end() && slot->first < chunkEnd; ++slot) {
            gaps.push_back({at, slot->first - at});
            at = slots_.at(slot->second).slot.end();
        }
        gaps.push_back({at, chunkEnd - at});
        uint64_t free = 0;
        for (size_t first = 0, last = 0; last < gaps.size(); ++last) {
            free += gaps[last].units;
            while (free - gaps[first].units >= units && first < last) free -= gaps[first++].units;
            const uint64_t cost = gaps[last].end() - gaps[first].firstUnit - free;
            if (free >= units && cost < best.cost) best = {gaps[first].firstUnit, gaps[last].end(), cost};
        }
        if (best.cost <= kCheapMoves * units) break;
    }
    if (best.cost == UINT64_MAX || best.cost > most) return false;
    uint64_t to = best.begin;
    for (auto at = pageAt_.lower_bound(best.begin); at != pageAt_.end() && at->first < best.end;) {
        const uint64_t page = at->second;
        at = pageAt_.erase(at);
        PoolSlot& slot = slots_.at(page).slot;
        const PoolSlot from = slot;
        slot.firstUnit = to;
        to = slot.end();
        pageAt_.emplace(slot.firstUnit, page);
        if (slot == from) continue;
        allocator_.release(from);
        allocator_.take(slot);
        moves.push_back({page, from, slot});
        ++version_;
        ++counts_.moves;
        counts_.unitsMoved += slot.units;
    }
    return true;
}

Placement ResidencyPolicy::place(uint64_t page) {
    Placement placement;
    if (isResident(page) || states_[page] != kAvailable || pageUnits_[page] == 0) return placement;
    const uint64_t units = pageUnits_[page];
    const Rank rank = rankOf(page);
    placement.slot = allocator_.allocate(units);
    // Evicting pages that no view wants any more takes no work.
    while (!placement.slot && rank != Rank::Stale) {
        const bool isEnough = allocator_.unitsFree() >= units;
        const bool hasRoom = (isEnough && gather(units, kCheapMoves * units, placement.moves)) || evictOne(rank) ||
                             (isEnough && gather(units, UINT64_MAX, placement.moves));
        if (!hasRoom) break;
        placement.slot = allocator_.allocate(units);
    }
    if (!placement.slot) {
        ++counts_.refused;
        return placement;
    }
    const Resident& placed =
        slots_.emplace(page, Resident{*placement.slot, rank == Rank::Wanted ? round_ : 0, seconds_}).first->second;
    if (evictable_ && mayEvict(page, placed, Rank::Wanted)) evictable_->push({rank, placed.lastWanted, page});
    pageAt_.emplace(placement.slot->firstUnit, page);
    resident_[page] = 1;
    ++version_;
    ++counts_.loads;
    counts_.unitsLoaded += units;
    if (loadedIn_[page] == stillSince_ && !emptied_) ++counts_.reloads;
    loadedIn_[page] = stillSince_;
    return placement;
}

/// The units that are free or hold pages that may go for one of that rank.
uint64_t ResidencyPolicy::unitsWithin(Rank forRank) const {
    uint64_t units = allocator_.unitsFree();
    for (const auto& [page, resident] : slots_)
        if (mayEvict(page, resident, forRank)) units += resident.slot.units;
    return units;
}

DrawableCut ResidencyPolicy::drawable(ViewNumber number) const {
    assert(hasLooked(number));
    const Motion& motion = motions_.at(number);
    return drawableCut(*dataset_, motion.view, choice_, resident_, seenBy(motion));
}

PolicyOutcome ResidencyPolicy::finish(ViewNumber number) const {
    PolicyOutcome outcome;
    outcome.drawable = drawable(number);
    std::vector<WantedPage> missing;
    std::copy_if(choice_.wanted.begin(), choice_.wanted.end(), std::back_inserter(missing),
                 [&](const WantedPage& wanted) { return !isResident(wanted.page); });
    outcome.missing = missing.size() + choice_.awaited.size();
    // Pages are wished for in order of urgency, as long as there is room for them.
    uint64_t room = unitsWithin(Rank::Wanted), reserved = 0;
    bool full = false;
    std::set<uint64_t> blocks;
    wishForBlocks(choice_.awaited, kBlockUrgency, blocks, outcome.wishes);
    for (const WantedPage& wanted : priorities_.ordered(std::move(missing), views_)) {
        full = full || reserved + pageUnits_[wanted.page] > room;
        if (full) continue;
        reserved += pageUnits_[wanted.page];
        outcome.wishes.push_back({wanted.page, wanted.priority});
    }
    if (full || (ahead_.wanted.empty() && ahead_.awaited.empty())) return outcome;
    room = unitsWithin(Rank::Ahead);
    double urgency = 1e6;
    for (const WantedPage& wanted : ahead_.wanted) {
        if (isResident(wanted.page) || rankOf(wanted.page) != Rank::Ahead) continue;
        reserved += pageUnits_[wanted.page];
        if (reserved > room) break;
        // Parents, which come before their children, are no less urgent.
        urgency = std::min(urgency, wanted.priority);
        outcome.wishes.push_back({wanted.page, urgency * kAheadUrgency});
    }
    wishForBlocks(ahead_.awaited, urgency * kAheadUrgency, blocks, outcome.wishes);
    return outcome;
}

/// Wishes for the blocks that hold children of the awaited pages, but those in `blocks`: they are wished for already.
void ResidencyPolicy::wishForBlocks(const std::vector<uint64_t>& awaited, double urgency, std::set<uint64_t>& blocks,
                                    std::vector<Wish>& wishes) const {
    uint64_t last = UINT64_MAX;
    for (const uint64_t page : awaited) {
        for (const uint64_t child : childrenOf(dataset_->pages[page])) {
            const uint64_t block = child / kEntriesPerBlock;
            if (block == last || blocksSeen_[block] != 0 || !blocks.insert(block).second) continue;
            last = block;
            wishes.push_back({Request::directoryBlock(block), urgency});
        }
    }
}

/// The state of a page, or those of all pages in a block of the directory.
std::span<uint8_t> ResidencyPolicy::statesOf(Request request) {
    const std::span<uint8_t> states(states_);
    if (request.isPage()) return states.subspan(request.number, 1);
    const uint64_t first = request.number * kEntriesPerBlock;
    return states.subspan(first, std::min<uint64_t>(kEntriesPerBlock, states.size() - first));
}

bool ResidencyPolicy::giveUp(Request request) {
    const std::span<uint8_t> states = statesOf(request);
    if (states[0] == kUnavailable) return false;
    std::fill(states.begin(), states.end(), uint8_t{kUnavailable});
    askAgain();
    return true;
}

uint64_t ResidencyPolicy::bytesHeld() const {
    constexpr uint64_t kNode = 4 * sizeof(void*);  // a node of a map, beside its value
    const auto bytesOf = [](const auto& vector) { return vector.capacity() * sizeof(vector[0]); };
    uint64_t bytes = pageUnits_.bytes() + resident_.bytes() + states_.bytes() + blocksSeen_.bytes() +
                     loadedIn_.bytes() + bytesOf(views_) + bytesOf(ahead_.wanted) + ahead_.refined.bytes() +
                     ranks_.bytes();
    bytes += bytesOf(choice_.wanted) + choice_.refined.bytes() + priorities_.bytesHeld() + allocator_.bytesHeld();
    for (const auto& [number, motion] : motions_) bytes += motion.seen.bytesHeld();
    bytes += slots_.size() * (sizeof(*slots_.begin()) + kNode) + pageAt_.size() * (sizeof(*pageAt_.begin()) + kNode);
    return bytes + motions_.size() * (sizeof(*motions_.begin()) + kNode);
}

void ResidencyPolicy::restore(Request request) {
    const std::span<uint8_t> states = statesOf(request);
    std::fill(states.begin(), states.end(), uint8_t{kAvailable});
    askAgain();
}

void ResidencyPolicy::clear() {
    while (!slots_.empty()) evict(slots_.begin()->first);
    emptied_ = true;  // pages that were lost may come again
}

}  // namespace vcp
