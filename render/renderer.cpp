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

/// What the views of one dataset share.
struct Renderer::Shared {
    RendererOptions options;
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;  // null after a loss that could not be made good
    DeviceInfo info;
    PageAccess access = PageAccess::TexelBuffer;
    uint32_t stripes = 1;
    std::unique_ptr<Residency> residency;
    uint32_t losses = 0;
    // Views draw one after the other: one set of pipelines does for all.
    BeamPass beam;
    TracePass trace;
    PaperTracePass paperTrace;
    LightPass light;
    ShadePass shade;
    FeedbackPass feedback;
    PassConstants constants;  // of the last frame
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
        if (residency) residency->forgetView(number);
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
    std::unique_ptr<Residency>& residency = shared->residency;
    uint32_t& losses = shared->losses;
    BeamPass& beam = shared->beam;
    TracePass& trace = shared->trace;
    PaperTracePass& paperTrace = shared->paperTrace;
    LightPass& light = shared->light;
    ShadePass& shade = shared->shade;
    FeedbackPass& feedback = shared->feedback;
    PassConstants& constants = shared->constants;

    const std::optional<SurfaceSource> surface;
    const ViewNumber number;
    std::function<void()> gone;
    std::unique_ptr<Swapchain> swapchain;
    std::unique_ptr<PictureScaling> scaling;  // to the host's images; made on first use
    std::unique_ptr<FrameResources> resources;
    std::optional<PassTimer> timer;
    bool tableStale = true;
    uint64_t tableVersion = 0;
    std::vector<glm::uvec4> table;  // of the last frame
    double errorPixels = 0;         // of the cut
    std::optional<FrameRequest> drawn;
    bool drawnColour = false;

    [[nodiscard]] bool isPaper() const { return residency && residency->dataset().header.method == Method::Paper; }
    /// The request without what the dataset's method cannot draw.
    [[nodiscard]] FrameRequest drawable(FrameRequest request) const;
    /// The device, and this view's part of it.
    Result<void> createDevice(const DeviceFaults& faults);
    Result<VkSurfaceKHR> createSurface() const;
    Result<void> attach(VkSurfaceKHR window);
    Result<void> attachToDevice();
    void release();
    /// Shaders of all views see no pool; see the residency's, or the dataset is closed where it has none.
    void hidePool();
    void showPool();
    /// Makes all anew that the device held.
    Result<void> rebuild();
    /// Does it; after an error that something can be done about, once more.
    template <class Do>
    auto tryAgain(Do doIt) -> decltype(doIt());
    bool recover(bool mayRebuild);
    Result<FrameStats> draw(const FrameRequest& request);
    /// Whether this frame has a feedback pass.
    [[nodiscard]] bool listens() const { return residency && residency->listens() && !isPaper(); }
    [[nodiscard]] PassConstants constantsFor(const FrameRequest& request) const;
    Result<void> checkLimits(const FrameRequest& request) const;
    Result<void> prepareTable();
    Result<void> prepare(const FrameRequest& request);
    void recordFrame(VkCommandBuffer commands, const FrameRequest& request);
    Result<FrameStats> collectStats(const FrameRequest& request) const;
    /// Depth words and tile starts of the last frame: pixels of empty tiles were not written.
    Result<std::vector<uint32_t>> hitPlane(uint32_t plane, uint32_t missing) const;
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
    state->showPool();
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
    auto made = FrameResources::create(*device);
    if (!made) return made.error();
    resources = std::move(*made);
    return {};
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
    resources.reset();
}

void Renderer::State::hidePool() {
    for (State* view : shared->views)
        if (view->resources) view->resources->setPools(nullptr, nullptr);
}

void Renderer::State::showPool() {
    static_cast<void>(device->takeOutOfMemory());  // a pool that was halved for it is fine
    if (residency && !residency->hasPool()) residency.reset();
    const PagePool* pool = residency ? &residency->pages() : nullptr;
    for (State* view : shared->views) {
        view->tableStale = true;
        view->resources->setPools(pool, pool != nullptr && residency->hasColour() ? pool : nullptr);
    }
}

Result<void> Renderer::State::rebuild() {
    ++losses;
    if (residency) residency->releasePool();
    for (State* view : shared->views) view->release();
    beam.clear(), trace.clear(), paperTrace.clear(), light.clear(), shade.clear();
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
    if (!residency) return {};
    const auto done = residency->rebuild(*device, access);
    showPool();
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
    if (!device->takeOutOfMemory() || !residency) return false;
    hidePool();
    const bool halved = residency->setBudgets(*device, access, residency->pages().bytes() / 2, options.ramBytes).ok();
    showPool();
    return halved;
}

void Renderer::onDeviceLoss(std::function<void()> gone) { state_->gone = std::move(gone); }
const DeviceInfo& Renderer::device() const { return state_->info; }
PageAccess Renderer::access() const { return state_->access; }
std::vector<std::string> Renderer::validationMessages() const { return state_->instance->log().messages(); }

Result<void> Renderer::open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source) {
    if (!state_->device) return kGone;
    close();
    const RendererOptions& o = state_->options;
    ResidencyOptions options;
    options.budgetBytes = o.budgetBytes;
    options.uploadBytes = o.uploadBytes;
    options.order = o.order;
    options.loader.withColour = o.colour;
    options.loader.threads = o.loaderThreads;
    options.loader.heldBytes = o.ramBytes;
    auto residency = Residency::create(*state_->device, state_->access, options, std::move(dataset), std::move(source));
    if (!residency) return residency.error();
    state_->residency = std::move(*residency);
    state_->showPool();
    return {};
}

Result<void> Renderer::setBudgets(uint64_t budgetBytes, uint64_t ramBytes) {
    State& s = *state_;
    if (!s.device) return kGone;
    if (budgetBytes < kLeastBudget)
        return Error{.code = ErrorCode::Usage, .message = fmt::format("a budget of {} bytes is too small; at least {}", budgetBytes, kLeastBudget)};
    if (s.residency) {
        s.hidePool();
        const auto done = s.residency->setBudgets(*s.device, s.access, budgetBytes, ramBytes);
        s.showPool();
        if (!done) return done;
    }
    s.options.budgetBytes = budgetBytes;
    s.options.ramBytes = ramBytes;
    return {};
}

void Renderer::close() {
    State& s = *state_;
    s.hidePool();
    s.residency.reset();
    for (State* view : s.shared->views) {
        view->drawn.reset();
        view->tableStale = true;
    }
}

Result<UpdateResult> Renderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    State& s = *state_;
    if (!s.device) return kGone;
    if (!s.residency) return UpdateResult{.settled = true, .errorPixels = std::numeric_limits<double>::infinity()};
    auto result = s.tryAgain([&] { return s.residency->update(selectionView(request), s.number); });
    if (!result) return result;
    result->deviceLosses = s.losses;
    s.errorPixels = result->errorPixels;
    return result;
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
    if (state_->residency) state_->residency->waitForPage(timeout);
}

PassConstants Renderer::State::constantsFor(const FrameRequest& request) const {
    PassConstants c;
    c.access = access;
    if (residency) {
        c.poolChunks = residency->pages().chunks();
        c.chunkShift = residency->pages().chunkShift();
        c.colour = residency->hasColour();
    }
    c.falseColour = isFalseColour(request.shading.mode);
    c.countSteps = request.countSteps || showsWork(request.shading.mode);
    return c;
}

Result<void> Renderer::State::checkLimits(const FrameRequest& request) const {
    const uint64_t words = uint64_t{request.width} * request.height * hitPlanes(request, residency && residency->hasColour());
    const VkPhysicalDeviceLimits& limits = device->limits();
    if (words * 4 <= limits.maxStorageBufferRange && words <= limits.maxTexelBufferElements) return {};
    return Error{.code = ErrorCode::Limit,
                 .message = fmt::format("{} x {} pixels are more than '{}' can address at once; at most {} pixels", request.width, request.height,
                                        device->info().name, std::min<uint64_t>(limits.maxStorageBufferRange / 4, limits.maxTexelBufferElements) / (words / (uint64_t{request.width} * request.height)))};
}

Result<void> Renderer::State::prepareTable() {
    const uint64_t version = residency ? residency->version() : 0;
    if (!tableStale && version == tableVersion) return {};
    auto next = residency ? residency->table(number) : std::vector<glm::uvec4>(frame::kRecordTexels, glm::uvec4(0));
    if (tableStale || next != table) VCP_TRY(resources->setTable(next));
    table = std::move(next);
    tableVersion = version;
    tableStale = false;
    return {};
}

Result<void> Renderer::State::prepare(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    VCP_TRY(checkLimits(request));
    const PassConstants wanted = constantsFor(request);
    if (wanted.poolChunks != constants.poolChunks || wanted.chunkShift != constants.chunkShift) {
        beam.clear();
        trace.clear();
        paperTrace.clear();
        light.clear();
        shade.clear();
        feedback.clear();
    }
    constants = wanted;
    VCP_TRY(resources->resize({request.width, request.height}, hitPlanes(request, constants.colour)));
    resources->setBackground(backgroundRows(request));
    VCP_TRY(prepareTable());
    VCP_TRY(beam.prepare(*resources, constants, request.beam));
    const SectionKind sections = request.sections.empty() ? SectionKind::None : request.sectionCaps ? SectionKind::Capped : SectionKind::Open;
    if (isPaper()) VCP_TRY(paperTrace.prepare(*resources, constants, sections != SectionKind::None, request.march));
    else VCP_TRY(trace.prepare(*resources, constants, sections));
    const bool traceLight = hasLight(request.shading);
    if (traceLight) VCP_TRY(light.prepare(*resources, constants));
    if (listens()) VCP_TRY(feedback.prepare(*device, *resources, constants, table));
    return shade.prepare(*resources, constants, traceLight);
}

void Renderer::State::recordFrame(VkCommandBuffer commands, const FrameRequest& request) {
    timer->reset(commands);
    frame::FrameConstants c = frameConstants(request, residency ? &residency->dataset() : nullptr, stripes, constants.colour, errorPixels);
    c.lattice.z = feedback.jitter().x;
    c.lattice.w = feedback.jitter().y;
    resources->begin(commands, c);
    timer->mark(commands, 0);
    beam.record(commands, *resources);
    timer->mark(commands, 1);
    if (isPaper()) paperTrace.record(commands, *resources);
    else trace.record(commands, *resources);
    timer->mark(commands, 2);
    if (hasLight(request.shading)) light.record(commands, *resources);
    timer->mark(commands, 3);
    shade.record(commands, *resources);
    timer->mark(commands, 4);
    if (listens()) feedback.record(commands);
    timer->mark(commands, 5);
}

FrameRequest Renderer::State::drawable(FrameRequest request) const {
    if (!isPaper()) return request;
    request.beam = request.sectionCaps = request.shading.shadows = false;
    request.shading.occlusionRays = 0;
    return request;
}

Result<FrameStats> Renderer::render(const FrameRequest& wanted) {
    const FrameRequest request = state_->drawable(wanted);
    return state_->tryAgain([&] { return state_->draw(request); });
}

Result<FrameStats> Renderer::State::draw(const FrameRequest& request) {
    drawn.reset();
    if (!device) return kGone;
    VCP_TRY(prepare(request));
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY(device->submitAndWait([&](VkCommandBuffer commands) { recordFrame(commands, request); }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    drawn = request;
    drawnColour = constants.colour;
    if (listens()) residency->hear(feedback.read(), selectionView(request));
    auto stats = collectStats(request);
    if (stats) stats->msFrame = took.count();
    return stats;
}

Result<FrameStats> Renderer::State::collectStats(const FrameRequest& request) const {
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
    if (residency) {
        stats.colourBytes = residency->colourBytes();
        stats.poolBytes = residency->pages().bytes();
        stats.pagesInCut = static_cast<uint32_t>(residency->cut(number).size());
    }
    return stats;
}

Result<std::vector<uint32_t>> Renderer::State::hitPlane(uint32_t plane, uint32_t missing) const {
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
    const PictureSize size = s.resources->size();
    auto words = readWords(*s.device, s.resources->picture(), 0, size.pixels());
    if (!words) return words.error();
    Picture picture{size.width, size.height, std::vector<uint8_t>(size.pixels() * 4)};
    std::memcpy(picture.rgba.data(), words->data(), picture.rgba.size());
    return picture;
}

Result<std::vector<float>> Renderer::readDepth() {
    auto words = state_->hitPlane(0, std::bit_cast<uint32_t>(frame::kNoHit));
    if (!words) return words.error();
    const double cell = state_->residency ? state_->residency->dataset().header.cell : 1;
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
    auto words = s.hitPlane(hitPlanes(*s.drawn, s.drawnColour) - 1, 0);
    if (!words) return words;
    for (uint32_t& word : *words) word = static_cast<uint32_t>(std::lround(std::bit_cast<float>(word) * most));
    return words;
}

Result<std::vector<glm::vec3>> Renderer::readNormals() {
    auto depth = readDepth();
    if (!depth) return depth.error();
    auto words = state_->hitPlane(1, 0);
    if (!words) return words.error();
    std::vector<glm::vec3> normals(words->size(), glm::vec3(0));
    for (size_t i = 0; i < normals.size(); ++i)
        if (std::isfinite((*depth)[i])) normals[i] = unpackNormal((*words)[i]);
    return normals;
}

Result<std::optional<PixelHit>> Renderer::pick(uint32_t x, uint32_t y) {
    const State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    const PictureSize size = s.resources->size();
    if (x >= size.width || y >= size.height || !s.residency) return std::optional<PixelHit>{};
    const uint64_t tile = uint64_t{y / frame::kTileSize} * size.tilesX() + x / frame::kTileSize;
    const uint64_t at = uint64_t{y} * size.width + x;
    uint32_t words[3];
    const std::pair<const Buffer*, uint64_t> reads[] = {{&s.resources->tileStarts(), tile}, {&s.resources->hits(), at}, {&s.resources->hits(), size.pixels() + at}};
    for (int i = 0; i < 3; ++i) {
        auto word = readWords(*s.device, *reads[i].first, reads[i].second, 1);
        if (!word) return word.error();
        words[i] = word->front();
    }
    const float cells = std::abs(std::bit_cast<float>(words[1]));
    if (std::bit_cast<float>(words[0]) >= frame::kTileEmpty || cells >= frame::kNoHit) return std::optional<PixelHit>{};
    PixelHit hit;
    hit.depth = double(cells) * s.residency->dataset().header.cell;
    const PictureTile whole = wholePicture(*s.drawn);
    const CameraRay ray = cameraRay(s.drawn->camera, whole.fullWidth, whole.fullHeight, whole.x + x + 0.5, whole.y + y + 0.5);
    hit.position = ray.origin + ray.direction * hit.depth;
    hit.normal = unpackNormal(words[2]);
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
    VCP_TRY(s.scaling->prepare(s.resources->size()));
    auto commands = s.device->beginCommands();
    if (!commands) return commands.error();
    s.scaling->record(*commands, s.resources->picture(), target.image, {target.width, target.height});
    changeLayout(*commands, target.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, target.layoutAfter, VK_ACCESS_TRANSFER_WRITE_BIT,
                 VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT);
    return s.device->endCommandsAndWait(target.wait, target.signal);
}

Result<void> Renderer::present(uint32_t width, uint32_t height, const DrawOver& drawOver) {
    State& s = *state_;
    if (!s.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    if (!s.drawn) return {};
    return s.swapchain->show(s.resources->picture(), s.resources->size(), {width, height}, drawOver);
}

Result<WindowDrawing> Renderer::windowDrawing() {
    const State& s = *state_;
    if (!s.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    const auto renderPass = s.swapchain->renderPass();
    if (!renderPass) return renderPass.error();
    return WindowDrawing{s.instance->handle(), s.device->physical(), s.device->handle(), s.device->queue(), s.device->queueFamily(), *renderPass};
}

}  // namespace vcp
