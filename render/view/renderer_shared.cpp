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
    // The shaders draw what the processor does not.
    if (auto prepared = prepareOnHost(meso->surfaces); prepared && options.hostRays && info.software)
        meso->prepared = *std::move(prepared);
    else
        meso->prepared.clear();
    // Heights come tile by tile: they leave half of what there is to pages.
    const uint64_t heightBytes = options.budgetBytes / 2;
    const auto upload = [&]() -> Result<void> {
        if (meso->pass) return meso->pass->setSurfaces(meso->surfaces, heightBytes);
        VCP_TRY_ASSIGN(meso->resources, MesoResources::create(*device));
        meso->pass = std::make_unique<MesoSurfacePass>(*device, *meso->resources);
        return meso->pass->setSurfaces(meso->surfaces, heightBytes);
    };
    const auto done = upload();
    if (!done) meso.reset();
    return done;
}

Result<void> Renderer::Shared::needImages(size_t dataset) {
    const Residency& residency = *datasets[dataset].residency;
    const auto shown = residency.images();
    if (!shown) return {};
    images.resize(datasets.size());
    DeviceImages& there = images[dataset];
    if (there.words && there.version == residency.imagesVersion()) return {};
    VCP_TRY(device->waitForAll());
    there = {};
    for (View* view : views) view->forgetImages();
    VCP_TRY_ASSIGN(auto words, uploadImages(*device, *shown));
    there = {residency.imagesVersion(), std::make_shared<const Buffer>(std::move(words))};
    return {};
}

Result<void> Renderer::Shared::addDatasets(std::vector<PlacedDataset> placed) {
    if (placed.empty()) return showPool();
    RendererOptions left = options;
    VCP_TRY_ASSIGN(const auto beside, pageBudget(options.budgetBytes));
    uint64_t most = std::min(budgetOfImages(beside), options.ramBytes / 2);
    // What the processor draws is not limited by what shaders address.
    if (!options.hostRays || !info.software) most = std::min(most, mostImageBytes(*device));
    VCP_TRY_ASSIGN(auto found, findImages(placed, options.colour, most));
    VCP_TRY_ASSIGN(left.budgetBytes, budgetOfPages(beside, found.bytes()));
    VCP_TRY_ASSIGN(auto opened, openResidencies(poolsOf(*device, access), left, std::move(placed), std::move(found)));
    std::move(opened.begin(), opened.end(), std::back_inserter(datasets));
    return showPool();
}

void Renderer::Shared::hidePool() {
    if (device) static_cast<void>(device->waitForAll());
    images.clear();
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
    if (const SceneResidency* const scene = sceneOf(datasets); scene != nullptr && !scene->hasPool()) datasets.clear();
    if (!datasets.empty()) {
        const PagePool& pool = poolOf(*datasets.front().residency);
        const std::pair layout(pool.chunks(), pool.chunkShift());
        if (layout != std::exchange(poolLayout, layout)) clearPipelines();
    }
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
    images.clear();
    SceneResidency* const scene = sceneOf(datasets);
    if (scene != nullptr) scene->releasePool();
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
    if (done && scene != nullptr) done = scene->rebuild(poolsOf(*device, access));
    VCP_TRY(showPool());
    return done;
}

bool Renderer::Shared::recover(View& asked, bool mayRebuild) {
    if (!device) return false;
    if (device->isLost()) return mayRebuild && rebuild(asked).ok();
    if (!device->takeOutOfMemory() || datasets.empty()) return false;
    hidePool();
    SceneResidency& scene = *sceneOf(datasets);
    if (!scene.hasPool()) return false;
    // A pool that the coarsest pages fill stays as it is.
    const auto done = scene.setBudgets(poolsOf(*device, access), scene.pages().bytes() / 2, pageRam(options.ramBytes));
    if (!done && done.error().code != ErrorCode::Limit) return false;
    return showPool().ok() && done.ok();
}

}  // namespace vcp
