#include "render/view/renderer.h"

#include <chrono>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "render/frame_setup.h"
#include "render/view/renderer_view.h"
#include "render/vulkan/check.h"

namespace vcp {

Renderer::Renderer(std::unique_ptr<View> view) : view_(std::move(view)) {}
Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RendererOptions& options) {
    VCP_TRY(checkBudget(options.budgetBytes));
    if (isHostName(options.device))
        return Error{.code = ErrorCode::Unsupported,
                     .message = "the host draws pictures into files only; here a Vulkan device is needed"};
    auto shared = std::make_shared<Shared>();
    shared->options = options;
    if (options.host) {
        shared->instance = Instance::borrow(options.host->instance);
    } else {
        VCP_TRY_ASSIGN(shared->instance,
                       Instance::create(options.validation, options.surface ? options.surface->instanceExtensions
                                                                            : options.windowExtensions));
    }
    auto view = std::make_unique<View>(shared, options.host ? std::nullopt : options.surface);
    VCP_TRY(view->createDevice(options.faults));
    return std::unique_ptr<Renderer>(new Renderer(std::move(view)));
}

Result<std::unique_ptr<Renderer>> Renderer::addView(const std::optional<SurfaceSource>& surface) {
    Shared& shared = *view_->shared;
    if (!shared.device) return kGone;
    auto view = std::make_unique<View>(view_->shared, surface);
    VCP_TRY(view->attachToDevice());
    VCP_TRY(shared.showPool());
    return std::unique_ptr<Renderer>(new Renderer(std::move(view)));
}

void Renderer::onDeviceLoss(std::function<void()> gone) { view_->gone = std::move(gone); }
const DeviceInfo& Renderer::device() const { return view_->shared->info; }
PageAccess Renderer::access() const { return view_->shared->access; }
std::vector<std::string> Renderer::validationMessages() const { return view_->shared->instance->log().messages(); }

Result<void> Renderer::open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source) {
    std::vector<PlacedDataset> one;
    one.push_back({std::move(dataset), std::move(source), {}});
    return open(std::move(one), {});
}

Result<void> Renderer::open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces) {
    if (!view_->shared->device) return kGone;
    close();
    VCP_TRY(setSurfaces(surfaces));
    const auto opened = view_->shared->addDatasets(std::move(datasets));
    if (opened) return {};
    close();
    VCP_TRY(setSurfaces({}));
    return opened;
}

Result<void> Renderer::setBudgets(uint64_t budgetBytes, uint64_t ramBytes) {
    Shared& s = *view_->shared;
    if (!s.device) return kGone;
    VCP_TRY(checkBudget(budgetBytes));
    VCP_TRY_ASSIGN(const auto pageBytes, s.pageBudget(budgetBytes));
    if (!s.datasets.empty()) {
        s.hidePool();
        const auto done = sceneOf(s.datasets)->setBudgets(poolsOf(*s.device, s.access), pageBytes, s.pageRam(ramBytes));
        VCP_TRY(s.showPool());
        if (!done) return done;
    }
    s.options.budgetBytes = budgetBytes;
    s.options.ramBytes = ramBytes;
    return {};
}

namespace {

/// What rays of light march is known before it is copied to the device.
Result<void> checkArrays(std::span<const MesoSurface> surfaces, uint64_t budgetBytes) {
    std::set<const void*> all;
    uint64_t bytes = 0;
    for (const MesoSurface& surface : surfaces) {
        if (!surface.remeshed.surface) continue;
        if (surface.arrays && all.insert(surface.arrays.get()).second)
            bytes += surface.arrays->words.size() * sizeof(uint32_t);
    }
    if (bytes <= budgetBytes) return {};
    return Error{
        .code = ErrorCode::Limit,
        .message = fmt::format("what shadows on remeshed surfaces need takes {} bytes, and the budget is {}: allow "
                               "more, or ask for none",
                               bytes, budgetBytes)};
}

}  // namespace

Result<void> Renderer::setSurfaces(std::span<const MesoSurface> surfaces) {
    Shared& s = *view_->shared;
    if (!s.device) return kGone;
    VCP_TRY(checkArrays(surfaces, s.options.budgetBytes));
    VCP_TRY(s.device->waitForAll());
    const uint64_t before = s.surfaceBytes();
    for (View* view : s.views) view->forgetFrames();
    ++s.mesoVersion;
    if (surfaces.empty()) {
        s.meso.reset();
    } else {
        if (!s.meso) s.meso = std::make_unique<Shared::Meso>();
        s.meso->surfaces.assign(surfaces.begin(), surfaces.end());
    }
    const auto done = s.uploadSurfaces();
    for (View* view : s.views) VCP_TRY(view->makeLayers());
    if (!done || s.datasets.empty() || s.surfaceBytes() == before) return done;
    const auto left = setBudgets(s.options.budgetBytes, s.options.ramBytes);
    if (left) return left;
    s.meso.reset();
    for (View* view : s.views) VCP_TRY(view->makeLayers());
    return left;
}

std::span<const MesoSurface> Renderer::surfaces() const {
    const Shared& s = *view_->shared;
    return s.meso ? std::span<const MesoSurface>(s.meso->surfaces) : std::span<const MesoSurface>();
}

Result<void> Renderer::chooseCells(
    const FrameRequest& request,
    const std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill)>& shareOut) {
    const Shared& s = *view_->shared;
    if (!s.meso || view_->isCastOnHost()) return {};
    return s.meso->pass->chooseCells(request, shareOut);
}

void Renderer::close() {
    Shared& s = *view_->shared;
    s.hidePool();
    s.datasets.clear();
    for (View* view : s.views) {
        view->forgetFrames();
        static_cast<void>(view->makeLayers());  // there are fewer layers: nothing can fail
        for (View::Layer& layer : view->layers) layer.tableStale = true;
    }
}

Result<UpdateResult> Renderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    Shared& s = *view_->shared;
    if (!s.device) return kGone;
    const bool hadDatasets = !s.datasets.empty();
    auto result = s.tryAgain(*view_, [&]() -> Result<UpdateResult> {
        if (hadDatasets && s.datasets.empty()) return kGone;
        return view_->updateAll(request);
    });
    if (!result) return result;
    result->deviceLosses = s.losses;
    result->changed = std::exchange(view_->mesoSeen, s.mesoVersion) != s.mesoVersion || result->changed;
    result->drawable = result->drawable || s.meso;
    return result;
}

void Renderer::waitForPage(std::chrono::milliseconds timeout) {
    const Shared& s = *view_->shared;
    if (s.meso && s.meso->pass)
        for (const auto& heights : s.meso->pass->heights())
            if (heights->isReading()) return heights->wait(timeout);
    vcp::waitForPage(s.datasets, timeout);
}

}  // namespace vcp
