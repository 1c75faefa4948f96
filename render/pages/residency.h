// Which pages of one dataset are in the pool: carries out what the policy (streaming/residency_policy.h) decides,
// between the loader's threads and the pool: memory of the device, or the host's own.
//
// A page's life: wished for (PageLoader::request), read, written into a slot by update(), drawn while views want it,
// evicted when its slot is needed. One update takes in a limited number of bytes, so that no frame waits for many
// pages. All but the loader's reads runs in the caller's thread. Several views may share the pool, each with a number
// of its own and a cut of its own; an update of one may change the others' cuts.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "render/pages/page_memory.h"
#include "render/pages/page_table.h"
#include "render/pages/update_result.h"
#include "streaming/page_loader.h"
#include "streaming/residency_policy.h"

namespace vcp {

struct ResidencyOptions {
    uint64_t budgetBytes = 512ull << 20;  ///< bytes of the pool
    uint64_t uploadBytes = 16ull << 20;   ///< taken in by one update, half of it while a view moves; one page at least
    LoadOrder order = LoadOrder::Feedback;
    bool hiddenToo = false;  ///< views want what no ray hits, too
    LoaderOptions loader;
};

class Residency {
public:
    /// Takes the pool from `memory`: never more than budgetBytes, and no more than the dataset can fill. Where there is
    /// less memory, takes half of it, and so on. Errors: Device; Limit, where the coarsest page has no room.
    static Result<std::unique_ptr<Residency>> create(const PageMemorySource& memory, const ResidencyOptions& options,
                                                     std::shared_ptr<const Dataset> dataset,
                                                     std::shared_ptr<const PageSource> source);

    /// Sets other budgets, from now on. Precondition: no frame is in flight. The pool is made anew without there ever
    /// being more than one: pages go from the old one to the new through the memory that `ramBytes` allows, coarse ones
    /// first; others are read again. Ends reads that are under way. Errors: Device; Limit, where the coarsest page
    /// would have no room: nothing changes then.
    Result<void> setBudgets(const PageMemorySource& memory, uint64_t budgetBytes, uint64_t ramBytes);

    /// After the device and all that was in it were lost: releases what there was of it, then begins anew on another.
    void releasePool();
    Result<void> rebuild(const PageMemorySource& memory);

    /// Takes in pages; never waits for the loader. Copies wait for the frames in flight (page_memory.h). Errors:
    /// Device.
    Result<UpdateResult> update(const SelectionView& view, ViewNumber number = 0);
    void forgetView(ViewNumber number);

    /// Whether the rays' feedback would be used: pages are missing, and are read in the order that rays ask for them.
    [[nodiscard]] bool listens() const { return listens_; }
    void hear(const RayFeedback& feedback, const SelectionView& view) { policy_->hear(feedback, view); }

    /// A number of what the view draws: frames of one cut have the same.
    [[nodiscard]] uint64_t cutNumber(ViewNumber number = 0) { return current(number).number; }
    /// Whether the view's next frame is to say which pages its rays hit: some that could be refined are in the cut, and
    /// no frame of it has said so yet.
    [[nodiscard]] bool asksRays(ViewNumber number = 0) {
        const ViewCut& cut = current(number);
        return cut.pagesUnseen > 0 && cut.answered != cut.number;
    }
    /// Takes in which pages a frame of `view` hit that drew the cut of that number.
    void see(const PagesHit& hit, const SelectionView& view, uint64_t cutNumber, ViewNumber number = 0);
    /// Says what else throws rays of light in the view: any number that differs when that does. The next frame is then
    /// to say anew which pages its rays hit.
    void surroundWith(uint64_t others, ViewNumber number = 0);
    [[nodiscard]] uint64_t others(ViewNumber number = 0) { return current(number).others; }
    /// Whether pages that rays ask for are there, or cannot be read.
    [[nodiscard]] bool hasAll(const std::vector<uint64_t>& pages) const { return policy_->hasAll(pages); }

    /// Waits until the loader has a page, or the time is over.
    bool waitForPage(std::chrono::milliseconds timeout) { return loader_->waitForPage(timeout); }

    [[nodiscard]] const Dataset& dataset() const { return *dataset_; }
    /// The pages that the view can draw now, in directory order.
    [[nodiscard]] const std::vector<uint64_t>& cut(ViewNumber number = 0) { return current(number).pages; }
    /// Those of them that it draws only in some octants.
    [[nodiscard]] const std::vector<PartialPage>& partial(ViewNumber number = 0) { return current(number).partial; }
    [[nodiscard]] std::vector<frame::TableRecord> table(ViewNumber number = 0);
    /// A number that changes whenever the page table may: with another cut, or with pages in other places.
    [[nodiscard]] uint64_t version() const { return policy_->version(); }
    /// There is none after an error of setBudgets() or rebuild(): then only the destructor may be called.
    [[nodiscard]] bool hasPool() const { return pool_ != nullptr; }
    [[nodiscard]] const PageMemory& pages() const { return *pool_; }
    /// Returns the slot of a page that is resident.
    [[nodiscard]] PoolSlot slotOf(uint64_t page) const { return policy_->slotOf(page); }
    [[nodiscard]] bool hasColour() const { return options_.loader.withColour; }
    template <class Visit>
    void forEachResident(Visit&& visit) const {
        policy_->forEachResident(visit);
    }
    /// Bytes of colour of the pages in the pool.
    [[nodiscard]] uint64_t colourBytes() const;

private:
    explicit Residency(const ResidencyOptions& options) : options_(options) {}
    struct CarriedPage {
        uint64_t page = 0;
        std::vector<std::byte> bytes;  // geometry followed by colour
    };
    Result<void> createPool(const PageMemorySource& memory);
    void startLoader();
    Result<std::vector<CarriedPage>> carryOut();
    [[nodiscard]] bool hasRoomIn(PoolShape shape) const;
    /// Returns a slot for the page, with pages moved out of its way; nothing where there is none.
    Result<std::optional<PoolSlot>> slotFor(uint64_t page);
    Result<void> place(uint64_t page, const PageBytes& bytes);
    struct ViewCut {
        std::vector<uint64_t> pages;
        std::vector<PartialPage> partial;
        uint64_t version = UINT64_MAX;
        uint64_t number = 0, reported = 0;  // of the cut, and of that of its last update
        uint64_t answered = 0;              // of the cut of which a frame of this view said what its rays hit
        uint64_t others = 0;                // as surroundWith() said
        uint64_t pagesUnseen = 0;
        SelectionView view;
    };
    /// Returns what a view draws as pages are now.
    ViewCut& current(ViewNumber number);
    void take(DrawableCut drawable, ViewCut& cut);
    /// Bytes that one update takes in, and that the loader reads before it.
    [[nodiscard]] uint64_t uploadBytes() const {
        return std::max<uint64_t>(1, policy_->isMoving() ? options_.uploadBytes / 2 : options_.uploadBytes);
    }
    UpdateResult report(const PolicyOutcome& outcome, const ViewCut& cut) const;

    ResidencyOptions options_;
    std::shared_ptr<const Dataset> dataset_;
    std::unique_ptr<ResidencyPolicy> policy_;
    std::unique_ptr<PageMemory> pool_;
    std::shared_ptr<const PageSource> source_;
    std::unique_ptr<PageLoader> loader_;
    LoaderStats past_;  // counts of the loaders before this one
    struct PageRoot {
        PageHeader header;
        std::array<uint32_t, 8> octants{};  // words of the root's octants, where it is an internal node
    };
    std::unordered_map<uint64_t, PageRoot> roots_;  // of pages that are or were resident
    std::map<ViewNumber, ViewCut> cuts_;
    uint64_t cutsDrawn_ = 0;         // number of the last cut
    std::vector<Error> problems_;    // not reported yet
    std::vector<Request> tooLarge_;  // given up because reading them takes more memory than there is
    bool listens_ = false;
};

}  // namespace vcp
