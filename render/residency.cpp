#include "render/residency.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace vcp {

Result<std::unique_ptr<Residency>> Residency::create(Device& device, PageAccess access, const ResidencyOptions& options,
                                                     std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source) {
    std::unique_ptr<Residency> made(new Residency(options));
    made->options_.loader.withColour = options.loader.withColour && dataset->hasColour();
    made->dataset_ = std::move(dataset);
    VCP_TRY(made->createPool(device, access));
    made->loader_ = std::make_unique<PageLoader>(std::move(source), made->options_.loader);
    return made;
}

Result<void> Residency::createPool(Device& device, PageAccess access) {
    for (uint64_t budget = options_.budgetBytes;; budget /= 2) {
        const PoolShape shape = poolShapeFor(*dataset_, hasColour(), budget, poolChunkBytes(device.limits(), access));
        policy_ = std::make_unique<ResidencyPolicy>(dataset_, hasColour(), shape, options_.order);
        if (!dataset_->pages.empty() && !policy_->hasRoom())
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("a budget of {} bytes has no room for the coarsest page, which takes {}", budget,
                                                pageUnits(dataset_->pages[0], hasColour()) * kPoolUnitBytes)};
        auto pool = PagePool::create(device, shape.units * kPoolUnitBytes, access);
        if (pool) {
            pool_ = std::move(*pool);
            return {};
        }
        // Coarser pages of all are better than none.
        if (pool.error().code != ErrorCode::Device || budget / 2 < kPoolUnitBytes) return pool.error();
    }
}

Result<UpdateResult> Residency::update(const SelectionView& view) {
    tableChanged_ = false;
    std::vector<LoadedPage> loaded = loader_->collect(options_.uploadBytes);
    std::vector<Error> problems;
    for (const LoadedPage& page : loaded)
        if (!page.bytes && policy_->giveUp(page.page)) problems.push_back(page.bytes.error());
    policy_->look(view);
    for (const LoadedPage& page : loaded) {
        if (!page.bytes) continue;
        if (auto placed = place(page); !placed) return placed.error();
    }
    PolicyOutcome outcome = policy_->finish();
    loader_->request(std::move(outcome.wishes));
    listens_ = outcome.missing > 0 && options_.order == LoadOrder::Feedback;
    const bool changed = outcome.drawable.cut != cut_;
    tableChanged_ = tableChanged_ || changed;
    cut_ = outcome.drawable.cut;
    UpdateResult result = report(outcome);
    result.changed = changed;
    result.problems = std::move(problems);
    return result;
}

UpdateResult Residency::report(const PolicyOutcome& outcome) const {
    const LoaderStats loader = loader_->stats();
    const PolicyCounts& counts = policy_->counts();
    UpdateResult result;
    result.settled = outcome.drawable.complete;
    result.drawable = !cut_.empty();
    result.relaxed = outcome.relaxed;
    result.errorPixels = outcome.drawable.errorPixels;
    result.residentBytes = policy_->unitsTaken() * kPoolUnitBytes;
    result.heldBytesMax = loader.heldBytesMax;
    result.bytesRead = loader.bytesRead;
    result.failures = loader.failures;
    result.loads = counts.loads;
    result.evictions = counts.evictions;
    result.reloads = counts.reloads;
    result.pagesPending = static_cast<uint32_t>(loader_->pending());
    result.pagesResident = static_cast<uint32_t>(policy_->pagesResident());
    result.pagesInCut = static_cast<uint32_t>(cut_.size());
    result.pagesWanted = static_cast<uint32_t>(outcome.wanted);
    result.pagesMissing = static_cast<uint32_t>(outcome.missing);
    if (cut_.empty()) return result;
    // Pages are numbered level by level, coarsest first.
    result.coarsestLevel = dataset_->pages[cut_.front()].level;
    result.finestLevel = dataset_->pages[cut_.back()].level;
    return result;
}

Result<bool> Residency::place(const LoadedPage& page) {
    const Placement placement = policy_->place(page.page);
    tableChanged_ = tableChanged_ || !placement.moves.empty();
    for (const PageMove& move : placement.moves) VCP_TRY(pool_->move(move.from, move.to));
    if (!placement.slot) return false;
    const std::span geometry = page.bytes->geometryBytes();
    std::memcpy(&headers_[page.page], geometry.data(), sizeof(PageHeader));
    VCP_TRY(pool_->write(*placement.slot, 0, geometry));
    if (!page.bytes->colour.empty()) VCP_TRY(pool_->write(*placement.slot, geometry.size(), page.bytes->colourBytes()));
    return true;
}

uint64_t Residency::colourBytes() const {
    uint64_t bytes = 0;
    if (hasColour()) policy_->forEachResident([&](uint64_t page) { bytes += dataset_->pages[page].colourBytes; });
    return bytes;
}

std::vector<glm::uvec4> Residency::table() const {
    return pageTable(*dataset_, cut_, [&](uint64_t page) {
        const uint32_t texel = pool_->texel(policy_->slotOf(page));
        const bool colour = hasColour() && dataset_->pages[page].colourBytes > 0;
        return ResidentPage{headers_.at(page), texel, colour ? texel + dataset_->pages[page].pageBytes / 16 : 0};
    });
}

}  // namespace vcp
