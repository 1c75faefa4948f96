#include "render/renderer.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include <sys/sysinfo.h>

#include <fmt/format.h>

#include "render/frame_setup.h"
#include "render/renderer_state.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr uint64_t kLeastBudget = 1ull << 20;
constexpr uint64_t kMoreThanAnyBudget = 1ull << 60;

/// Returns the largest pool that the dataset can use, as far as is known.
uint64_t bytesOf(const Dataset& dataset, bool withColour) {
    return poolShapeFor(dataset, withColour && dataset.hasColour(), kMoreThanAnyBudget, kMoreThanAnyBudget).units *
           kPoolUnitBytes;
}

/// Adds the result of another dataset in the same picture.
void add(UpdateResult& all, const UpdateResult& one) {
    all.changed = all.changed || one.changed;
    all.settled = all.settled && one.settled;
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

}  // namespace

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RendererOptions& options) {
    if (options.budgetBytes < kLeastBudget)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a budget of {} bytes is too small; at least {}", options.budgetBytes,
                                            kLeastBudget)};
    auto shared = std::make_shared<Shared>();
    shared->options = options;
    if (options.host) {
        shared->instance = Instance::borrow(options.host->instance);
    } else {
        VCP_TRY_ASSIGN(shared->instance,
                       Instance::create(options.validation, options.surface ? options.surface->instanceExtensions
                                                                            : options.windowExtensions));
    }
    auto state = std::make_unique<State>(shared, options.host ? std::nullopt : options.surface);
    VCP_TRY(state->createDevice(options.faults));
    return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

Result<std::unique_ptr<Renderer>> Renderer::addView(const std::optional<SurfaceSource>& surface) {
    if (!state_->device) return kGone;
    auto state = std::make_unique<State>(state_->shared, surface);
    VCP_TRY(state->attachToDevice());
    VCP_TRY(state->showPool());
    return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

Result<VkSurfaceKHR> Renderer::State::createSurface() const {
    VkSurfaceKHR made = VK_NULL_HANDLE;
    if (surface) VCP_VK(surface->createSurface, instance->handle(), &made);
    return made;
}

Result<void> Renderer::State::createDevice(const DeviceFaults& faults) {
    if (options.host && losses > 0) return Error{.code = ErrorCode::Device, .message = "the host's device was lost"};
    VCP_TRY_ASSIGN(const auto window, createSurface());
    const bool forWindows = window != VK_NULL_HANDLE || !options.windowExtensions.empty();
    auto made = options.host ? Device::borrow(*options.host, faults)
                             : Device::create(*instance, options.device, window, forWindows, faults);
    if (!made) {
        if (window != VK_NULL_HANDLE) vkDestroySurfaceKHR(instance->handle(), window, nullptr);
        return made.error();
    }
    device = std::move(*made);
    info = device->info();
    access = options.access != PageAccess::Auto ? options.access
             : info.software                    ? PageAccess::TexelBuffer
                                                : PageAccess::StorageBuffer;
    stripes = info.software ? std::max(1u, uint32_t(get_nprocs())) : 1;
    return attach(window);
}

Result<void> Renderer::State::attach(VkSurfaceKHR window) {
    if (window != VK_NULL_HANDLE) swapchain = std::make_unique<Swapchain>(instance->handle(), *device, window);
    VCP_TRY_ASSIGN(timer, PassTimer::create(*device, kPassMarks));
    return makeLayers();
}

Result<void> Renderer::State::makeLayers() {
    const size_t wanted = std::max<size_t>(datasets.size(), 1);
    if (layers.size() > wanted) layers.resize(wanted);
    while (layers.size() < wanted) {
        VCP_TRY_ASSIGN(layers.emplace_back().resources, FrameResources::create(*device));
    }
    if (composes()) return {};
    layers.front().resources->setTarget(nullptr, nullptr);
    target = {};
    mesoTarget = {};
    return {};
}

bool Renderer::State::isComplete() const {
    const bool isBound = std::all_of(layers.begin(), layers.end(), [&](const Layer& layer) {
        return datasets.empty() || layer.residency != nullptr;
    });
    return isBound && layers.size() == std::max<size_t>(datasets.size(), 1);
}

Result<void> Renderer::State::attachToDevice() {
    VCP_TRY_ASSIGN(const auto window, createSurface());
    if (window == VK_NULL_HANDLE || device->shows(window)) return attach(window);
    vkDestroySurfaceKHR(instance->handle(), window, nullptr);
    return Error{.code = ErrorCode::Device,
                 .message = "device '" + info.name +
                            "', as it was chosen for the first view, cannot show pictures in this window"};
}

void Renderer::State::release() {
    if (gone) gone();
    drawn.reset();
    timer = {};
    swapchain.reset();
    scaling.reset();
    layers.clear();
    target = {};
    mesoTarget = {};
}

void Renderer::State::hidePool() {
    for (State* view : shared->views)
        for (Layer& layer : view->layers) {
            layer.resources->setPools(nullptr, nullptr);
            layer.residency = nullptr;
        }
}

Result<void> Renderer::State::showPool() {
    static_cast<void>(device->takeOutOfMemory());  // a pool that was halved for it is fine
    if (std::any_of(datasets.begin(), datasets.end(),
                    [](const Shared::Placed& each) { return !each.residency->hasPool(); }))
        datasets.clear();
    std::vector<std::pair<uint32_t, uint32_t>> layouts;
    for (const Shared::Placed& each : datasets)
        layouts.emplace_back(each.residency->pages().chunks(), each.residency->pages().chunkShift());
    if (!layouts.empty() && layouts != std::exchange(shared->poolLayouts, layouts)) clearPipelines();
    for (State* view : shared->views) {
        VCP_TRY(view->makeLayers());
        for (size_t i = 0; i < view->layers.size(); ++i) {
            Layer& layer = view->layers[i];
            layer.residency = i < datasets.size() ? datasets[i].residency.get() : nullptr;
            layer.placement = i < datasets.size() ? datasets[i].placement : Similarity{};
            layer.tableStale = true;
            const PagePool* pool = layer.residency != nullptr ? &layer.residency->pages() : nullptr;
            layer.resources->setPools(pool, pool != nullptr && layer.residency->hasColour() ? pool : nullptr);
        }
    }
    return {};
}

void Renderer::State::clearPipelines() {
    beam.clear();
    trace.clear();
    paperTrace.clear();
    light.clear();
    shade.clear();
    feedback.clear();
    compose.clear();
}

Result<void> Renderer::State::rebuild() {
    ++losses;
    for (const Shared::Placed& placed : datasets) placed.residency->releasePool();
    for (State* view : shared->views) view->release();
    clearPipelines();
    feedback.release();
    if (shared->meso) *shared->meso = {.surfaces = std::move(shared->meso->surfaces)};
    device.reset();
    DeviceFaults faults = options.faults;
    faults.lostAtSubmission = 0;
    // A view with a window decides which queue the device must have.
    const auto windowed = std::find_if(shared->views.begin(), shared->views.end(),
                                       [](const State* view) { return view->surface.has_value(); });
    State* const first = windowed != shared->views.end() ? *windowed : this;
    VCP_TRY(first->createDevice(faults));
    for (State* view : shared->views)
        if (view != first) VCP_TRY(view->attachToDevice());
    Result<void> done = shared->uploadSurfaces();
    for (const Shared::Placed& placed : datasets)
        if (done) done = placed.residency->rebuild(*device, access);
    VCP_TRY(showPool());
    return done;
}

bool Renderer::State::recover(bool mayRebuild) {
    if (!device) return false;
    if (device->isLost()) return mayRebuild && rebuild().ok();
    if (!device->takeOutOfMemory() || datasets.empty()) return false;
    hidePool();
    // A dataset whose coarsest page has all of its pool already stays as it is.
    bool halved = false;
    for (const Shared::Placed& placed : datasets) {
        if (!placed.residency->hasPool()) continue;
        const auto done = placed.residency->setBudgets(*device, access, placed.residency->pages().bytes() / 2,
                                                       options.ramBytes / datasets.size());
        if (!done && done.error().code != ErrorCode::Limit) return false;
        halved = halved || done.ok();
    }
    return showPool().ok() && halved;
}

void Renderer::onDeviceLoss(std::function<void()> gone) { state_->gone = std::move(gone); }
const DeviceInfo& Renderer::device() const { return state_->info; }
PageAccess Renderer::access() const { return state_->access; }
std::vector<std::string> Renderer::validationMessages() const { return state_->instance->log().messages(); }

Result<void> Renderer::open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source) {
    std::vector<PlacedDataset> one;
    one.push_back({std::move(dataset), std::move(source), {}});
    return open(std::move(one), {});
}

Result<void> Renderer::open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces) {
    if (!state_->device) return kGone;
    close();
    VCP_TRY(setSurfaces(surfaces));
    const auto opened = openDatasets(std::move(datasets));
    if (!opened) VCP_TRY(setSurfaces({}));
    return opened;
}

Result<void> Renderer::openDatasets(std::vector<PlacedDataset> datasets) {
    const RendererOptions& o = state_->options;
    ResidencyOptions options;
    options.order = o.order;
    options.loader.withColour = o.colour;
    const auto loaders = uint32_t(std::max<size_t>(datasets.size(), 1));
    uint32_t threads = o.loaderThreads;
    if (threads == 0)
        for (const PlacedDataset& each : datasets) threads = std::max(threads, each.loaderThreads);
    options.loader.threads = std::max(threads / loaders, 1u);
    options.loader.allThreads = loaders * options.loader.threads;
    options.uploadBytes = o.uploadBytes / std::max<size_t>(datasets.size(), 1);
    options.loader.heldBytes = o.ramBytes / std::max<size_t>(datasets.size(), 1);
    std::vector<uint64_t> bytes;
    for (const PlacedDataset& each : datasets) bytes.push_back(bytesOf(*each.dataset, o.colour));
    const std::vector<uint64_t> shares = budgetShares(o.budgetBytes, bytes);
    for (size_t i = 0; i < datasets.size(); ++i) {
        options.budgetBytes = shares[i];
        const bool isShared = datasets.size() > 1 && !datasets[i].dataset->pages.empty();
        const uint64_t needed =
            isShared ? datasets[i].source->bytesToRead(0, o.colour && datasets[i].dataset->hasColour()) : 0;
        if (needed > options.loader.heldBytes) {
            close();
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("{} datasets share {} bytes of memory for pages on their way, and to "
                                                "read the coarsest page of one takes {}: allow more (--ram)",
                                                datasets.size(), o.ramBytes, needed)};
        }
        auto residency = Residency::create(*state_->device, state_->access, options, std::move(datasets[i].dataset),
                                           std::move(datasets[i].source));
        if (!residency) {
            close();
            return residency.error();
        }
        state_->datasets.push_back({std::move(*residency), datasets[i].placement});
    }
    const auto shown = state_->showPool();
    if (!shown) close();
    return shown;
}

Result<void> Renderer::State::setShares(uint64_t budgetBytes, uint64_t ramBytes) {
    std::vector<uint64_t> bytes;
    for (const Shared::Placed& placed : datasets)
        bytes.push_back(bytesOf(placed.residency->dataset(), placed.residency->hasColour()));
    const std::vector<uint64_t> shares = budgetShares(budgetBytes, bytes);
    // Pools that shrink are changed first, so that all together never exceed the budget.
    for (const bool shrinks : {true, false})
        for (size_t i = 0; i < datasets.size(); ++i) {
            Residency& residency = *datasets[i].residency;
            if ((residency.hasPool() && residency.pages().bytes() > shares[i]) != shrinks) continue;
            VCP_TRY(residency.setBudgets(*device, access, shares[i], ramBytes / datasets.size()));
        }
    return {};
}

Result<void> Renderer::setBudgets(uint64_t budgetBytes, uint64_t ramBytes) {
    State& s = *state_;
    if (!s.device) return kGone;
    if (budgetBytes < kLeastBudget)
        return Error{
            .code = ErrorCode::Usage,
            .message = fmt::format("a budget of {} bytes is too small; at least {}", budgetBytes, kLeastBudget)};
    if (!s.datasets.empty()) {
        s.hidePool();
        const auto done = s.setShares(budgetBytes, ramBytes);
        // Some datasets may have their new share by now.
        if (!done && s.datasets.size() > 1) static_cast<void>(s.setShares(s.options.budgetBytes, s.options.ramBytes));
        VCP_TRY(s.showPool());
        if (!done) return done;
    }
    s.options.budgetBytes = budgetBytes;
    s.options.ramBytes = ramBytes;
    return {};
}

Result<void> Renderer::Shared::uploadSurfaces() {
    if (!meso) return {};
    const auto upload = [&]() -> Result<void> {
        if (meso->pass) return meso->pass->setSurfaces(meso->surfaces);
        VCP_TRY_ASSIGN(auto made, MesoResources::create(*device));
        VCP_TRY_ASSIGN(auto clock, PassTimer::create(*device, 2));
        meso->resources = std::move(made), meso->timer = std::move(clock);
        meso->pass = std::make_unique<MesoSurfacePass>(*device, *meso->resources);
        return meso->pass->setSurfaces(meso->surfaces);
    };
    const auto done = upload();
    if (!done) meso.reset();
    return done;
}

Result<void> Renderer::setSurfaces(std::span<const MesoSurface> surfaces) {
    State& s = *state_;
    if (!s.device) return kGone;
    std::unique_ptr<Shared::Meso>& meso = s.shared->meso;
    for (State* view : s.shared->views) view->mesoTarget = {}, view->drawn.reset();
    ++s.shared->mesoVersion;
    if (surfaces.empty()) {
        meso.reset();
    } else {
        if (!meso) meso = std::make_unique<Shared::Meso>();
        meso->surfaces.assign(surfaces.begin(), surfaces.end());
    }
    const auto done = s.shared->uploadSurfaces();
    for (State* view : s.shared->views) VCP_TRY(view->makeLayers());
    return done;
}

void Renderer::close() {
    State& s = *state_;
    s.hidePool();
    s.datasets.clear();
    for (State* view : s.shared->views) {
        view->drawn.reset();
        static_cast<void>(view->makeLayers());  // there are fewer layers: nothing can fail
        for (State::Layer& layer : view->layers) layer.tableStale = true;
    }
}

Result<UpdateResult> Renderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    State& s = *state_;
    if (!s.device) return kGone;
    auto result = s.datasets.empty()
                      ? UpdateResult{.settled = true, .errorPixels = std::numeric_limits<double>::infinity()}
                      : s.tryAgain([&] { return s.updateAll(request); });
    if (!result) return result;
    result->deviceLosses = s.losses;
    result->changed = std::exchange(s.mesoSeen, s.shared->mesoVersion) != s.shared->mesoVersion || result->changed;
    result->drawable = result->drawable || s.shared->meso;
    return result;
}

Result<UpdateResult> Renderer::State::updateAll(const FrameRequest& request) {
    if (datasets.empty() || !isComplete()) return kGone;
    std::optional<UpdateResult> all;
    for (Layer& layer : layers) {
        auto one = layer.residency->update(selectionView(requestIn(layer.placement, request)), number);
        if (!one) return one;
        layer.errorPixels = one->errorPixels;
        if (all)
            add(*all, *one);
        else
            all = *std::move(one);
    }
    return *std::move(all);
}

Result<UpdateResult> Renderer::settle(const FrameRequest& request, const std::function<bool()>& cancel) {
    bool changed = false;
    std::vector<Error> problems;
    while (true) {
        auto result = update(request);
        if (!result) return result;
        changed = changed || result->changed;
        problems.insert(problems.end(), result->problems.begin(), result->problems.end());
        if (result->settled) {
            result->changed = changed;
            result->problems = std::move(problems);
            return result;
        }
        if (cancel && cancel()) return Error{.code = ErrorCode::Cancelled, .message = "cancelled"};
        waitForPage(std::chrono::milliseconds(100));
    }
}

void Renderer::waitForPage(std::chrono::milliseconds timeout) {
    std::vector<Shared::Placed>& datasets = state_->datasets;
    if (datasets.size() == 1) return static_cast<void>(datasets.front().residency->waitForPage(timeout));
    // The datasets take turns until one has pages.
    constexpr std::chrono::milliseconds kTurn(5);
    const auto until = std::chrono::steady_clock::now() + timeout;
    for (const Shared::Placed& placed : datasets) {
        if (std::chrono::steady_clock::now() >= until) return;
        if (placed.residency->waitForPage(std::min(timeout, kTurn))) return;
    }
}

}  // namespace vcp
