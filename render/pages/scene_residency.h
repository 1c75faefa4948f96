// Which pages of a scene's datasets are in the pool: carries out what the policy (streaming/residency_policy.h)
// decides, between the loader's threads and the pool: memory of the device, or the host's own. There is one policy, one
// pool and one loader for all datasets, so memory and reads go to what is seen; what a view draws of each is with its
// Residency.
//
// A page's life: wished for (PageLoader::request), read, written into a slot by update(), drawn while views want it,
// evicted when its slot is needed. One update takes in a limited number of bytes, so that no frame waits for many
// pages. All but the loader's reads runs in the caller's thread. Several views may share the pool, each with a number
// of its own and cuts of its own; an update of one may change the others' cuts.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "render/pages/page_memory.h"
#include "render/pages/residency.h"
#include "render/pages/update_result.h"
#include "streaming/page_loader.h"
#include "streaming/residency_policy.h"
#include "streaming/scene_source.h"

namespace vcp {

struct ResidencyOptions {
    uint64_t budgetBytes = 512ull << 20;  ///< bytes of the pool
    uint64_t uploadBytes = 16ull << 20;   ///< taken in by one update, half of it while a view moves; one page at least
    LoadOrder order = LoadOrder::Feedback;
    bool hiddenToo = false;            ///< views want what no ray hits, too
    std::vector<uint64_t> imageBytes;  ///< by dataset, most bytes of its images in memory
    LoaderOptions loader;
};

class SceneResidency {
public:
    /// Takes the pool from `memory`: never more than budgetBytes, and no more than the datasets can fill. Where there
    /// is less memory, takes half of it, and so on. Errors: Device; Limit, where the coarsest pages have no room.
    static Result<std::shared_ptr<SceneResidency>> create(const PageMemorySource& memory,
                                                          const ResidencyOptions& options,
                                                          std::vector<SceneSource::Part> datasets);

    [[nodiscard]] Residency& dataset(size_t number) { return datasets_[number]; }
    [[nodiscard]] const Residency& dataset(size_t number) const { return datasets_[number]; }
    [[nodiscard]] size_t datasets() const { return datasets_.size(); }

    /// Sets other budgets, from now on. Precondition: no frame is in flight. The pool is made anew without there ever
    /// being more than one: pages go from the old one to the new through the memory that `ramBytes` allows, coarse ones
    /// first; others are read again. Ends reads that are under way. Errors: Device; Limit, where the coarsest pages
    /// would have no room: nothing changes then.
    Result<void> setBudgets(const PageMemorySource& memory, uint64_t budgetBytes, uint64_t ramBytes);

    /// After the device and all that was in it were lost: releases what there was of it, then begins anew on another.
    void releasePool();
    Result<void> rebuild(const PageMemorySource& memory);

    /// Begins to show a dataset's images, which are its source's, within so many bytes; until then the colours of
    /// vertices are shown. What pages need that are in the pool is found from their bytes. Ends reads that are under
    /// way. Errors: Device.
    Result<void> showImages(size_t dataset, std::shared_ptr<const ImagePieces> images, uint64_t mostBytes);

    struct Update {
        UpdateResult all;               ///< what holds for all datasets; Residency::cutOf says what is drawn of each
        std::vector<DrawableCut> cuts;  ///< for each dataset
    };
    /// Takes in pages; never waits for the loader. Copies wait for the frames in flight (page_memory.h). `views`: for
    /// each dataset, what the view sees of it; none where it does not show it. Errors: Device.
    Result<Update> update(std::span<const std::optional<SelectionView>> views, ViewNumber number = 0);
    void forgetView(ViewNumber number);

    /// Waits until the loader has a page, or the time is over.
    bool waitForPage(std::chrono::milliseconds timeout) { return loader_->waitForPage(timeout); }
    /// There is none after an error of setBudgets() or rebuild(): then only the destructor may be called.
    [[nodiscard]] bool hasPool() const { return pool_ != nullptr; }
    [[nodiscard]] const PageMemory& pages() const { return *pool_; }

private:
    friend class Residency;
    explicit SceneResidency(const ResidencyOptions& options) : options_(options) {}
    struct CarriedPage {
        uint64_t page = 0;
        std::vector<std::byte> bytes;  // geometry followed by colour
    };
    Result<void> createPool(const PageMemorySource& memory);
    void startLoader();
    Result<std::vector<CarriedPage>> carryOut();
    Result<void> carryIn(std::vector<CarriedPage> carried);
    /// Forgets what the pool holds; it is read again.
    void forgetPages();
    /// Puts what was read where it belongs.
    Result<void> takeIn(std::span<const Loaded> loaded);
    /// Returns a slot for the page, with pages moved out of its way; nothing where there is none.
    Result<std::optional<PoolSlot>> slotFor(uint64_t page);
    Result<void> place(uint64_t page, const PageBytes& bytes);
    void giveUp(const Loaded& failed);
    /// Tells the images what a view draws, and returns the pieces of them to read.
    void forgetEvicted(Residency& dataset);
    std::vector<Wish> imageWishes(std::span<const std::optional<SelectionView>> views,
                                  std::span<const DrawableCut> cuts, ViewNumber number);
    /// The error of a pool of so many bytes without room for the coarsest pages.
    [[nodiscard]] Error lacksRoom(uint64_t budgetBytes, const ResidencyPolicy& policy) const;
    /// Bytes that one update takes in, and that the loader reads before it.
    [[nodiscard]] uint64_t uploadBytes() const {
        return std::max<uint64_t>(1, policy_->isMoving() ? options_.uploadBytes / 2 : options_.uploadBytes);
    }
    [[nodiscard]] const SceneNumbers& numbers() const { return source_->numbers(); }
    struct PageRoot {
        PageHeader header;
        std::array<uint32_t, 8> octants{};  // words of the root's octants, where it is an internal node
    };

    ResidencyOptions options_;
    std::vector<PooledDataset> pooled_;
    std::deque<Residency> datasets_;  // of each of them
    std::unique_ptr<ResidencyPolicy> policy_;
    std::unique_ptr<PageMemory> pool_;
    std::shared_ptr<const SceneSource> source_;
    std::unique_ptr<PageLoader> loader_;
    LoaderStats past_;                              // counts of the loaders before this one
    std::unordered_map<uint64_t, PageRoot> roots_;  // of pages that are or were resident
    std::vector<Error> problems_;                   // not reported yet
    std::vector<Request> tooLarge_;                 // given up because reading them takes more memory than there is
    std::vector<bool> listens_;  // for each dataset, whether rays are to say which pages are read first
};

}  // namespace vcp
