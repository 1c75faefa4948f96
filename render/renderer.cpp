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
#include "render/passes/beam.h"
#include "render/passes/light.h"
#include "render/passes/readback.h"
#include "render/passes/shade.h"
#include "render/passes/trace.h"
#include "render/residency.h"
#include "render/swapchain.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr uint64_t kLeastBudget = 1ull << 20;

/// GPU clock readings between passes.
class PassTimer {
public:
    static constexpr uint32_t kMarks = 5;

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
    const Device* device_ = nullptr;
    VkQueryPool pool_ = VK_NULL_HANDLE;
};

glm::vec3 unpackNormal(uint32_t code) {
    glm::vec3 n(float(code & 0xffff) / 65535.0f * 2 - 1, float(code >> 16) / 65535.0f * 2 - 1, 0);
    n.z = 1 - std::abs(n.x) - std::abs(n.y);
    const float fold = std::max(-n.z, 0.0f);
    n.x += n.x >= 0 ? -fold : fold;
    n.y += n.y >= 0 ? -fold : fold;
    return glm::normalize(n);
}

}  // namespace

struct Renderer::State {
    RendererOptions options;
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;
    std::unique_ptr<Swapchain> swapchain;
    PageAccess access = PageAccess::TexelBuffer;
    uint32_t stripes = 1;

    std::unique_ptr<Residency> residency;
    std::unique_ptr<FrameResources> resources;
    BeamPass beam;
    TracePass trace;
    LightPass light;
    ShadePass shade;
    PassTimer timer;
    PassConstants constants;
    bool tableStale = true;
    double errorPixels = 0;  // of the cut
    std::optional<FrameRequest> drawn;
    bool drawnColour = false;

    [[nodiscard]] PassConstants constantsFor(const FrameRequest& request) const;
    Result<void> checkLimits(const FrameRequest& request) const;
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
    auto state = std::make_unique<State>();
    state->options = options;
    auto instance = Instance::create(options.validation, options.surface ? options.surface->instanceExtensions : std::vector<std::string>{});
    if (!instance) return instance.error();
    state->instance = std::move(*instance);
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    if (options.surface) VCP_VK(options.surface->createSurface, state->instance->handle(), &surface);
    auto device = Device::create(*state->instance, options.device, surface);
    if (!device) {
        if (surface != VK_NULL_HANDLE) vkDestroySurfaceKHR(state->instance->handle(), surface, nullptr);
        return device.error();
    }
    state->device = std::move(*device);
    if (surface != VK_NULL_HANDLE) state->swapchain = std::make_unique<Swapchain>(state->instance->handle(), *state->device, surface);
    const bool software = state->device->info().software;
    state->access = options.access != PageAccess::Auto ? options.access : software ? PageAccess::TexelBuffer : PageAccess::StorageBuffer;
    state->stripes = software ? std::max(1u, static_cast<uint32_t>(get_nprocs())) : 1;
    VCP_TRY(state->timer.create(*state->device));
    auto resources = FrameResources::create(*state->device);
    if (!resources) return resources.error();
    state->resources = std::move(*resources);
    return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

const DeviceInfo& Renderer::device() const { return state_->device->info(); }
PageAccess Renderer::access() const { return state_->access; }
std::vector<std::string> Renderer::validationMessages() const { return state_->instance->log().messages(); }

Result<void> Renderer::open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source) {
    close();
    const RendererOptions& o = state_->options;
    ResidencyOptions options;
    options.budgetBytes = o.budgetBytes;
    options.uploadBytes = o.uploadBytes;
    options.loader.withColour = o.colour;
    options.loader.threads = o.loaderThreads;
    options.loader.heldBytes = o.ramBytes;
    auto residency = Residency::create(*state_->device, state_->access, options, std::move(dataset), std::move(source));
    if (!residency) return residency.error();
    state_->residency = std::move(*residency);
    const PagePool* pool = &state_->residency->pages();
    state_->resources->setPools(pool, state_->residency->hasColour() ? pool : nullptr);
    return {};
}

void Renderer::close() {
    State& s = *state_;
    s.resources->setPools(nullptr, nullptr);
    s.residency.reset();
    s.drawn.reset();
    s.tableStale = true;
}

Result<UpdateResult> Renderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    State& s = *state_;
    if (!s.residency) return UpdateResult{.settled = true, .errorPixels = std::numeric_limits<double>::infinity()};
    auto result = s.residency->update(selectionView(request));
    if (result) s.tableStale = s.tableStale || result->changed;
    if (result) s.errorPixels = result->errorPixels;
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
        state_->residency->waitForPage(std::chrono::milliseconds(100));
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
    c.countSteps = request.countSteps || request.shading.mode == ShadingMode::Steps || request.shading.mode == ShadingMode::Fetches;
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

Result<void> Renderer::State::prepare(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    VCP_TRY(checkLimits(request));
    const PassConstants wanted = constantsFor(request);
    if (wanted.poolChunks != constants.poolChunks || wanted.chunkShift != constants.chunkShift) {
        beam.clear();
        trace.clear();
        light.clear();
        shade.clear();
    }
    constants = wanted;
    VCP_TRY(resources->resize({request.width, request.height}, hitPlanes(request, constants.colour)));
    resources->setBackground(backgroundRows(request));
    if (tableStale && residency) VCP_TRY(resources->setTable(residency->table()));
    if (tableStale && !residency) VCP_TRY(resources->setTable(std::vector<glm::uvec4>(frame::kRecordTexels, glm::uvec4(0))));
    tableStale = false;
    VCP_TRY(beam.prepare(*resources, constants, request.beam));
    const SectionKind sections = request.sections.empty() ? SectionKind::None : request.sectionCaps ? SectionKind::Capped : SectionKind::Open;
    VCP_TRY(trace.prepare(*resources, constants, sections));
    const bool traceLight = hasLight(request.shading);
    if (traceLight) VCP_TRY(light.prepare(*resources, constants));
    return shade.prepare(*resources, constants, traceLight);
}

void Renderer::State::recordFrame(VkCommandBuffer commands, const FrameRequest& request) {
    timer.reset(commands);
    resources->begin(commands, frameConstants(request, residency ? &residency->dataset() : nullptr, stripes, constants.colour, errorPixels));
    timer.mark(commands, 0);
    beam.record(commands, *resources);
    timer.mark(commands, 1);
    trace.record(commands, *resources);
    timer.mark(commands, 2);
    if (hasLight(request.shading)) light.record(commands, *resources);
    timer.mark(commands, 3);
    shade.record(commands, *resources);
    timer.mark(commands, 4);
}

Result<FrameStats> Renderer::render(const FrameRequest& request) {
    State& s = *state_;
    s.drawn.reset();
    VCP_TRY(s.prepare(request));
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY(s.device->submitAndWait([&](VkCommandBuffer commands) { s.recordFrame(commands, request); }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    s.drawn = request;
    s.drawnColour = s.constants.colour;
    auto stats = s.collectStats(request);
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
    auto ms = timer.read();
    if (!ms) return ms.error();
    stats.msBeam = (*ms)[0];
    stats.msTrace = (*ms)[1];
    stats.msLight = (*ms)[2];
    stats.msShade = (*ms)[3];
    stats.pipelines = resources->pipelinesMade();
    if (residency) {
        stats.colourBytes = residency->colourBytes();
        stats.poolBytes = residency->pages().bytes();
        stats.pagesInCut = static_cast<uint32_t>(residency->cut().size());
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
        return cells >= frame::kNoHit ? std::numeric_limits<float>::infinity() : static_cast<float>(double(cells) * cell);
    });
    return depth;
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
