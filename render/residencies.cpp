#include "render/residencies.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"

namespace vcp {

namespace {

constexpr uint64_t kLeastBudget = 1ull << 20;

/// Adds what is drawn of a dataset.
void add(UpdateResult& all, const UpdateResult& one) {
    all.changed = all.changed || one.changed;
    all.settled = all.settled && one.settled;
    all.awaitsRays = all.awaitsRays || one.awaitsRays;
    all.relaxed = all.relaxed || one.relaxed;
    all.errorPixels = std::max(all.errorPixels, one.errorPixels);
    all.colourPixels = std::max(all.colourPixels, one.colourPixels);
    all.pagesInCut += one.pagesInCut;
    all.pagesWanted += one.pagesWanted;
    all.pagesMissing += one.pagesMissing;
    if (!one.drawable) return;
    all.coarsestLevel = all.drawable ? std::min(all.coarsestLevel, one.coarsestLevel) : one.coarsestLevel;
    all.finestLevel = std::max(all.finestLevel, one.finestLevel);
    all.drawable = true;
}

/// Returns how many threads read for each dataset: as many as its source needs, or the same share of them where that is
/// many, at least one; where `all` is not 0, their share of it.
std::vector<uint32_t> loaderThreads(std::span<const PlacedDataset> placed, uint32_t all) {
    constexpr double kMost = 16;
    double needed = 0;
    for (const PlacedDataset& one : placed) needed += std::max(one.loaderThreads, 1u);
    const double share = all > 0 ? all / needed : std::min(kMost / needed, 1.0);
    std::vector<uint32_t> threads;
    for (const PlacedDataset& one : placed)
        threads.push_back(uint32_t(std::max(share * std::max(one.loaderThreads, 1u), 1.0)));
    return threads;
}

}  // namespace

Result<void> checkBudget(uint64_t budgetBytes) {
    if (budgetBytes >= kLeastBudget) return {};
    return Error{.code = ErrorCode::Usage,
                 .message = fmt::format("a budget of {} bytes is too small; at least {}", budgetBytes, kLeastBudget)};
}

Result<uint64_t> budgetOfPages(uint64_t budgetBytes, uint64_t otherBytes) {
    if (otherBytes == 0) return budgetBytes;
    const uint64_t left = budgetBytes > otherBytes ? budgetBytes - otherBytes : 0;
    if (checkBudget(left)) return left;
    return Error{.code = ErrorCode::Limit,
                 .message = fmt::format("surfaces with mesostructure and images take {} bytes, and a budget of {} "
                                        "leaves too few for the datasets beside them: allow more",
                                        otherBytes, budgetBytes)};
}

uint64_t budgetOfImages(uint64_t budgetBytes) {
    return budgetBytes > kLeastBudget ? std::min(budgetBytes / 2, budgetBytes - kLeastBudget) : 0;
}

uint64_t ramOfPages(uint64_t ramBytes, uint64_t imageBytes) { return ramBytes - std::min(imageBytes, ramBytes / 2); }

uint64_t DatasetImages::bytes() const { return std::accumulate(mostBytes.begin(), mostBytes.end(), uint64_t{0}); }

Result<DatasetImages> findImages(std::span<const PlacedDataset> datasets, bool withColour, uint64_t mostBytes) {
    DatasetImages found{.pieces = {datasets.size(), nullptr}, .mostBytes = std::vector<uint64_t>(datasets.size())};
    for (size_t i = 0; i < datasets.size(); ++i) {
        if (!withColour || !datasets[i].dataset->hasImages()) continue;
        VCP_TRY_ASSIGN(found.pieces[i], datasets[i].source->images());
        if (found.pieces[i]) found.mostBytes[i] = found.pieces[i]->bytes();
    }
    const double share = double(mostBytes) / double(std::max<uint64_t>(found.bytes(), 1));
    if (share < 1)
        for (uint64_t& bytes : found.mostBytes) bytes = uint64_t(share * double(bytes));
    return found;
}

uint64_t imageBytes(std::span<const PlacedResidency> datasets) {
    uint64_t bytes = 0;
    for (const PlacedResidency& placed : datasets) bytes += placed.residency->mostImageBytes();
    return bytes;
}

Result<std::vector<PlacedResidency>> openResidencies(const PageMemorySource& memory, const RendererOptions& options,
                                                     std::vector<PlacedDataset> placed, DatasetImages images) {
    std::vector<PlacedResidency> opened;
    if (placed.empty()) return opened;
    ResidencyOptions all;
    all.budgetBytes = options.budgetBytes;
    all.uploadBytes = options.uploadBytes;
    all.order = options.order;
    all.hiddenToo = options.hiddenToo;
    all.loader.withColour = options.colour;
    all.loader.heldBytes = ramOfPages(options.ramBytes, images.bytes());
    all.imageBytes = images.mostBytes;
    all.loader.threads = loaderThreads(placed, options.loaderThreads);
    std::vector<SceneSource::Part> parts;
    for (size_t i = 0; i < placed.size(); ++i) {
        PlacedDataset& one = placed[i];
        const uint64_t needed = placed.size() > 1 && !one.dataset->pages.empty()
                                    ? one.source->bytesToRead(0, options.colour && one.dataset->hasColour())
                                    : 0;
        if (needed > all.loader.heldBytes)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("reading the coarsest page takes {} bytes, more than the {} of "
                                                "memory for pages on their way: allow more",
                                                needed, all.loader.heldBytes),
                         .file = one.source->name()};
        parts.push_back({std::move(one.dataset), std::move(one.source),
                         images.pieces.empty() ? nullptr : std::move(images.pieces[i])});
    }
    VCP_TRY_ASSIGN(auto scene, SceneResidency::create(memory, all, std::move(parts)));
    for (size_t i = 0; i < placed.size(); ++i)
        opened.push_back({std::shared_ptr<Residency>(scene, &scene->dataset(i)), placed[i].placement});
    return opened;
}

SceneResidency* sceneOf(std::span<const PlacedResidency> datasets) {
    return datasets.empty() ? nullptr : &datasets.front().residency->scene();
}

void waitForPage(std::span<const PlacedResidency> datasets, std::chrono::milliseconds timeout) {
    if (SceneResidency* const scene = sceneOf(datasets)) static_cast<void>(scene->waitForPage(timeout));
}

double occlusionRadiusAmong(std::span<const PictureDataset> shown, std::span<const WorldBox> others) {
    constexpr double kPart = 0.1, kFar = std::numeric_limits<double>::infinity();
    glm::dvec3 lo(kFar), hi(-kFar);
    for (const WorldBox& box : others) lo = glm::min(lo, box.low), hi = glm::max(hi, box.high);
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
    std::optional<UpdateResult> none;
    if (shown.empty()) return none;
    SceneResidency& scene = shown.front().residency->scene();
    std::vector<std::optional<SelectionView>> views(scene.datasets());
    for (const ShownResidency& each : shown)
        views[each.residency->number()] = selectionView(requestIn(each.placement, request));
    VCP_TRY_ASSIGN(auto update, scene.update(views, number));
    std::vector<UpdateResult> results;
    uint64_t cuts = 0;
    for (const ShownResidency& each : shown) {
        const size_t dataset = each.residency->number();
        results.push_back(each.residency->cutOf(*views[dataset], update.cuts[dataset], number));
        *each.errorPixels = results.back().errorPixels;
        cuts = (cuts + each.residency->pagesNumber(number)) * 0x9e3779b97f4a7c15;
    }
    for (size_t i = 0; i < shown.size(); ++i) {
        UpdateResult& one = results[i];
        if (shown.size() > 1 && hasLight(request.shading)) {
            shown[i].residency->surroundWith(cuts, number);
            one.awaitsRays = one.awaitsRays || (one.settled && shown[i].residency->asksRays(number));
            one.settled = one.settled && !one.awaitsRays;
        }
        add(update.all, one);
    }
    return std::optional(std::move(update.all));
}

void seeAll(std::vector<SeenPages> seen, ViewNumber number) {
    const bool isFinal = std::all_of(seen.begin(), seen.end(),
                                     [](const SeenPages& each) { return each.residency->hasAll(each.hit.byCamera); });
    for (SeenPages& each : seen) {
        if (!isFinal) each.hit.byLight.clear();
        each.residency->see(each.hit, each.view, each.pagesNumber, number);
    }
}

bool showsChannels(const Residency& residency, const FrameRequest& request) {
    return residency.hasColour() && residency.hasChannels() && request.shading.channels &&
           request.shading.mode == ShadingMode::Lit;
}

}  // namespace vcp
