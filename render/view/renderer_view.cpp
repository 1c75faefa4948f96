// Renderer: the life of a view.
#include "render/view/renderer_view.h"

#include <algorithm>
#include <limits>

#include "render/frame_setup.h"
#include "render/vulkan/check.h"

namespace vcp {

Renderer::View::View(std::shared_ptr<Shared> with, std::optional<SurfaceSource> window)
    : shared(std::move(with)), surface(std::move(window)), number(shared->nextNumber++) {
    shared->views.push_back(this);
}

Renderer::View::~View() {
    if (shared->device) static_cast<void>(shared->device->waitForAll());
    std::erase(shared->views, this);
    if (SceneResidency* const scene = sceneOf(shared->datasets)) scene->forgetView(number);
    if (shared->meso && shared->meso->pass)
        for (const auto& heights : shared->meso->pass->heights()) heights->forgetView(number);
}

Result<VkSurfaceKHR> Renderer::View::createSurface() const {
    VkSurfaceKHR made = VK_NULL_HANDLE;
    if (surface) VCP_VK(surface->createSurface, shared->instance->handle(), &made);
    return made;
}

Result<void> Renderer::View::createDevice(const DeviceFaults& faults) {
    const RendererOptions& options = shared->options;
    const Instance& instance = *shared->instance;
    if (options.host && shared->losses > 0)
        return Error{.code = ErrorCode::Device, .message = "the host's device was lost"};
    VCP_TRY_ASSIGN(const auto window, createSurface());
    const bool forWindows = window != VK_NULL_HANDLE || !options.windowExtensions.empty();
    auto made = options.host ? Device::borrow(*options.host, faults)
                             : Device::create(instance, options.device, window, forWindows, faults);
    if (!made) {
        if (window != VK_NULL_HANDLE) vkDestroySurfaceKHR(instance.handle(), window, nullptr);
        return made.error();
    }
    shared->take(std::move(*made));
    return attach(window);
}

Result<void> Renderer::View::attachToDevice() {
    VCP_TRY_ASSIGN(const auto window, createSurface());
    if (window == VK_NULL_HANDLE || shared->device->shows(window)) return attach(window);
    vkDestroySurfaceKHR(shared->instance->handle(), window, nullptr);
    return Error{.code = ErrorCode::Device,
                 .message = "device '" + shared->info.name +
                            "', as it was chosen for the first view, cannot show pictures in this window"};
}

Result<void> Renderer::View::attach(VkSurfaceKHR window) {
    if (window != VK_NULL_HANDLE)
        swapchain = std::make_unique<Swapchain>(shared->instance->handle(), *shared->device, window);
    return makeLayers();
}

Result<void> Renderer::View::makeLayers() {
    layers.resize(std::max<size_t>(shared->datasets.size(), 1));
    for (Frame& frame : frames)
        if (&frame != &frames.front() && frame.layers.size() != layers.size()) frame = {};
    return makeLayers(frames.front());
}

Result<void> Renderer::View::makeLayers(Frame& frame) {
    Device& device = *shared->device;
    if (frame.layers.size() > layers.size()) frame.layers.resize(layers.size());
    while (frame.layers.size() < layers.size()) {
        VCP_TRY_ASSIGN(auto resources, FrameResources::create(device));
        VCP_TRY_ASSIGN(auto clock, PassTimer::create(device, kPassMarks));
        LayerFrame& made = frame.layers.emplace_back();
        made.resources = std::move(resources);
        made.timer = std::move(clock);
        bindPools(frame);
    }
    if (shared->composes() && !frame.lightTimer.hasClock()) {
        VCP_TRY_ASSIGN(frame.lightTimer, PassTimer::create(device, 2));
    }
    if (shared->meso && !frame.surfacesTimer.hasClock()) {
        VCP_TRY_ASSIGN(frame.surfacesTimer, PassTimer::create(device, 2));
    }
    if (shared->composes()) return {};
    frame.layers.front().resources->setTarget(nullptr, nullptr, nullptr);
    frame.target = {};
    frame.surfaces = {};
    return {};
}

void Renderer::View::bindPools(Frame& frame) {
    for (size_t i = 0; i < frame.layers.size(); ++i) {
        const Residency* residency = i < layers.size() ? layers[i].residency : nullptr;
        const PagePool* pool = residency != nullptr ? &poolOf(*residency) : nullptr;
        frame.layers[i].resources->setPools(pool, pool != nullptr && residency->hasColour() ? pool : nullptr);
        frame.layers[i].resources->setImages(nullptr);
        frame.layers[i].images.reset();
    }
}

void Renderer::View::forgetImages() {
    for (Frame& frame : frames) {
        if (frame.isUnfinished() && frame.nextStep > 0) continue;
        for (LayerFrame& layer : frame.layers) {
            layer.resources->setImages(nullptr);
            layer.images.reset();
        }
    }
}

Result<void> Renderer::View::showDatasets() {
    VCP_TRY(makeLayers());
    const std::vector<PlacedResidency>& datasets = shared->datasets;
    for (size_t i = 0; i < layers.size(); ++i) {
        layers[i].dataset = layers[i].residency = i < datasets.size() ? datasets[i].residency.get() : nullptr;
        layers[i].number = i;
        layers[i].placement = i < datasets.size() ? datasets[i].placement : Similarity{};
        layers[i].tableStale = true;
    }
    for (Frame& frame : frames) bindPools(frame);
    return {};
}

bool Renderer::View::isComplete() const {
    const bool isBound = std::all_of(layers.begin(), layers.end(), [&](const Layer& layer) {
        return shared->datasets.empty() || layer.dataset != nullptr;
    });
    return isBound && layers.size() == std::max<size_t>(shared->datasets.size(), 1) &&
           frames.front().layers.size() == layers.size();
}

Result<void> Renderer::View::hideAsAsked(const FrameRequest& request) {
    bool isNews = false;
    for (size_t i = 0; i < layers.size(); ++i) {
        Layer& layer = layers[i];
        Residency* const visible = isHidden(request, i) ? nullptr : layer.dataset;
        if (layer.residency == visible) continue;
        if (!isNews) abandonFrame();
        if (!isNews) VCP_TRY(takeInAll());
        isNews = true;
        if (!visible) layer.dataset->forgetView(number);
        layer.residency = visible;
        layer.tableStale = true;
    }
    if (isNews)
        for (Frame& frame : frames) bindPools(frame);
    return {};
}

void Renderer::View::forgetFrames() {
    abandonFrame();
    drawn.reset();
    lastDone.reset();
    heightsRead.reset();
    for (Frame& frame : frames) {
        frame.submission = 0;
        frame.surfaces = {};
    }
}

void Renderer::View::release() {
    if (gone) gone();
    if (shared->device) static_cast<void>(shared->device->waitForAll());
    abandonFrame();
    drawn.reset();
    lastDone.reset();
    swapchain.reset();
    scaling.reset();
    painted = {};
    layers.clear();
    frames = {};
    sums = {};
}

Result<void> Renderer::View::updateHeights(const FrameRequest& request, UpdateResult& all) {
    bool isKnown = true;
    uint32_t toCome = 0;
    for (const auto& heights : shared->meso->pass->heights()) {
        VCP_TRY_ASSIGN(const bool came, heights->update());
        all.changed = all.changed || came;
        if (heights->hasAll()) continue;
        const HeightPool::State state = heights->state(number);
        isKnown = isKnown && state.isOfNow && heightsRead == request;
        toCome += state.missing.toCome;
        all.relaxed = all.relaxed || state.missing.withoutRoom > 0;
    }
    // What the next frame reads may be missing, too.
    if (!isKnown) all.awaitsRays = all.awaitsRays || all.settled;
    all.settled = all.settled && isKnown && toCome == 0;
    return {};
}

Result<UpdateResult> Renderer::View::updateAll(const FrameRequest& request) {
    if (!isComplete()) return kGone;
    const DeviceWork before = shared->device->work();
    if (shared->device->isLost()) return Error{.code = ErrorCode::Device, .message = "the device was lost"};
    VCP_TRY(takeInDone());
    VCP_TRY(hideAsAsked(request));
    std::vector<ShownResidency> shown;
    for (Layer& layer : layers)
        if (layer.residency != nullptr) shown.push_back({layer.residency, layer.placement, &layer.errorPixels});
    VCP_TRY_ASSIGN(auto all, updateShown(shown, request, number));
    if (!all)
        all = UpdateResult{.settled = true,
                           .drawable = !shared->datasets.empty(),
                           .errorPixels = std::numeric_limits<double>::infinity()};
    if (shared->meso && !isCastOnHost()) VCP_TRY(updateHeights(request, *all));
    all->submissions = shared->device->work().submissions - before.submissions;
    all->hostWaits = shared->device->work().waits - before.waits;
    return *std::move(all);
}

}  // namespace vcp
