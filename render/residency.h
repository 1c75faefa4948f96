// Which pages of one dataset are in the pool: takes in what the loader has read, makes room by dropping
// what no recent view wanted, and keeps the cut that can be drawn.
//
// A page's life: wished for (PageLoader::request), read, written into a slot by update(), drawn while the
// selection wants it, dropped when its slot is needed: pages wanted longest ago first, of equals children
// before parents. The root stays. All in the caller's thread but the loader's reads.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "render/page_pool.h"
#include "render/page_table.h"
#include "render/renderer.h"
#include "streaming/page_loader.h"
#include "streaming/page_selection.h"

namespace vcp {

class Residency {
public:
    /// Allocates the pools: never more than budgetBytes together, and no more than the dataset can fill.
    /// Errors: Device, Limit.
    static Result<std::unique_ptr<Residency>> create(Device& device, PageAccess access, uint64_t budgetBytes, bool colour,
                                                     uint32_t loaderThreads, std::shared_ptr<const Dataset> dataset,
                                                     std::shared_ptr<const PageSource> source);

    /// Precondition: no frame is in flight. Never waits for the loader. Errors: Device.
    Result<UpdateResult> update(const SelectionView& view);

    /// Waits until the loader has something, or the time is over.
    void waitForPage(std::chrono::milliseconds timeout) { loader_->waitForPage(timeout); }

    [[nodiscard]] const Dataset& dataset() const { return *dataset_; }
    [[nodiscard]] const std::vector<uint64_t>& cut() const { return cut_; }
    [[nodiscard]] std::vector<glm::uvec4> table() const;
    [[nodiscard]] const PagePool& pages() const { return *pool_; }
    /// Null without colour.
    [[nodiscard]] const PagePool* colours() const { return colourPool_.get(); }

private:
    struct Slots {
        ResidentPage page;
        PoolSlot geometry, colour;
        uint64_t lastWanted = 0;
    };
    Residency() = default;
    Result<void> createPools(Device& device, PageAccess access, uint64_t budgetBytes, bool colour);
    Result<void> takeIn(UpdateResult& result);
    Result<bool> place(uint64_t page, const PageBytes& bytes);
    bool makeRoom();
    void drop(uint64_t page);
    void wish(const Selection& selection);

    std::shared_ptr<const Dataset> dataset_;
    std::unique_ptr<PagePool> pool_, colourPool_;
    std::unique_ptr<PageLoader> loader_;
    std::unordered_map<uint64_t, Slots> slots_;
    std::vector<uint64_t> pageBytes_;  // what selection counts a page with
    std::vector<uint8_t> resident_, unavailable_;
    std::vector<uint64_t> cut_;
    uint64_t budget_ = 0;  // what selection may plan with
    uint64_t updates_ = 0;
};

}  // namespace vcp
