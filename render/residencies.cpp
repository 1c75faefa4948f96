#include "render/residencies.h"

#include <algorithm>

#include <fmt/format.h>

namespace vcp {

namespace {

constexpr uint64_t kLeastBudget = 1ull << 20;
constexpr uint64_t kMoreThanAnyBudget = 1ull << 60;

}  // namespace

Result<void> checkBudget(uint64_t budgetBytes) {
    if (budgetBytes >= kLeastBudget) return {};
    return Error{.code = ErrorCode::Usage,
                 .message = fmt::format("a budget of {} bytes is too small; at least {}", budgetBytes, kLeastBudget)};
}

uint64_t largestPoolBytes(const Dataset& dataset, bool withColour) {
    return poolShapeFor(dataset, withColour && dataset.hasColour(), kMoreThanAnyBudget, kMoreThanAnyBudget).units *
           kPoolUnitBytes;
}

Result<std::vector<PlacedResidency>> openResidencies(const PageMemorySource& memory, const RendererOptions& options,
                                                     std::vector<PlacedDataset> placed) {
    ResidencyOptions each;
    each.order = options.order;
    each.hiddenToo = options.hiddenToo;
    each.loader.withColour = options.colour;
    const auto loaders = uint32_t(std::max<size_t>(placed.size(), 1));
    uint32_t threads = options.loaderThreads;
    if (threads == 0)
        for (const PlacedDataset& one : placed) threads = std::max(threads, one.loaderThreads);
    each.loader.threads = std::max(threads / loaders, 1u);
    each.loader.allThreads = loaders * each.loader.threads;
    each.uploadBytes = options.uploadBytes / loaders;
    each.loader.heldBytes = options.ramBytes / loaders;
    std::vector<uint64_t> bytes;
    for (const PlacedDataset& one : placed) bytes.push_back(largestPoolBytes(*one.dataset, options.colour));
    const std::vector<uint64_t> shares = budgetShares(options.budgetBytes, bytes);
    std::vector<PlacedResidency> opened;
    for (size_t i = 0; i < placed.size(); ++i) {
        each.budgetBytes = shares[i];
        const bool isShared = placed.size() > 1 && !placed[i].dataset->pages.empty();
        const uint64_t needed =
            isShared ? placed[i].source->bytesToRead(0, options.colour && placed[i].dataset->hasColour()) : 0;
        if (needed > each.loader.heldBytes)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("{} datasets share {} bytes of memory for pages on their way, and to "
                                                "read the coarsest page of one takes {}: allow more",
                                                placed.size(), options.ramBytes, needed)};
        VCP_TRY_ASSIGN(auto residency,
                       Residency::create(memory, each, std::move(placed[i].dataset), std::move(placed[i].source)));
        opened.push_back({std::move(residency), placed[i].placement});
    }
    return opened;
}

void waitForPage(std::span<const PlacedResidency> datasets, std::chrono::milliseconds timeout) {
    if (datasets.size() == 1) return static_cast<void>(datasets.front().residency->waitForPage(timeout));
    // The datasets take turns until one has pages.
    constexpr std::chrono::milliseconds kTurn(5);
    const auto until = std::chrono::steady_clock::now() + timeout;
    for (const PlacedResidency& placed : datasets) {
        if (std::chrono::steady_clock::now() >= until) return;
        if (placed.residency->waitForPage(std::min(timeout, kTurn))) return;
    }
}

void add(UpdateResult& all, const UpdateResult& one) {
    all.changed = all.changed || one.changed;
    all.settled = all.settled && one.settled;
    all.awaitsRays = all.awaitsRays || one.awaitsRays;
    all.relaxed = all.relaxed || one.relaxed;
    all.errorPixels = std::max(all.errorPixels, one.errorPixels);
    all.residentBytes += one.residentBytes;
    all.bytesRead += one.bytesRead;
    all.heldBytesMax += one.heldBytesMax;
    all.loads += one.loads;
    all.evictions += one.evictions;
    all.reloads += one.reloads;
    all.failures += one.failures;
    all.pagesResident += one.pagesResident;
    all.pagesInCut += one.pagesInCut;
    all.pagesWanted += one.pagesWanted;
    all.pagesMissing += one.pagesMissing;
    all.pagesPending += one.pagesPending;
    all.problems.insert(all.problems.end(), one.problems.begin(), one.problems.end());
    if (!one.drawable) return;
    all.coarsestLevel = all.drawable ? std::min(all.coarsestLevel, one.coarsestLevel) : one.coarsestLevel;
    all.finestLevel = std::max(all.finestLevel, one.finestLevel);
    all.drawable = true;
}

}  // namespace vcp
