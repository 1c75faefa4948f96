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

/// Returns pages, each most urgent first, as one such list; pages of one dataset keep their order.
std::vector<WantedPage> merged(std::vector<std::vector<WantedPage>> lists) {
    std::vector<std::pair<double, WantedPage>> all;
    for (const std::vector<WantedPage>& list : lists) {
        double least = std::numeric_limits<double>::infinity();
        for (const WantedPage& wanted : list) all.emplace_back(least = std::min(least, wanted.priority), wanted);
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<WantedPage> pages;
    for (const auto& [urgency, wanted] : all) pages.push_back(wanted);
    return pages;
}

}  // namespace

uint64_t pageUnits(const PageEntry& page, bool withColour) {
    return unitsOf(uint64_t{page.pageBytes} + (withColour ? page.colourBytes : 0));
}

PoolShape poolShapeFor(std::span<const PooledDataset> datasets, uint64_t budgetBytes, uint64_t chunkBytes) {
    const uint64_t chunk = chunkBytes / kPoolUnitBytes;
    uint64_t all = 0, known = 0, largest = 1;
    for (const auto& [dataset, withColour] : datasets) {
        if (!isWhole(*dataset)) {
            all += unitsOf(kMostGrowth * dataset->header.fileBytes) + dataset->pages.size();
            continue;
        }
        for (const PageEntry& page : dataset->pages) {
            known += pageUnits(page, withColour);
            largest = std::max(largest, pageUnits(page, withColour));
        }
    }
    all += known;
    uint64_t useful = std::max<uint64_t>(all, 1);
    if (known > 0 && all > chunk && chunk > largest) {
        largest = largestPlanned(largest, chunk);
        const uint64_t chunks = (all + chunk - largest) / (chunk - largest + 1);
        useful = all + chunks * (largest - 1);
    }
    return {std::min(useful, budgetBytes / kPoolUnitBytes), chunk};
}

ResidencyPolicy::ResidencyPolicy(std::span<const PooledDataset> datasets, PoolShape pool, LoadOrder order,
                                 bool hiddenToo)
    : allocator_(pool.units, pool.unitsPerChunk), pool_(pool) {
    for (const PooledDataset& each : datasets) numbers_.add(each.dataset->pages.size(), each.dataset->pages.blocks());
    const uint64_t pages = numbers_.pages();
    pageUnits_ = SparseArray<uint64_t>(pages);
    resident_ = SparseArray<uint8_t>(pages);
    states_ = SparseArray<uint8_t>(pages);
    loadedIn_ = SparseArray<uint64_t>(pages);
    ranks_ = SparseArray<Rank>(pages);
    for (const auto& [dataset, withColour] : datasets) {
        const bool asksRays = dataset->isCovering() && !hiddenToo;
        const uint64_t first = numbers_.firstPage(trees_.size());
        const bool whole = isWhole(*dataset);
        for (uint64_t page = 0; whole && page < dataset->pages.size(); ++page) {
            pageUnits_[first + page] = pageUnits(dataset->pages[page], withColour);
            largestUnits_ = std::max(largestUnits_, pageUnits_[first + page]);
        }
        const std::span<const uint64_t> units(pageUnits_.data() + first, dataset->pages.size());
        trees_.push_back(Tree{.dataset = dataset,
                              .withColour = withColour,
                              .asksRays = asksRays,
                              .priorities = LoadPriorities(dataset, units, order),
                              .blocksSeen = SparseArray<uint8_t>(whole ? 0 : dataset->pages.blocks()),
                              .views = {},
                              .choice = {},
                              .ahead = {}});
        asksRays_ = asksRays_ || asksRays;
    }
    learnBlocks();
    planFor(pool);
}

uint64_t ResidencyPolicy::coarsestUnits() const {
    uint64_t units = 0;
    for (size_t i = 0; i < trees_.size(); ++i)
        if (!trees_[i].dataset->pages.empty()) units += pageUnits_[numbers_.firstPage(i)];
    return units;
}

/// Takes over what became known of the directories since the last call.
void ResidencyPolicy::learnBlocks() {
    bool isNews = false;
    for (size_t i = 0; i < trees_.size(); ++i) isNews = learnBlocks(i) || isNews;
    if (!isNews) return;
    stale_ = true;
    planFor(pool_);
    // A page too large for a pool of several parts is refused, but the coarsest pages always have their places.
    if (pool_.units > 0) planned_ = std::max(planned_, coarsestUnits());
}

bool ResidencyPolicy::learnBlocks(size_t number) {
    Tree& tree = trees_[number];
    const PageDirectory& pages = tree.dataset->pages;
    if (tree.blocksSeen.empty() || tree.blocksKnown == pages.blocksKnown()) return false;
    for (uint64_t block = 0; block < tree.blocksSeen.size(); ++block) {
        if (tree.blocksSeen[block] != 0 || !pages.knowsBlock(block)) continue;
        tree.blocksSeen[block] = 1;
        ++tree.blocksKnown;
        const uint64_t first = block * kEntriesPerBlock,
                       end = std::min<uint64_t>(first + kEntriesPerBlock, pages.size());
        for (uint64_t own = first; own < end; ++own) {
            const uint64_t page = numbers_.firstPage(number) + own;
            pageUnits_[page] = pageUnits(pages[own], tree.withColour);
            largestUnits_ = std::max(largestUnits_, pageUnits_[page]);
            tree.priorities.learn(own, pageUnits_[page]);
            if (states_[page] != kAvailable) states_[page] = kAvailable;
        }
    }
    return true;
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

void ResidencyPolicy::look(std::span<const std::optional<SelectionView>> views, double seconds, ViewNumber number) {
    assert(views.size() == trees_.size());
    ++round_;
    seconds_ = seconds;
    evictable_.reset();
    learnBlocks();
    const auto [known, isNew] = motions_.try_emplace(number);
    Motion& motion = known->second;
    motion.sights.resize(trees_.size());
    const bool moves = isNew || !std::equal(views.begin(), views.end(), motion.sights.begin(),
                                            [](const auto& view, const Sight& sight) { return view == sight.view; });
    for (size_t i = 0; i < trees_.size(); ++i) {
        Sight& sight = motion.sights[i];
        sight.later.reset();
        if (moves && views[i] && sight.view) sight.later = aheadOf(*views[i], *sight.view, seconds - motion.seconds);
        if (moves) sight.seen.begin();
        sight.view = views[i];
    }
    // A view that stands still plans nothing ahead.
    stale_ = stale_ || moves || motion.moves;
    if (moves || emptied_) stillSince_ = round_;
    emptied_ = false;
    motion.seconds = seconds;
    const bool stops = std::exchange(motion.moves, moves) && !moves;
    moving_ = std::any_of(motions_.begin(), motions_.end(), [](const auto& each) { return each.second.moves; });
    if (stops && !moving_) askAgain();
    if (stale_) choose();
    for (size_t i = 0; i < trees_.size(); ++i)
        for (const WantedPage& wanted : trees_[i].choice.wanted)
            if (const auto at = slots_.find(numbers_.firstPage(i) + wanted.page); at != slots_.end())
                at->second.lastWanted = round_;
}

bool ResidencyPolicy::hasLooked(ViewNumber number, size_t dataset) const {
    const auto known = motions_.find(number);
    return known != motions_.end() && known->second.sights[dataset].view;
}

void ResidencyPolicy::forgetView(ViewNumber number) {
    motions_.erase(number);
    askAgain();
}

void ResidencyPolicy::forgetView(ViewNumber number, size_t dataset) {
    if (!hasLooked(number, dataset)) return;
    std::vector<Sight>& sights = motions_.at(number).sights;
    sights[dataset] = {};
    if (std::none_of(sights.begin(), sights.end(), [](const Sight& sight) { return sight.view.has_value(); }))
        motions_.erase(number);
    askAgain();
}

void ResidencyPolicy::hear(const RayFeedback& feedback, const SelectionView& view, size_t dataset) {
    trees_[dataset].priorities.hear(feedback, view, trees_[dataset].views.size());
}

void ResidencyPolicy::see(const PagesHit& hit, const SelectionView& view, ViewNumber number, size_t dataset) {
    const Tree& tree = trees_[dataset];
    if (!tree.asksRays || !hasLooked(number, dataset)) return;
    // Rays of light begin where the camera's rays hit: as long as those ask for finer pages, it is not known where.
    std::vector<uint64_t> pages = hit.byCamera;
    if (hasAll(hit.byCamera, dataset)) pages.insert(pages.end(), hit.byLight.begin(), hit.byLight.end());
    Sight& sight = motions_.at(number).sights[dataset];
    if (sight.view != view) return sight.seen.guess(*tree.dataset, pages);
    // What came until now was a guess, and may have gone for what turned out to be wanted.
    if (!sight.seen.isHeard()) stillSince_ = round_;
    if (sight.seen.add(*tree.dataset, pages)) stale_ = true;
}

bool ResidencyPolicy::hasAll(const std::vector<uint64_t>& pages, size_t dataset) const {
    const uint64_t first = numbers_.firstPage(dataset);
    return std::all_of(pages.begin(), pages.end(), [&](uint64_t page) {
        return isResident(first + page) || states_[first + page] == kUnavailable;
    });
}

std::vector<PageChoice> ResidencyPolicy::chosenFor(std::optional<SelectionView> Sight::*when) const {
    std::vector<std::vector<SelectionView>> views(trees_.size());
    std::vector<std::vector<const PagesSeen*>> seen(trees_.size());
    std::vector<ChoosingDataset> choosing;
    for (size_t i = 0; i < trees_.size(); ++i) {
        for (const auto& [number, motion] : motions_) {
            const Sight& sight = motion.sights[i];
            if (!sight.view) continue;
            views[i].push_back((sight.*when).value_or(*sight.view));
            seen[i].push_back(seenBy(motion, i));
        }
        choosing.push_back({*trees_[i].dataset, views[i], ofTree(pageUnits_, i), ofTree(states_, i), seen[i]});
    }
    return chooseTogether(choosing, planned_);
}

void ResidencyPolicy::rank(PageChoice Tree::*choice, Rank rank) {
    for (size_t i = 0; i < trees_.size(); ++i)
        for (const WantedPage& wanted : (trees_[i].*choice).wanted) ranks_[numbers_.firstPage(i) + wanted.page] = rank;
}

void ResidencyPolicy::choose() {
    bool goesOn = false;
    for (size_t i = 0; i < trees_.size(); ++i) {
        trees_[i].views.clear();
        for (const auto& [number, motion] : motions_) {
            const Sight& sight = motion.sights[i];
            if (sight.view) trees_[i].views.push_back(*sight.view);
            goesOn = goesOn || (sight.later && sight.later != sight.view);
        }
    }
    rank(&Tree::ahead, Rank::Stale);
    rank(&Tree::choice, Rank::Stale);
    chooseForViews();
    std::vector<PageChoice> ahead(trees_.size());
    if (goesOn) ahead = chosenFor(&Sight::later);
    for (size_t i = 0; i < trees_.size(); ++i) {
        trees_[i].ahead = std::move(ahead[i]);
        ++trees_[i].version;
    }
    rank(&Tree::ahead, Rank::Ahead);
    rank(&Tree::choice, Rank::Wanted);
    stale_ = false;
}

bool ResidencyPolicy::takesFewBytes(std::span<const PageChoice> choices) const {
    double pixels = 0;
    for (const auto& [number, motion] : motions_) {
        const auto shown = std::find_if(motion.sights.begin(), motion.sights.end(),
                                        [](const Sight& sight) { return sight.view.has_value(); });
        if (shown != motion.sights.end()) pixels += shown->view->pixels;
    }
    uint64_t units = 0;
    for (const PageChoice& choice : choices) {
        if (!choice.awaited.empty() || choice.relaxed) return false;
        units += choice.bytes;
    }
    return double(units * kPoolUnitBytes) <= kFewBytesAPixel * pixels;
}

void ResidencyPolicy::chooseForViews() {
    const auto isRelaxed = [](const PageChoice& choice) { return choice.relaxed; };
    wantsHidden_ = true;
    std::vector<PageChoice> chosen = chosenFor(&Sight::view);
    if (asksRays_ && !lacksRoom_ && !takesFewBytes(chosen)) {
        wantsHidden_ = false;
        std::vector<PageChoice> hit = chosenFor(&Sight::view);
        if (std::any_of(hit.begin(), hit.end(), isRelaxed) && !moving_) {
            // What still views want must not depend on what was seen before.
            for (auto& [number, motion] : motions_)
                for (Sight& sight : motion.sights) sight.seen.dropGuess();
            hit = chosenFor(&Sight::view);
        }
        lacksRoom_ = wantsHidden_ = std::any_of(hit.begin(), hit.end(), isRelaxed);
        if (lacksRoom_)
            stillSince_ = round_;
        else
            chosen = std::move(hit);
    }
    for (size_t i = 0; i < trees_.size(); ++i) trees_[i].choice = std::move(chosen[i]);
}

bool ResidencyPolicy::mayEvict(uint64_t page, const Resident& resident, Rank forRank) const {
    if (rankOf(page) >= forRank || numbers_.isCoarsest(page)) return false;
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
    changed(page);
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
        changed(page);
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
    changed(page);
    ++counts_.loads;
    counts_.unitsLoaded += units;
    if (rank != Rank::Wanted) return placement;
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

std::vector<uint64_t> ResidencyPolicy::residentPages(size_t dataset) const {
    const uint64_t first = numbers_.firstPage(dataset), end = first + trees_[dataset].dataset->pages.size();
    std::vector<uint64_t> pages;
    for (auto at = slots_.lower_bound(first); at != slots_.end() && at->first < end; ++at)
        pages.push_back(at->first - first);
    return pages;
}

DrawableCut ResidencyPolicy::drawable(ViewNumber number, size_t dataset) const {
    assert(hasLooked(number, dataset));
    const Motion& motion = motions_.at(number);
    const Tree& tree = trees_[dataset];
    return drawableCut(*tree.dataset, *motion.sights[dataset].view, tree.choice, ofTree(resident_, dataset),
                       seenBy(motion, dataset));
}

PolicyOutcome ResidencyPolicy::finish(ViewNumber number) const {
    PolicyOutcome outcome;
    std::vector<std::vector<WantedPage>> lists;
    for (size_t i = 0; i < trees_.size(); ++i) {
        const Tree& tree = trees_[i];
        outcome.cuts.push_back(hasLooked(number, i) ? drawable(number, i) : DrawableCut());
        std::vector<WantedPage> missing;
        const uint64_t first = numbers_.firstPage(i);
        std::copy_if(tree.choice.wanted.begin(), tree.choice.wanted.end(), std::back_inserter(missing),
                     [&](const WantedPage& wanted) { return !isResident(first + wanted.page); });
        outcome.missing.push_back(missing.size() + tree.choice.awaited.size());
        lists.push_back(tree.priorities.ordered(std::move(missing), tree.views));
        for (WantedPage& wanted : lists.back()) wanted.page += first;
    }
    // Pages are wished for in order of urgency, as long as there is room for them.
    uint64_t room = unitsWithin(Rank::Wanted), reserved = 0;
    bool full = false;
    std::set<uint64_t> blocks;
    wishForBlocks(&Tree::choice, kBlockUrgency, blocks, outcome.wishes);
    for (const WantedPage& wanted : merged(std::move(lists))) {
        full = full || reserved + pageUnits_[wanted.page] > room;
        if (full) continue;
        reserved += pageUnits_[wanted.page];
        outcome.wishes.push_back({wanted.page, wanted.priority});
    }
    const bool goesOn = std::any_of(trees_.begin(), trees_.end(), [](const Tree& tree) {
        return !tree.ahead.wanted.empty() || !tree.ahead.awaited.empty();
    });
    if (full || !goesOn) return outcome;
    room = unitsWithin(Rank::Ahead);
    double urgency = 1e6;
    for (const WantedPage& wanted : ahead()) {
        reserved += pageUnits_[wanted.page];
        if (reserved > room) break;
        // Parents, which come before their children, are no less urgent.
        urgency = std::min(urgency, wanted.priority);
        outcome.wishes.push_back({wanted.page, urgency * kAheadUrgency});
    }
    wishForBlocks(&Tree::ahead, urgency * kAheadUrgency, blocks, outcome.wishes);
    return outcome;
}

/// Returns the missing pages that views will want and do not want yet, most urgent first, as the scene numbers them.
std::vector<WantedPage> ResidencyPolicy::ahead() const {
    std::vector<std::vector<WantedPage>> lists;
    for (size_t i = 0; i < trees_.size(); ++i) {
        lists.emplace_back();
        for (WantedPage wanted : trees_[i].ahead.wanted) {
            wanted.page += numbers_.firstPage(i);
            if (!isResident(wanted.page) && rankOf(wanted.page) == Rank::Ahead) lists.back().push_back(wanted);
        }
    }
    return merged(std::move(lists));
}

/// Wishes for the blocks that hold children of the awaited pages, but those in `blocks`: they are wished for already.
void ResidencyPolicy::wishForBlocks(PageChoice Tree::*choice, double urgency, std::set<uint64_t>& blocks,
                                    std::vector<Wish>& wishes) const {
    for (size_t i = 0; i < trees_.size(); ++i) {
        const Tree& tree = trees_[i];
        uint64_t last = UINT64_MAX;
        for (const uint64_t page : (tree.*choice).awaited) {
            for (const uint64_t child : childrenOf(tree.dataset->pages[page])) {
                const uint64_t own = child / kEntriesPerBlock;
                if (own == last || tree.blocksSeen[own] != 0) continue;
                const Request block = numbers_.inScene(i, Request::directoryBlock(own));
                if (!blocks.insert(block.number).second) continue;
                last = own;
                wishes.push_back({block, urgency});
            }
        }
    }
}

/// The state of a page, or those of all pages in a block of a directory.
std::span<uint8_t> ResidencyPolicy::statesOf(Request request) {
    const std::span<uint8_t> states(states_);
    if (request.isPage()) return states.subspan(request.number, 1);
    const size_t dataset = numbers_.datasetOf(request);
    const uint64_t first = numbers_.inDataset(request).number * kEntriesPerBlock;
    return states.subspan(numbers_.firstPage(dataset) + first,
                          std::min<uint64_t>(kEntriesPerBlock, trees_[dataset].dataset->pages.size() - first));
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
    uint64_t bytes = pageUnits_.bytes() + resident_.bytes() + states_.bytes() + loadedIn_.bytes() + ranks_.bytes() +
                     allocator_.bytesHeld();
    for (const Tree& tree : trees_) {
        bytes += sizeof(tree) + tree.blocksSeen.bytes() + bytesOf(tree.views) + tree.priorities.bytesHeld();
        for (const PageChoice* choice : {&tree.choice, &tree.ahead})
            bytes += bytesOf(choice->wanted) + choice->refined.bytes();
    }
    for (const auto& [number, motion] : motions_)
        for (const Sight& sight : motion.sights) bytes += sizeof(sight) + sight.seen.bytesHeld();
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
