#include "render/residencies.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"

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

double occlusionRadiusAmong(std::span<const PictureDataset> shown) {
    constexpr double kPart = 0.1, kFar = std::numeric_limits<double>::infinity();
    glm::dvec3 lo(kFar), hi(-kFar);
    for (const auto& [dataset, placement] : shown) {
        const FileHeader& header = dataset.header;
        const glm::dvec3 corners[2] = {{header.boundsMin[0], header.boundsMin[1], header.boundsMin[2]},
                                       {header.boundsMax[0], header.boundsMax[1], header.boundsMax[2]}};
        for (int i = 0; i < 8; ++i) {
            const glm::dvec3 corner = placement.toWorld({corners[i & 1].x, corners[i >> 1 & 1].y, corners[i >> 2].z});
            lo = glm::min(lo, corner), hi = glm::max(hi, corner);
        }
    }
    return kPart * glm::distance(lo, hi);
}

Result<std::optional<UpdateResult>> updateShown(std::span<const ShownResidency> shown, const FrameRequest& request,
                                                ViewNumber number) {
    std::vector<UpdateResult> results;
    uint64_t cuts = 0;
    for (const ShownResidency& each : shown) {
        VCP_TRY_ASSIGN(auto one, each.residency->update(selectionView(requestIn(each.placement, request)), number));
        *each.errorPixels = one.errorPixels;
        results.push_back(std::move(one));
        cuts = (cuts + each.residency->cutNumber(number)) * 0x9e3779b97f4a7c15;
    }
    std::optional<UpdateResult> all;
    for (size_t i = 0; i < shown.size(); ++i) {
        UpdateResult& one = results[i];
        if (shown.size() > 1 && hasLight(request.shading)) {
            shown[i].residency->surroundWith(cuts, number);
            one.awaitsRays = one.awaitsRays || (one.settled && shown[i].residency->asksRays(number));
            one.settled = one.settled && !one.awaitsRays;
        }
        if (all)
            add(*all, one);
        else
            all = std::move(one);
    }
    return all;
}

void seeAll(std::vector<SeenPages> seen, ViewNumber number) {
    const bool isFinal = std::all_of(seen.begin(), seen.end(),
                                     [](const SeenPages& each) { return each.residency->hasAll(each.hit.byCamera); });
    for (SeenPages& each : seen) {
        if (!isFinal) each.hit.byLight.clear();
        each.residency->see(each.hit, each.view, each.cutNumber, number);
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
