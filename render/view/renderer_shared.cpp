// What the views of a renderer share: pools, budgets, surfaces, and what is made anew after a loss.
#include <algorithm>

#include <sys/sysinfo.h>

#include <fmt/format.h>

#include "render/view/renderer_view.h"

namespace vcp {

namespace {

// Elements of a texel buffer that hold a picture of 4096 x 4096, or a chunk of the pool of 256 MiB.
constexpr uint32_t kLongTexelBuffer = 1u << 24;

}  // namespace

void Renderer::Shared::take(std::unique_ptr<Device> made) {
    device = std::move(made);
    info = device->info();
    const bool longTexels = device->limits().maxTexelBufferElements >= kLongTexelBuffer;
    access = options.access != PageAccess::Auto ? options.access
             : info.software && longTexels      ? PageAccess::TexelBuffer
                                                : PageAccess::StorageBuffer;
    stripes = info.software ? std::max(1u, uint32_t(get_nprocs())) : 1;
}

Result<void> Renderer::Shared::uploadSurfaces() {
    if (!meso) return {};
    const auto upload = [&]() -> Result<void> {
        if (meso->pass) return meso->pass->setSurfaces(meso->surfaces);
        VCP_TRY_ASSIGN(meso->resources, MesoResources::create(*device));
        meso->pass = std::make_unique<MesoSurfacePass>(*device, *meso->resources);
        return meso->pass->setSurfaces(meso->surfaces);
    };
    const auto done = upload();
    if (!done) meso.reset();
    return done;
}

Result<void> Renderer::Shared::addDatasets(std::vector<PlacedDataset> placed) {
    VCP_TRY_ASSIGN(auto opened, openResidencies(poolsOf(*device, access), options, std::move(placed)));
    std::move(opened.begin(), opened.end(), std::back_inserter(datasets));
    return showPool();
}

Result<void> Renderer::Shared::setShares(uint64_t budgetBytes, uint64_t ramBytes) {
    std::vector<uint64_t> bytes;
    for (const PlacedResidency& placed : datasets)
        bytes.push_back(largestPoolBytes(placed.residency->dataset(), placed.residency->hasColour()));
    const std::vector<uint64_t> shares = budgetShares(budgetBytes, bytes);
    // Pools that shrink are changed first, so that all together never exceed the budget.
    for (const bool shrinks : {true, false})
        for (size_t i = 0; i < datasets.size(); ++i) {
            Residency& residency = *datasets[i].residency;
            if ((residency.hasPool() && residency.pages().bytes() > shares[i]) != shrinks) continue;
            VCP_TRY(residency.setBudgets(poolsOf(*device, access), shares[i], ramBytes / datasets.size()));
        }
    return {};
}

void Renderer::Shared::hidePool() {
    if (device) static_cast<void>(device->waitForAll());
    for (View* view : views) {
        for (View::Layer& layer : view->layers) layer.dataset = layer.residency = nullptr;
        for (View::Frame& frame : view->frames) {
            frame.submission = 0;  // what its rays asked for is not what is shown next
            view->bindPools(frame);
        }
    }
}

Result<void> Renderer::Shared::showPool() {
    static_cast<void>(device->takeOutOfMemory());  // a pool that was halved for it is fine
    if (std::any_of(datasets.begin(), datasets.end(),
                    [](const PlacedResidency& each) { return !each.residency->hasPool(); }))
        datasets.clear();
    std::vector<std::pair<uint32_t, uint32_t>> layouts;
    for (const PlacedResidency& each : datasets)
        layouts.emplace_back(poolOf(*each.residency).chunks(), poolOf(*each.residency).chunkShift());
    if (!layouts.empty() && layouts != std::exchange(poolLayouts, layouts)) clearPipelines();
    for (View* view : views) VCP_TRY(view->showDatasets());
    return {};
}

void Renderer::Shared::clearPipelines() {
    if (device) static_cast<void>(device->waitForAll());
    beam.clear();
    trace.clear();
    paperTrace.clear();
    light.clear();
    sceneLight.clear();
    shade.clear();
    feedback.clear();
    compose.clear();
    accumulate.clear();
}

Result<void> Renderer::Shared::rebuild(View& asked) {
    ++losses;
    for (View* view : views) view->release();
    for (const PlacedResidency& placed : datasets) placed.residency->releasePool();
    clearPipelines();
    if (meso) *meso = {.surfaces = std::move(meso->surfaces)};
    device.reset();
    DeviceFaults faults = options.faults;
    faults.lostAtSubmission = 0;
    // A view with a window decides which queue the device must have.
    const auto windowed =
        std::find_if(views.begin(), views.end(), [](const View* view) { return view->surface.has_value(); });
    View* const first = windowed != views.end() ? *windowed : &asked;
    VCP_TRY(first->createDevice(faults));
    for (View* view : views)
        if (view != first) VCP_TRY(view->attachToDevice());
    Result<void> done = uploadSurfaces();
    for (const PlacedResidency& placed : datasets)
        if (done) done = placed.residency->rebuild(poolsOf(*device, access));
    VCP_TRY(showPool());
    return done;
}

bool Renderer::Shared::recover(View& asked, bool mayRebuild) {
    if (!device) return false;
    if (device->isLost()) return mayRebuild && rebuild(asked).ok();
    if (!device->takeOutOfMemory() || datasets.empty()) return false;
    hidePool();
    // A dataset whose coarsest page has all of its pool already stays as it is.
    bool halved = false;
    for (const PlacedResidency& placed : datasets) {
        if (!placed.residency->hasPool()) continue;
        const auto done = placed.residency->setBudgets(poolsOf(*device, access), placed.residency->pages().bytes() / 2,
                                                       options.ramBytes / datasets.size());
        if (!done && done.error().code != ErrorCode::Limit) return false;
        halved = halved || done.ok();
    }
    return showPool().ok() && halved;
}

}  // namespace vcp
