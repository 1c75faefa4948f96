#include "render/renderer.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>

#include <sys/sysinfo.h>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"
#include "render/picture_scaling.h"
#include "render/passes/beam.h"
#include "render/passes/compose.h"
#include "render/passes/feedback.h"
#include "render/passes/light.h"
#include "render/passes/paper_trace.h"
#include "render/passes/readback.h"
#include "render/passes/shade.h"
#include "render/passes/trace.h"
#include "render/residency.h"
#include "render/swapchain.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr uint64_t kLeastBudget = 1ull << 20;
constexpr uint64_t kMoreThanAnyBudget = 1ull << 60;

const Error kGone{.code = ErrorCode::Device, .message = "the device was lost and could not be made anew"};

/// GPU clock readings between passes.
class PassTimer {
public:
    static constexpr uint32_t kMarks = 6;

    Result<void> create(const Device& device) {
        device_ = &device;
        if (device.timestampNanoseconds() == 0) return {};
        VkQueryPoolCreateInfo info{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
        info.queryType = VK_QUERY_TYPE_TIMESTAMP;
        info.queryCount = kMarks;
        VCP_VK(vkCreateQueryPool, device.handle(), &info, nullptr, &pool_);
        return {};
    }
    ~PassTimer() {
        if (pool_ != VK_NULL_HANDLE) vkDestroyQueryPool(device_->handle(), pool_, nullptr);
    }
    void reset(VkCommandBuffer commands) const {
        if (pool_ != VK_NULL_HANDLE) vkCmdResetQueryPool(commands, pool_, 0, kMarks);
    }
    void mark(VkCommandBuffer commands, uint32_t i) const {
        if (pool_ != VK_NULL_HANDLE) vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, pool_, i);
    }
    /// Milliseconds between consecutive marks.
    Result<std::array<double, kMarks - 1>> read() const {
        std::array<double, kMarks - 1> ms{};
        if (pool_ == VK_NULL_HANDLE) return ms;
        std::array<uint64_t, kMarks> t{};
        VCP_VK(vkGetQueryPoolResults, device_->handle(), pool_, 0, kMarks, sizeof(t), t.data(), sizeof(uint64_t),
               VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
        for (uint32_t i = 0; i + 1 < kMarks; ++i) ms[i] = double(t[i + 1] - t[i]) * device_->timestampNanoseconds() * 1e-6;
        return ms;
    }

private:
    const Device* device_ = nullptr;  // not owned
    VkQueryPool pool_ = VK_NULL_HANDLE;
};

/// The largest pool that it can make use of, as far as is known.
uint64_t bytesOf(const Dataset& dataset, bool withColour) {
    return poolShapeFor(dataset, withColour && dataset.hasColour(), kMoreThanAnyBudget, kMoreThanAnyBudget).units * kPoolUnitBytes;
}

/// Of another dataset in the same picture.
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

/// Pixels that are hit are counted where pictures meet.
void add(FrameStats& all, const FrameStats& one) {
    all.tracedRays += one.tracedRays;
    all.msBeam += one.msBeam;
    all.msTrace += one.msTrace;
    all.msLight += one.msLight;
    all.msShade += one.msShade;
    all.msFeedback += one.msFeedback;
    all.msFrame += one.msFrame;
    all.steps += one.steps;
    all.fetches += one.fetches;
    all.poolBytes += one.poolBytes;
    all.colourBytes += one.colourBytes;
    all.pagesInCut += one.pagesInCut;
    all.pipelines += one.pipelines;
    all.feedbackPasses = one.feedbackPasses;
}

bool showsWork(ShadingMode mode) { return mode == ShadingMode::Steps || mode == ShadingMode::Cells || mode == ShadingMode::Fetches; }

glm::vec3 unpackNormal(uint32_t code) {
    glm::vec3 n(float(code & 0xffff) / 65535.0f * 2 - 1, float(code >> 16) / 65535.0f * 2 - 1, 0);
    n.z = 1 - std::abs(n.x) - std::abs(n.y);
    const float fold = std::max(-n.z, 0.0f);
    n.x += n.x >= 0 ? -fold : fold;
    n.y += n.y >= 0 ? -fold : fold;
    return glm::normalize(n);
}

}  // namespace

/// What the views share: device, passes, and the datasets with their pages.
struct Renderer::Shared {
    struct Placed {
        std::unique_ptr<Residency> residency;
        Similarity placement;
    };
    RendererOptions options;
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;  // null after a loss that could not be made good
    DeviceInfo info;
    PageAccess access = PageAccess::TexelBuffer;
    uint32_t stripes = 1;
    std::vector<Placed> datasets;
    std::vector<std::pair<uint32_t, uint32_t>> poolLayouts;  // of the datasets that the pipelines were made for
    uint32_t losses = 0;
    // Views draw one after the other: one set of pipelines does for all.
    BeamPass beam;
    TracePass trace;
    PaperTracePass paperTrace;
    LightPass light;
    ShadePass shade;
    FeedbackPass feedback;
    ComposePass compose;
    std::vector<State*> views;
    ViewNumber nextNumber = 0;
};

struct Renderer::State {
    explicit State(std::shared_ptr<Shared> with, std::optional<SurfaceSource> window)
        : shared(std::move(with)), surface(std::move(window)), number(shared->nextNumber++) {
        shared->views.push_back(this);
    }
    ~State() {
        std::erase(shared->views, this);
        for (const Shared::Placed& placed : datasets) placed.residency->forgetView(number);
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    const std::shared_ptr<Shared> shared;
    RendererOptions& options = shared->options;
    std::unique_ptr<Instance>& instance = shared->instance;
    std::unique_ptr<Device>& device = shared->device;
    DeviceInfo& info = shared->info;
    PageAccess& access = shared->access;
    uint32_t& stripes = shared->stripes;
    std::vector<Shared::Placed>& datasets = shared->datasets;
    uint32_t& losses = shared->losses;
    BeamPass& beam = shared->beam;
    TracePass& trace = shared->trace;
    PaperTracePass& paperTrace = shared->paperTrace;
    LightPass& light = shared->light;
    ShadePass& shade = shared->shade;
    FeedbackPass& feedback = shared->feedback;
    ComposePass& compose = shared->compose;

    const std::optional<SurfaceSource> surface;
    const ViewNumber number;
    std::function<void()> gone;
    std::unique_ptr<Swapchain> swapchain;
    std::unique_ptr<PictureScaling> scaling;  // to the host's images; made on first use
    /// This view's part of drawing one dataset.
    struct Layer {
        std::unique_ptr<FrameResources> resources;
        Residency* residency = nullptr;  // null: nothing but the background is drawn
        Similarity placement;
        PassConstants constants;  // of the last frame
        bool tableStale = true;
        uint64_t tableVersion = 0;
        std::vector<glm::uvec4> table;  // of the last frame
        double errorPixels = 0;         // of the cut
        FrameRequest drawn;

        [[nodiscard]] bool isPaper() const { return residency != nullptr && residency->dataset().header.method == Method::Paper; }
        /// Whether the next frame has a feedback pass.
        [[nodiscard]] bool listens() const { return residency != nullptr && residency->listens() && !isPaper(); }
        /// World units a unit of the hits' depths.
        [[nodiscard]] double unit() const { return (residency != nullptr ? residency->dataset().header.cell : 1) * placement.scale; }
        /// The request from the dataset's own space, without what its method cannot draw.
        [[nodiscard]] FrameRequest drawable(const FrameRequest& request) const;
    };
    std::vector<Layer> layers;  // one a dataset, and at least one; the first one's picture is the view's
    std::optional<PassTimer> timer;
    ComposeTarget target;       // where there are several layers
    std::optional<FrameRequest> drawn;
    bool keepsFeedback = false;
    std::optional<FeedbackPicture> feedbackPicture;
    /// The device, and this view's part of it.
    Result<void> createDevice(const DeviceFaults& faults);
    Result<VkSurfaceKHR> createSurface() const;
    Result<void> attach(VkSurfaceKHR window);
    Result<void> attachToDevice();
    void release();
    /// As many layers as there are datasets.
    Result<void> makeLayers();
    /// Whether each dataset has its layer: not, where the device gave out half-way.
    [[nodiscard]] bool isComplete() const;
    /// Shaders of all views see no pool; see the residency's, or the dataset is closed where it has none.
    void hidePool();
    Result<void> showPool();
    void clearPipelines();
    /// The budgets, shared out among the datasets.
    Result<void> setShares(uint64_t budgetBytes, uint64_t ramBytes);
    /// Makes all anew that the device held.
    Result<void> rebuild();
    /// Does it; after an error that something can be done about, once more.
    template <class Do>
    auto tryAgain(Do doIt) -> decltype(doIt());
    bool recover(bool mayRebuild);
    Result<UpdateResult> updateAll(const FrameRequest& request);
    Result<FrameStats> draw(const FrameRequest& request);
    void keep(const RayFeedback& heard, const SelectionView& view, const Dataset& dataset);
    Result<FrameStats> drawLayer(Layer& layer, const FrameRequest& request);
    [[nodiscard]] PassConstants constantsFor(const Layer& layer, const FrameRequest& request) const;
    Result<void> checkLimits(const Layer& layer, const FrameRequest& request) const;
    Result<void> prepareTable(Layer& layer);
    Result<void> prepare(Layer& layer, const FrameRequest& request);
    void recordFrame(VkCommandBuffer commands, const Layer& layer, const FrameRequest& request);
    Result<FrameStats> collectStats(const Layer& layer, const FrameRequest& request) const;
    /// Words of a plane of the last frame: pixels of empty tiles were not written.
    Result<std::vector<uint32_t>> hitPlane(const Layer& layer, uint32_t plane, uint32_t missing) const;
    /// Distances of the last frame in one layer, as readDepth() gives them.
    Result<std::vector<float>> depthOf(const Layer& layer) const;
    Result<std::optional<PixelHit>> pick(const Layer& layer, uint32_t x, uint32_t y) const;
};

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RendererOptions& options) {
    if (options.budgetBytes < kLeastBudget)
        return Error{.code = ErrorCode::Usage, .message = fmt::format("a budget of {} bytes is too small; at least {}", options.budgetBytes, kLeastBudget)};
    auto shared = std::make_shared<Shared>();
    shared->options = options;
    if (options.host) {
        shared->instance = Instance::borrow(options.host->instance);
    } else {
        auto instance = Instance::create(options.validation, options.surface ? options.surface->instanceExtensions : options.windowExtensions);
        if (!instance) return instance.error();
        shared->instance = std::move(*instance);
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
    const auto window = createSurface();
    if (!window) return window.error();
    const bool forWindows = *window != VK_NULL_HANDLE || !options.windowExtensions.empty();
    auto made = options.host ? Device::borrow(*options.host, faults) : Device::create(*instance, options.device, *window, forWindows, faults);
    if (!made) {
        if (*window != VK_NULL_HANDLE) vkDestroySurfaceKHR(instance->handle(), *window, nullptr);
        return made.error();
    }
    device = std::move(*made);
    info = device->info();
    access = options.access != PageAccess::Auto ? options.access : info.software ? PageAccess::TexelBuffer : PageAccess::StorageBuffer;
    stripes = info.software ? std::max(1u, static_cast<uint32_t>(get_nprocs())) : 1;
    return attach(*window);
}

Result<void> Renderer::State::attach(VkSurfaceKHR window) {
    if (window != VK_NULL_HANDLE) swapchain = std::make_unique<Swapchain>(instance->handle(), *device, window);
    VCP_TRY(timer.emplace().create(*device));
    return makeLayers();
}

Result<void> Renderer::State::makeLayers() {
    const size_t wanted = std::max<size_t>(datasets.size(), 1);
    if (layers.size() > wanted) layers.resize(wanted);
    if (wanted == 1 && !layers.empty()) {
        layers.front().resources->setTarget(nullptr, nullptr);
        target = {};
    }
    while (layers.size() < wanted) {
        auto made = FrameResources::create(*device);
        if (!made) return made.error();
        layers.emplace_back().resources = std::move(*made);
    }
    return {};
}

bool Renderer::State::isComplete() const {
    const bool isBound = std::all_of(layers.begin(), layers.end(), [&](const Layer& layer) { return datasets.empty() || layer.residency != nullptr; });
    return isBound && layers.size() == std::max<size_t>(datasets.size(), 1);
}

Result<void> Renderer::State::attachToDevice() {
    const auto window = createSurface();
    if (!window) return window.error();
    if (*window == VK_NULL_HANDLE || device->shows(*window)) return attach(*window);
    vkDestroySurfaceKHR(instance->handle(), *window, nullptr);
    return Error{.code = ErrorCode::Device, .message = "device '" + info.name + "', as it was chosen for the first view, cannot show pictures in this window"};
}

void Renderer::State::release() {
    if (gone) gone();
    drawn.reset();
    timer.reset();
    swapchain.reset();
    scaling.reset();
    layers.clear();
    target = {};
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
    if (std::any_of(datasets.begin(), datasets.end(), [](const Shared::Placed& each) { return !each.residency->hasPool(); })) datasets.clear();
    std::vector<std::pair<uint32_t, uint32_t>> layouts;
    for (const Shared::Placed& each : datasets) layouts.emplace_back(each.residency->pages().chunks(), each.residency->pages().chunkShift());
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
    device.reset();
    DeviceFaults faults = options.faults;
    faults.lostAtSubmission = 0;
    // A window decides which queue there has to be.
    const auto windowed = std::find_if(shared->views.begin(), shared->views.end(), [](const State* view) { return view->surface.has_value(); });
    State* const first = windowed != shared->views.end() ? *windowed : this;
    VCP_TRY(first->createDevice(faults));
    for (State* view : shared->views)
        if (view != first) VCP_TRY(view->attachToDevice());
    Result<void> done;
    for (const Shared::Placed& placed : datasets)
        if (done) done = placed.residency->rebuild(*device, access);
    VCP_TRY(showPool());
    return done;
}

template <class Do>
auto Renderer::State::tryAgain(Do doIt) -> decltype(doIt()) {
    const uint32_t before = losses;
    auto done = doIt();
    // A device that is lost each time it does this is of no use; the pool can be halved a few times only.
    while (!done && recover(losses == before)) done = doIt();
    return done;
}

bool Renderer::State::recover(bool mayRebuild) {
    if (!device) return false;
    if (device->isLost()) return mayRebuild && rebuild().ok();
    if (!device->takeOutOfMemory() || datasets.empty()) return false;
    hidePool();
    // One whose coarsest page has all of its pool already stays as it is.
    bool halved = false;
    for (const Shared::Placed& placed : datasets) {
        if (!placed.residency->hasPool()) continue;
        const auto done = placed.residency->setBudgets(*device, access, placed.residency->pages().bytes() / 2, options.ramBytes / datasets.size());
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
    return open(std::move(one));
}

Result<void> Renderer::open(std::vector<PlacedDataset> datasets) {
    if (!state_->device) return kGone;
    close();
    const RendererOptions& o = state_->options;
    ResidencyOptions options;
    options.order = o.order;
    options.loader.withColour = o.colour;
    const auto loaders = static_cast<uint32_t>(std::max<size_t>(datasets.size(), 1));
    options.loader.threads = std::max(o.loaderThreads / loaders, 1u);
    options.loader.allThreads = loaders * options.loader.threads;
    options.uploadBytes = o.uploadBytes / std::max<size_t>(datasets.size(), 1);
    options.loader.heldBytes = o.ramBytes / std::max<size_t>(datasets.size(), 1);
    std::vector<uint64_t> bytes;
    for (const PlacedDataset& each : datasets) bytes.push_back(bytesOf(*each.dataset, o.colour));
    const std::vector<uint64_t> shares = budgetShares(o.budgetBytes, bytes);
    for (size_t i = 0; i < datasets.size(); ++i) {
        options.budgetBytes = shares[i];
        const bool isShared = datasets.size() > 1 && !datasets[i].dataset->pages.empty();
        const uint64_t needed = isShared ? datasets[i].source->bytesToRead(0, o.colour && datasets[i].dataset->hasColour()) : 0;
        if (needed > options.loader.heldBytes) {
            close();
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("{} datasets share {} bytes of memory for pages on their way, and to read the coarsest page of one takes {}: allow more (--ram)",
                                                datasets.size(), o.ramBytes, needed)};
        }
        auto residency = Residency::create(*state_->device, state_->access, options, std::move(datasets[i].dataset), std::move(datasets[i].source));
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
    for (const Shared::Placed& placed : datasets) bytes.push_back(bytesOf(placed.residency->dataset(), placed.residency->hasColour()));
    const std::vector<uint64_t> shares = budgetShares(budgetBytes, bytes);
    // What shrinks goes first, so that all together are never more than they may be.
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
        return Error{.code = ErrorCode::Usage, .message = fmt::format("a budget of {} bytes is too small; at least {}", budgetBytes, kLeastBudget)};
    if (!s.datasets.empty()) {
        s.hidePool();
        const auto done = s.setShares(budgetBytes, ramBytes);
        // Some may have the new one by now.
        if (!done && s.datasets.size() > 1) static_cast<void>(s.setShares(s.options.budgetBytes, s.options.ramBytes));
        VCP_TRY(s.showPool());
        if (!done) return done;
    }
    s.options.budgetBytes = budgetBytes;
    s.options.ramBytes = ramBytes;
    return {};
}

void Renderer::close() {
    State& s = *state_;
    s.hidePool();
    s.datasets.clear();
    for (State* view : s.shared->views) {
        view->drawn.reset();
        static_cast<void>(view->makeLayers());  // fewer: nothing to go wrong
        for (State::Layer& layer : view->layers) layer.tableStale = true;
    }
}

Result<UpdateResult> Renderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    State& s = *state_;
    if (!s.device) return kGone;
    if (s.datasets.empty()) return UpdateResult{.settled = true, .errorPixels = std::numeric_limits<double>::infinity()};
    auto result = s.tryAgain([&] { return s.updateAll(request); });
    if (result) result->deviceLosses = s.losses;
    return result;
}

Result<UpdateResult> Renderer::State::updateAll(const FrameRequest& request) {
    if (datasets.empty() || !isComplete()) return kGone;
    std::optional<UpdateResult> all;
    for (Layer& layer : layers) {
        auto one = layer.residency->update(selectionView(requestIn(layer.placement, request)), number);
        if (!one) return one;
        layer.errorPixels = one->errorPixels;
        if (all) add(*all, *one);
        else all = *std::move(one);
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
    // One after the other, until one has pages.
    constexpr std::chrono::milliseconds kTurn(5);
    const auto until = std::chrono::steady_clock::now() + timeout;
    for (const Shared::Placed& placed : datasets) {
        if (std::chrono::steady_clock::now() >= until) return;
        if (placed.residency->waitForPage(std::min(timeout, kTurn))) return;
    }
}

PassConstants Renderer::State::constantsFor(const Layer& layer, const FrameRequest& request) const {
    PassConstants c;
    c.access = access;
    if (const Residency* residency = layer.residency) {
        c.poolChunks = residency->pages().chunks();
        c.chunkShift = residency->pages().chunkShift();
        c.colour = residency->hasColour();
    }
    c.falseColour = isFalseColour(request.shading.mode);
    c.countSteps = request.countSteps || showsWork(request.shading.mode);
    return c;
}

Result<void> Renderer::State::checkLimits(const Layer& layer, const FrameRequest& request) const {
    const uint64_t words = uint64_t{request.width} * request.height * hitPlanes(request, layer.residency != nullptr && layer.residency->hasColour());
    const VkPhysicalDeviceLimits& limits = device->limits();
    if (words * 4 <= limits.maxStorageBufferRange && words <= limits.maxTexelBufferElements) return {};
    return Error{.code = ErrorCode::Limit,
                 .message = fmt::format("{} x {} pixels are more than '{}' can address at once; at most {} pixels", request.width, request.height,
                                        device->info().name, std::min<uint64_t>(limits.maxStorageBufferRange / 4, limits.maxTexelBufferElements) / (words / (uint64_t{request.width} * request.height)))};
}

Result<void> Renderer::State::prepareTable(Layer& layer) {
    const uint64_t version = layer.residency != nullptr ? layer.residency->version() : 0;
    if (!layer.tableStale && version == layer.tableVersion) return {};
    auto next = layer.residency != nullptr ? layer.residency->table(number) : std::vector<glm::uvec4>(frame::kRecordTexels, glm::uvec4(0));
    if (layer.tableStale || next != layer.table) VCP_TRY(layer.resources->setTable(next));
    layer.table = std::move(next);
    layer.tableVersion = version;
    layer.tableStale = false;
    return {};
}

Result<void> Renderer::State::prepare(Layer& layer, const FrameRequest& request) {
    VCP_TRY(checkLimits(layer, request));
    const auto& resources = layer.resources;
    const PassConstants& constants = layer.constants = constantsFor(layer, request);
    VCP_TRY(resources->resize({request.width, request.height}, hitPlanes(request, constants.colour)));
    resources->setBackground(backgroundRows(request));
    VCP_TRY(prepareTable(layer));
    if (layers.size() > 1) {
        VCP_TRY(target.resize(*device, resources->size()));
        resources->setTarget(&layers.front().resources->picture(), &target.depths());
        VCP_TRY(compose.prepare(*resources, constants));
    }
    VCP_TRY(beam.prepare(*resources, constants, request.beam));
    const SectionKind sections = request.sections.empty() ? SectionKind::None : request.sectionCaps ? SectionKind::Capped : SectionKind::Open;
    if (layer.isPaper()) VCP_TRY(paperTrace.prepare(*resources, constants, sections != SectionKind::None, request.march));
    else VCP_TRY(trace.prepare(*resources, constants, sections));
    const bool traceLight = hasLight(request.shading);
    if (traceLight) VCP_TRY(light.prepare(*resources, constants));
    if (layer.listens()) VCP_TRY(feedback.prepare(*device, *resources, constants, layer.table));
    return shade.prepare(*resources, constants, traceLight);
}

void Renderer::State::recordFrame(VkCommandBuffer commands, const Layer& layer, const FrameRequest& request) {
    const auto& resources = layer.resources;
    timer->reset(commands);
    frame::FrameConstants c = frameConstants(request, layer.residency != nullptr ? &layer.residency->dataset() : nullptr, stripes, layer.constants.colour,
                                             layer.errorPixels, layer.placement);
    c.lattice.z = feedback.jitter().x;
    c.lattice.w = feedback.jitter().y;
    resources->begin(commands, c);
    if (layers.size() > 1 && &layer == &layers.front()) target.clear(commands);
    timer->mark(commands, 0);
    beam.record(commands, *resources);
    timer->mark(commands, 1);
    if (layer.isPaper()) paperTrace.record(commands, *resources);
    else trace.record(commands, *resources);
    timer->mark(commands, 2);
    if (hasLight(request.shading)) light.record(commands, *resources);
    timer->mark(commands, 3);
    shade.record(commands, *resources);
    if (layers.size() > 1) compose.record(commands, *resources);
    timer->mark(commands, 4);
    if (layer.listens()) feedback.record(commands);
    timer->mark(commands, 5);
}

FrameRequest Renderer::State::Layer::drawable(const FrameRequest& wanted) const {
    FrameRequest request = requestIn(placement, wanted);
    if (!isPaper()) return request;
    request.beam = request.sectionCaps = request.shading.shadows = false;
    request.shading.occlusionRays = 0;
    return request;
}

Result<FrameStats> Renderer::render(const FrameRequest& request) {
    return state_->tryAgain([&] { return state_->draw(request); });
}

Result<FrameStats> Renderer::State::draw(const FrameRequest& request) {
    drawn.reset();
    if (!device || !isComplete()) return kGone;
    VCP_TRY(checkRequest(request));
    if (std::any_of(layers.begin(), layers.end(), [](const Layer& layer) { return layer.listens(); })) feedbackPicture.reset();
    std::optional<FrameStats> all;
    for (Layer& layer : layers) {
        layer.drawn = layer.drawable(request);
        auto stats = drawLayer(layer, layer.drawn);
        if (!stats) return stats;
        if (all) add(*all, *stats);
        else all = *stats;
    }
    if (layers.size() > 1) {
        const auto hits = target.hitPixels(*device);
        if (!hits) return hits.error();
        all->hitPixels = *hits;
    }
    drawn = request;
    return *all;
}

Result<FrameStats> Renderer::State::drawLayer(Layer& layer, const FrameRequest& request) {
    VCP_TRY(prepare(layer, request));
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY(device->submitAndWait([&](VkCommandBuffer commands) { recordFrame(commands, layer, request); }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    if (layer.listens()) {
        const RayFeedback heard = feedback.read();
        const SelectionView view = selectionView(request);
        if (keepsFeedback) keep(heard, view, layer.residency->dataset());
        layer.residency->hear(heard, view);
    }
    auto stats = collectStats(layer, request);
    if (stats) stats->msFrame = took.count();
    return stats;
}

void Renderer::State::keep(const RayFeedback& heard, const SelectionView& view, const Dataset& dataset) {
    if (!feedbackPicture) feedbackPicture.emplace().errorPixels.fill(-1);
    const glm::dvec3 corner = dataset.originOf(dataset.pages[0]);
    const double unit = std::ldexp(dataset.edgeOf(dataset.pages[0]), -static_cast<int>(frame::kLatticeBits));
    for (const RayFeedback::Hit& hit : heard.hits) {
        const double distance = view.orthographic ? 1 : glm::length(corner + glm::dvec3(hit.place) * unit - view.eye);
        const double error = double(dataset.pages[hit.page].certifiedError) * view.pixelsPerUnit / std::max(distance, unit);
        float& kept = feedbackPicture->errorPixels[hit.ray];
        kept = std::max(kept, static_cast<float>(error));
    }
}

Result<FrameStats> Renderer::State::collectStats(const Layer& layer, const FrameRequest& request) const {
    const auto& resources = layer.resources;
    FrameStats stats;
    stats.rays = uint64_t{request.width} * request.height;
    auto counters = readWords(*device, resources->counters(), 0, sizeof(frame::FrameCounters) / 4);
    if (!counters) return counters.error();
    auto listed = readWords(*device, resources->tileList(), 3, 1);
    if (!listed) return listed.error();
    stats.hitPixels = (*counters)[0];
    stats.tracedRays = std::min<uint64_t>(stats.rays, uint64_t{listed->front()} * frame::kTileSize * frame::kTileSize);
    stats.steps = (*counters)[2];
    stats.fetches = (*counters)[3];
    auto ms = timer->read();
    if (!ms) return ms.error();
    stats.msBeam = (*ms)[0];
    stats.msTrace = (*ms)[1];
    stats.msLight = (*ms)[2];
    stats.msShade = (*ms)[3];
    stats.msFeedback = (*ms)[4];
    stats.feedbackPasses = feedback.passes();
    stats.pipelines = resources->pipelinesMade();
    if (Residency* const residency = layer.residency) {
        stats.colourBytes = residency->colourBytes();
        stats.poolBytes = residency->pages().bytes();
        stats.pagesInCut = static_cast<uint32_t>(residency->cut(number).size());
    }
    return stats;
}

Result<std::vector<uint32_t>> Renderer::State::hitPlane(const Layer& layer, uint32_t plane, uint32_t missing) const {
    const auto& resources = layer.resources;
    if (!drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    const PictureSize size = resources->size();
    auto starts = readWords(*device, resources->tileStarts(), 0, uint64_t{size.tilesX()} * size.tilesY());
    if (!starts) return starts;
    auto words = readWords(*device, resources->hits(), plane * size.pixels(), size.pixels());
    if (!words) return words;
    for (uint32_t y = 0; y < size.height; ++y)
        for (uint32_t x = 0; x < size.width; ++x) {
            const uint32_t tile = y / frame::kTileSize * size.tilesX() + x / frame::kTileSize;
            if (std::bit_cast<float>((*starts)[tile]) >= frame::kTileEmpty) (*words)[uint64_t{y} * size.width + x] = missing;
        }
    return words;
}

Result<Picture> Renderer::readPicture() {
    const State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    const FrameResources& resources = *s.layers.front().resources;
    const PictureSize size = resources.size();
    auto words = readWords(*s.device, resources.picture(), 0, size.pixels());
    if (!words) return words.error();
    Picture picture{size.width, size.height, std::vector<uint8_t>(size.pixels() * 4)};
    std::memcpy(picture.rgba.data(), words->data(), picture.rgba.size());
    return picture;
}

Result<std::vector<float>> Renderer::readDepth() {
    if (!state_->drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    auto depth = state_->depthOf(state_->layers.front());
    for (size_t i = 1; depth && i < state_->layers.size(); ++i) {
        const auto other = state_->depthOf(state_->layers[i]);
        if (!other) return other;
        std::transform(depth->begin(), depth->end(), other->begin(), depth->begin(), [](float a, float b) { return b < a || std::isnan(a) ? b : a; });
    }
    return depth;
}

Result<std::vector<float>> Renderer::State::depthOf(const Layer& layer) const {
    auto words = hitPlane(layer, 0, std::bit_cast<uint32_t>(frame::kNoHit));
    if (!words) return words.error();
    const double cell = layer.unit();
    std::vector<float> depth(words->size());
    std::transform(words->begin(), words->end(), depth.begin(), [&](uint32_t word) {
        const float cells = std::abs(std::bit_cast<float>(word));
        if (cells >= frame::kGaveUp) return std::numeric_limits<float>::quiet_NaN();
        return cells >= frame::kNoHit ? std::numeric_limits<float>::infinity() : static_cast<float>(double(cells) * cell);
    });
    return depth;
}

Result<std::vector<uint32_t>> Renderer::readWork() {
    const State& s = *state_;
    if (!s.drawn || !showsWork(s.drawn->shading.mode)) return Error{.code = ErrorCode::Usage, .message = "the last picture does not show work"};
    const ShadingMode mode = s.drawn->shading.mode;
    const float most = mode == ShadingMode::Steps ? frame::kMostShownSteps : mode == ShadingMode::Cells ? frame::kMostShownCells : frame::kMostShownFetches;
    std::vector<uint32_t> work;
    for (const State::Layer& layer : s.layers) {
        const auto words = s.hitPlane(layer, hitPlanes(layer.drawn, layer.constants.colour) - 1, 0);
        if (!words) return words;
        work.resize(words->size());
        for (size_t i = 0; i < work.size(); ++i) work[i] += static_cast<uint32_t>(std::lround(std::bit_cast<float>((*words)[i]) * most));
    }
    return work;
}

Result<std::vector<glm::vec3>> Renderer::readNormals() {
    std::vector<float> nearest;
    std::vector<glm::vec3> normals;
    for (const State::Layer& layer : state_->layers) {
        const auto depth = state_->depthOf(layer);
        if (!depth) return depth.error();
        const auto words = state_->hitPlane(layer, 1, 0);
        if (!words) return words.error();
        nearest.resize(words->size(), std::numeric_limits<float>::infinity());
        normals.resize(words->size(), glm::vec3(0));
        const glm::quat turn(layer.placement.rotation);
        for (size_t i = 0; i < normals.size(); ++i) {
            if (!((*depth)[i] < nearest[i])) continue;
            nearest[i] = (*depth)[i];
            normals[i] = turn * unpackNormal((*words)[i]);
        }
    }
    return normals;
}

Result<std::optional<PixelHit>> Renderer::pick(uint32_t x, uint32_t y) {
    const State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    std::optional<PixelHit> nearest;
    for (size_t i = 0; i < s.layers.size(); ++i) {
        const auto hit = s.pick(s.layers[i], x, y);
        if (!hit) return hit;
        if (!*hit || (nearest && nearest->depth <= (*hit)->depth)) continue;
        nearest = **hit;
        nearest->dataset = i;
    }
    return nearest;
}

Result<std::optional<PixelHit>> Renderer::State::pick(const Layer& layer, uint32_t x, uint32_t y) const {
    const auto& resources = layer.resources;
    const PictureSize size = resources->size();
    if (x >= size.width || y >= size.height || layer.residency == nullptr) return std::optional<PixelHit>{};
    const uint64_t tile = uint64_t{y / frame::kTileSize} * size.tilesX() + x / frame::kTileSize;
    const uint64_t at = uint64_t{y} * size.width + x;
    uint32_t words[3];
    const std::pair<const Buffer*, uint64_t> reads[] = {{&resources->tileStarts(), tile}, {&resources->hits(), at}, {&resources->hits(), size.pixels() + at}};
    for (int i = 0; i < 3; ++i) {
        auto word = readWords(*device, *reads[i].first, reads[i].second, 1);
        if (!word) return word.error();
        words[i] = word->front();
    }
    const float cells = std::abs(std::bit_cast<float>(words[1]));
    const bool onCap = std::signbit(std::bit_cast<float>(words[1]));
    if (std::bit_cast<float>(words[0]) >= frame::kTileEmpty || cells >= frame::kNoHit) return std::optional<PixelHit>{};
    PixelHit hit;
    hit.depth = double(cells) * layer.unit();
    hit.onCap = onCap;
    const PictureTile whole = wholePicture(*drawn);
    const CameraRay ray = cameraRay(drawn->camera, whole.fullWidth, whole.fullHeight, whole.x + x + 0.5, whole.y + y + 0.5);
    hit.position = ray.origin + ray.direction * hit.depth;
    hit.normal = glm::quat(layer.placement.rotation) * unpackNormal(words[2]);
    return std::optional<PixelHit>(hit);
}

Result<void> Renderer::copyPicture(const ImageTarget& target) {
    State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    if (!s.options.host) return Error{.code = ErrorCode::Usage, .message = "images are those of a device of the host, and there is none"};
    if (target.image == VK_NULL_HANDLE || target.width == 0 || target.height == 0)
        return Error{.code = ErrorCode::Usage, .message = "there is no image, or it has no area"};
    if (!s.device->hasGraphics()) return Error{.code = ErrorCode::Usage, .message = "pictures are scaled to images by queues with graphics, which this is not"};
    if (!s.scaling) s.scaling = std::make_unique<PictureScaling>(*s.device);
    VCP_TRY(s.scaling->prepare(s.layers.front().resources->size()));
    auto commands = s.device->beginCommands();
    if (!commands) return commands.error();
    s.scaling->record(*commands, s.layers.front().resources->picture(), target.image, {target.width, target.height});
    changeLayout(*commands, target.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, target.layoutAfter, VK_ACCESS_TRANSFER_WRITE_BIT,
                 VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT);
    return s.device->endCommandsAndWait(target.wait, target.signal);
}

std::vector<PageBox> Renderer::residentPages() const {
    std::vector<PageBox> boxes;
    for (const State::Layer& layer : state_->layers) {
        if (layer.residency == nullptr) continue;
        const Dataset& dataset = layer.residency->dataset();
        const std::vector<uint64_t>& cut = layer.residency->cut(state_->number);
        layer.residency->forEachResident([&](uint64_t page) {
            const PageEntry& entry = dataset.pages[page];
            const glm::dvec3 low = dataset.originOf(entry);
            const double edge = dataset.edgeOf(entry) * layer.placement.scale;
            PageBox box{layer.placement.toWorld(low), {}, entry.level, std::binary_search(cut.begin(), cut.end(), page)};
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 along(0);
                along[axis] = edge;
                box.edges[size_t(axis)] = layer.placement.rotation * along;
            }
            boxes.push_back(box);
        });
    }
    return boxes;
}

void Renderer::keepFeedback(bool keep) {
    state_->keepsFeedback = keep;
    state_->feedbackPicture.reset();
}

const std::optional<FeedbackPicture>& Renderer::feedbackPicture() const { return state_->feedbackPicture; }

Result<void> Renderer::present(uint32_t width, uint32_t height, const DrawOver& drawOver) {
    State& s = *state_;
    if (!s.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    if (!s.drawn) return {};
    const FrameResources& resources = *s.layers.front().resources;
    return s.swapchain->show(resources.picture(), resources.size(), {width, height}, drawOver);
}

Result<WindowDrawing> Renderer::windowDrawing() {
    const State& s = *state_;
    if (!s.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    const auto renderPass = s.swapchain->renderPass();
    if (!renderPass) return renderPass.error();
    return WindowDrawing{s.instance->handle(), s.device->physical(), s.device->handle(), s.device->queue(), s.device->queueFamily(), *renderPass};
}

}  // namespace vcp
