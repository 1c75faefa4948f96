#include "render/meso_renderer.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/passes/meso_rays.h"
#include "render/passes/readback.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr uint32_t kMostEdge = 16384;
constexpr uint64_t kMostRays = 65535 * 64;  // of one dispatch, on every device

/// How long what is recorded between two marks takes: of the queue's clock, or without one of the call's.
class Stopwatch {
public:
    explicit Stopwatch(Device& device) : device_(device) {}
    ~Stopwatch() {
        if (pool_ != VK_NULL_HANDLE) vkDestroyQueryPool(device_.handle(), pool_, nullptr);
    }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

    template <class Record>
    Result<double> milliseconds(Record record) {
        if (pool_ == VK_NULL_HANDLE && device_.timestampNanoseconds() > 0) {
            VkQueryPoolCreateInfo info{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
            info.queryType = VK_QUERY_TYPE_TIMESTAMP;
            info.queryCount = 2;
            VCP_VK(vkCreateQueryPool, device_.handle(), &info, nullptr, &pool_);
        }
        const auto start = std::chrono::steady_clock::now();
        VCP_TRY(device_.submitAndWait([&](VkCommandBuffer commands) {
            if (pool_ != VK_NULL_HANDLE) vkCmdResetQueryPool(commands, pool_, 0, 2), vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, pool_, 0);
            record(commands);
            if (pool_ != VK_NULL_HANDLE) vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, pool_, 1);
        }));
        if (pool_ == VK_NULL_HANDLE) return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        std::array<uint64_t, 2> marks{};
        VCP_VK(vkGetQueryPoolResults, device_.handle(), pool_, 0, 2, sizeof marks, marks.data(), sizeof(uint64_t), VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
        return double(marks[1] - marks[0]) * device_.timestampNanoseconds() * 1e-6;
    }

private:
    Device& device_;
    VkQueryPool pool_ = VK_NULL_HANDLE;
};

uint32_t rgba(glm::vec3 colour) {
    const glm::vec3 c = glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f;
    return uint32_t(c.x) | uint32_t(c.y) << 8 | uint32_t(c.z) << 16 | 0xff000000u;
}

Picture background(const MesoRequest& request) {
    if (request.behind != nullptr) return request.behind->picture;
    Picture picture{request.width, request.height, std::vector<uint8_t>(size_t{4} * request.width * request.height)};
    for (uint32_t y = 0; y < request.height; ++y) {
        const uint32_t word = rgba(glm::mix(request.backgroundTop, request.backgroundBottom, (float(y) + 0.5f) / float(request.height)));
        for (uint32_t x = 0; x < request.width; ++x) std::memcpy(picture.rgba.data() + 4 * (size_t{y} * request.width + x), &word, 4);
    }
    return picture;
}

glm::vec3 unpackNormal(uint32_t code) {
    const glm::vec2 e = glm::vec2(code & 0xffff, code >> 16) / 65535.0f * 2.0f - 1.0f;
    glm::vec3 n(e, 1 - std::abs(e.x) - std::abs(e.y));
    const float fold = std::max(-n.z, 0.0f);
    n.x += n.x >= 0 ? -fold : fold, n.y += n.y >= 0 ? -fold : fold;
    return glm::normalize(n);
}

}  // namespace

struct MesoRenderer::State {
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;
    std::unique_ptr<MesoResources> resources;
    std::unique_ptr<MesoSurfacePass> surfaces;
    std::unique_ptr<Stopwatch> watch;
    PictureSize size;   ///< of the last picture; 0: none
    Picture empty;      ///< what it was where there was no surface
    std::vector<float> emptyDepths;

    Result<std::vector<uint32_t>> plane(uint32_t which) {
        if (size.width == 0) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
        if (surfaces->isEmpty()) return std::vector<uint32_t>(size.pixels(), 0u);
        return readWords(*device, surfaces->hits(), which * size.pixels(), size.pixels());
    }
    Result<Buffer> upload(const void* from, uint64_t bytes) const {
        auto buffer = device->createBuffer(bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload);
        if (buffer) std::memcpy(buffer->mapped(), from, bytes);
        return buffer;
    }
};

MesoRenderer::MesoRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
MesoRenderer::~MesoRenderer() = default;

Result<std::unique_ptr<MesoRenderer>> MesoRenderer::create(const MesoRendererOptions& options) {
    auto state = std::make_unique<State>();
    auto instance = Instance::create(options.validation, {});
    if (!instance) return instance.error();
    state->instance = std::move(*instance);
    auto device = Device::create(*state->instance, options.device, VK_NULL_HANDLE, false);
    if (!device) return device.error();
    state->device = std::move(*device);
    auto resources = MesoResources::create(*state->device);
    if (!resources) return resources.error();
    state->resources = std::move(*resources);
    state->surfaces = std::make_unique<MesoSurfacePass>(*state->device, *state->resources);
    state->watch = std::make_unique<Stopwatch>(*state->device);
    return std::unique_ptr<MesoRenderer>(new MesoRenderer(std::move(state)));
}

const DeviceInfo& MesoRenderer::device() const { return state_->device->info(); }

Result<MesoMarched> MesoRenderer::march(const meso::Method& method, std::span<const meso::MarchRay> rays, int repetitions) {
    MesoMarched marched;
    if (rays.empty()) return marched;
    if (rays.size() > kMostRays) return Error{.code = ErrorCode::Limit, .message = fmt::format("{} rays; at most {} at once", rays.size(), kMostRays)};
    const auto arrays = packMesoArrays(method);
    if (!arrays) return arrays.error();
    auto resources = MesoRaysPass(*state_->device, *state_->resources);
    VCP_TRY(resources.prepare(*arrays, rays));
    for (int i = 0; i <= repetitions; ++i) {
        const auto ms = state_->watch->milliseconds([&](VkCommandBuffer commands) { resources.record(commands); });
        if (!ms) return ms.error();
        if (i > 0) marched.nsPerRay.push_back(*ms * 1e6 / double(rays.size()));
    }
    auto results = resources.read();
    if (!results) return results.error();
    marched.results = *std::move(results);
    return marched;
}

Result<void> MesoRenderer::setSurfaces(std::span<const MesoSurface> surfaces) {
    state_->size = {};
    return state_->surfaces->setSurfaces(surfaces);
}

Result<MesoFrameStats> MesoRenderer::render(const MesoRequest& request) {
    State& s = *state_;
    const PictureSize size{request.width, request.height};
    const auto fail = [](const char* message) { return Error{.code = ErrorCode::Usage, .message = message}; };
    if (size.width == 0 || size.height == 0 || size.width > kMostEdge || size.height > kMostEdge) return fail("a picture's edges are from 1 to 16384 pixels");
    if (request.behind != nullptr &&
        (request.behind->picture.width != size.width || request.behind->picture.height != size.height || request.behind->depths.size() != size.pixels()))
        return fail("what is behind is of another size than the picture");
    s.size = {};  // what was drawn is gone
    VCP_TRY(s.surfaces->prepare(size, request.look.shadows));
    MesoFrameStats stats;
    Picture under = background(request);
    if (!s.surfaces->isEmpty()) {
        const auto pixels = s.upload(under.rgba.data(), under.rgba.size());
        if (!pixels) return pixels.error();
        Buffer depths;
        if (request.behind != nullptr) {
            std::vector<float> finite = request.behind->depths;
            for (float& depth : finite) depth = depth < 1e30f ? depth : 1e30f;
            auto made = s.upload(finite.data(), finite.size() * sizeof(float));
            if (!made) return made.error();
            depths = std::move(*made);
        }
        const auto ms = s.watch->milliseconds([&](VkCommandBuffer commands) {
            const VkBufferCopy region{0, 0, under.rgba.size()};
            vkCmdCopyBuffer(commands, pixels->handle(), s.surfaces->picture().handle(), 1, &region);
            s.surfaces->record(commands, request.look, request.behind != nullptr ? &depths : nullptr);
        });
        if (!ms) return ms.error();
        const auto counters = readWords(*s.device, s.surfaces->counters(), 0, 2);
        if (!counters) return counters.error();
        stats.msFrame = *ms, stats.unresolved = (*counters)[0], stats.farHits = (*counters)[1];
    }
    s.size = size;
    s.empty = std::move(under);
    s.emptyDepths = request.behind != nullptr ? request.behind->depths : std::vector<float>(size.pixels(), std::numeric_limits<float>::infinity());
    stats.pipelines = s.resources->pipelinesMade(), stats.assetBytes = s.surfaces->assetBytes();
    return stats;
}

Result<Picture> MesoRenderer::readPicture() {
    State& s = *state_;
    if (s.size.width == 0) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    if (s.surfaces->isEmpty()) return s.empty;
    const auto words = readWords(*s.device, s.surfaces->picture(), 0, s.size.pixels());
    if (!words) return words.error();
    Picture picture{s.size.width, s.size.height, std::vector<uint8_t>(words->size() * 4)};
    std::memcpy(picture.rgba.data(), words->data(), picture.rgba.size());
    return picture;
}

Result<std::vector<float>> MesoRenderer::readDepth() {
    const auto words = state_->plane(0);
    if (!words) return words.error();
    if (state_->surfaces->isEmpty()) return state_->emptyDepths;
    std::vector<float> depths(words->size());
    std::memcpy(depths.data(), words->data(), depths.size() * sizeof(float));
    for (float& depth : depths)
        if (depth >= 1e30f) depth = std::numeric_limits<float>::infinity();
    return depths;
}

Result<std::vector<glm::vec3>> MesoRenderer::readNormals() {
    const auto words = state_->plane(1);
    if (!words) return words.error();
    std::vector<glm::vec3> normals;
    for (const uint32_t code : *words) normals.push_back(code == 0 ? glm::vec3(0) : unpackNormal(code));
    return normals;
}

Result<std::vector<uint32_t>> MesoRenderer::readIterations() { return state_->plane(3); }

std::vector<std::string> MesoRenderer::validationMessages() const { return state_->instance->log().messages(); }

}  // namespace vcp
