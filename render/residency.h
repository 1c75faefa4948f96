// Which pages of one dataset are in the pool: carries out what the policy (streaming/residency_policy.h) decides,
// between the loader's threads and the pool in the device's memory.
//
// A page's life: wished for (PageLoader::request), read, written into a slot by update(), drawn while views
// want it, evicted when its slot is needed. What an update takes in is capped, so that no frame waits for
// many pages. All in the caller's thread but the loader's reads.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "render/page_pool.h"
#include "render/page_table.h"
#include "render/renderer.h"
#include "streaming/page_loader.h"
#include "streaming/residency_policy.h"

namespace vcp {

struct ResidencyOptions {
    uint64_t budgetBytes = 512ull << 20;  ///< of the pool
    uint64_t uploadBytes = 16ull << 20;   ///< that one update takes in; one page at least
    LoadOrder order = LoadOrder::Feedback;
    LoaderOptions loader;
};

class Residency {
public:
    /// Allocates the pool: never more than budgetBytes, and no more than the dataset can fill. Where the device
    /// has not so much, half of it, and so on. Errors: Device; Limit, where the coarsest page has no room.
    static Result<std::unique_ptr<Residency>> create(Device& device, PageAccess access, const ResidencyOptions& options,
                                                     std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source);

    /// Precondition: no frame is in flight. Never waits for the loader. Errors: Device.
    Result<UpdateResult> update(const SelectionView& view);

    /// Whether what rays meet would be of use: pages are missing, and are read in the order that rays ask for them.
    [[nodiscard]] bool listens() const { return listens_; }
    void hear(const RayFeedback& feedback, const SelectionView& view) { policy_->hear(feedback, view); }

    /// Waits until the loader has something, or the time is over.
    void waitForPage(std::chrono::milliseconds timeout) { loader_->waitForPage(timeout); }

    [[nodiscard]] const Dataset& dataset() const { return *dataset_; }
    [[nodiscard]] const std::vector<uint64_t>& cut() const { return cut_; }
    [[nodiscard]] std::vector<glm::uvec4> table() const;
    /// Whether table() is another one since the update before: another cut, or pages in other places.
    [[nodiscard]] bool tableChanged() const { return tableChanged_; }
    [[nodiscard]] const PagePool& pages() const { return *pool_; }
    [[nodiscard]] bool hasColour() const { return options_.loader.withColour; }
    /// Of the pages in the pool.
    [[nodiscard]] uint64_t colourBytes() const;

private:
    explicit Residency(const ResidencyOptions& options) : options_(options) {}
    Result<void> createPool(Device& device, PageAccess access);
    Result<bool> place(const LoadedPage& page);
    UpdateResult report(const PolicyOutcome& outcome) const;

    ResidencyOptions options_;
    std::shared_ptr<const Dataset> dataset_;
    std::unique_ptr<ResidencyPolicy> policy_;
    std::unique_ptr<PagePool> pool_;
    std::unique_ptr<PageLoader> loader_;
    std::unordered_map<uint64_t, PageHeader> headers_;  // of pages that are or were resident
    std::vector<uint64_t> cut_;
    bool listens_ = false, tableChanged_ = false;
};

}  // namespace vcp
