#include "render/remesh_meter.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>

#include "render/passes/descriptor_types.h"
#include "render/passes/readback.h"
#include "render/passes/remesh_raster.h"
#include "render/passes/remesh_sweep.h"
#include "render/remesh_frag_spirv.h"
#include "render/remesh_patch_tesc_spirv.h"
#include "render/remesh_patch_tese_spirv.h"
#include "render/remesh_patch_vert_spirv.h"
#include "render/vulkan/check.h"
#include "render/vulkan/pass_timer.h"

namespace vcp {

namespace {

double processorMs() { return double(std::clock()) * 1e3 / CLOCKS_PER_SEC; }

double medianOf(std::vector<double> times) {
    std::ranges::sort(times);
    return times[times.size() / 2];
}

using Math = meso::RemeshMath<float>;

constexpr int kMostTessellated = 64;  // parts of an edge, on every device
// Lavapipe loses patches of draws that become more than 65,536 vertices; a patch becomes 2,500 at most.
constexpr uint32_t kPatchesOfADraw = 24;
constexpr VkShaderStageFlags kPatchStages =
    VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT | VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT;

/// As remesh_patch.glsl has it.
struct PushedPatch {
    RemeshProjection projection;
    Math::RemeshView view;
    uint32_t levels, mapWidth;
};
static_assert(sizeof(PushedPatch) == 64);

RemeshProjection projectionOf(const meso::RemeshCamera& camera) {
    const glm::dvec4 s = camera.seen;
    const double width = s.z - s.x, height = s.w - s.y;
    RemeshProjection made{};
    made.plane = {2 / width, -2 / height, -(s.x + s.z) / width, (s.y + s.w) / height};
    made.depth = {0, camera.nearest, 1, 0};
    return made;
}

/// Counts what tessellators make of the pieces of a batch: rings of ever fewer points about a middle.
void addTessellated(const meso::RemeshBatch& batch, RemeshDrawn& drawn) {
    for (size_t i = 0; i < batch.pieces(); ++i) {
        glm::ivec3 cells[3];
        for (size_t k = 0; k < 3; ++k) cells[k] = batch.quads[i * Math::kRemeshPieceQuads + 6 + k];
        const Math::RemeshPlan plan = Math::remeshPlan(cells[0], cells[1], cells[2]);
        uint64_t border = 3;
        int inner = 1;
        if (plan.isWhole == 0) {
            border = 0;
            for (int k = 0; k < 3; ++k) border += uint64_t(Math::remeshEdge(cells[k], cells[(k + 1) % 3]).cells);
            const int area =
                Math::remeshArea(cells[plan.first], cells[plan.second], cells[plan.apex], plan.sweep, plan.side);
            inner = std::clamp(int(std::lround(std::sqrt(area / 1.5))), border > 3 ? 2 : 1, kMostTessellated);
        }
        uint64_t vertices = border + (inner % 2 == 0 ? 1 : 0);
        for (int ring = inner - 2; ring > 0; ring -= 2) vertices += 3 * uint64_t(ring);
        drawn.vertices += vertices, drawn.triangles += 2 * vertices - border - 2;
    }
}

/// Returns a family that computes and rasterizes.
Result<uint32_t> familyOf(VkPhysicalDevice physical, const std::string& name) {
    constexpr VkQueueFlags kWanted = VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT;
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    for (uint32_t i = 0; i < count; ++i)
        if ((families[i].queueFlags & kWanted) == kWanted) return i;
    return Error{.code = ErrorCode::Unsupported, .message = "no queue of '" + name + "' rasterizes"};
}

/// A device with a tessellator where there is one; Device::borrow() wraps it.
struct TessellatingDevice {
    VkDevice handle = VK_NULL_HANDLE;
    bool tessellates = false;

    TessellatingDevice() = default;
    TessellatingDevice(const TessellatingDevice&) = delete;
    TessellatingDevice& operator=(const TessellatingDevice&) = delete;
    ~TessellatingDevice() { vkDestroyDevice(handle, nullptr); }

    Result<void> create(VkPhysicalDevice physical, uint32_t family) {
        VkPhysicalDeviceFeatures has, wanted{};
        vkGetPhysicalDeviceFeatures(physical, &has);
        wanted.tessellationShader = has.tessellationShader;
        tessellates = has.tessellationShader == VK_TRUE;
        const float priority = 1;
        VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
        queue.queueFamilyIndex = family;
        queue.queueCount = 1;
        queue.pQueuePriorities = &priority;
        VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
        info.queueCreateInfoCount = 1;
        info.pQueueCreateInfos = &queue;
        info.pEnabledFeatures = &wanted;
        VCP_VK(vkCreateDevice, physical, &info, nullptr, &handle);
        return {};
    }
};

/// Draws pieces as patches.
struct Patches {
    VkDevice device = VK_NULL_HANDLE;
    VkDescriptorSetLayout setLayout = VK_NULL_HANDLE;
    RasterPipeline pipeline;
    std::vector<MesoSet> sets;

    Patches() = default;
    Patches(const Patches&) = delete;
    Patches& operator=(const Patches&) = delete;
    ~Patches() {
        if (device != VK_NULL_HANDLE) vkDestroyDescriptorSetLayout(device, setLayout, nullptr);
    }

    Result<void> create(const Device& on) {
        if (pipeline.exists()) return {};
        device = on.handle();
        VkDescriptorSetLayoutBinding bindings[2];
        for (uint32_t i = 0; i < 2; ++i) bindings[i] = {i, kTexels, 1, kPatchStages, nullptr};
        VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
        set.bindingCount = 2;
        set.pBindings = bindings;
        VCP_VK(vkCreateDescriptorSetLayout, device, &set, nullptr, &setLayout);
        VCP_TRY_ASSIGN(pipeline,
                       RasterPipeline::create(on, {.vertex = kRemeshPatchVertSpirv,
                                                   .fragment = kRemeshFragSpirv,
                                                   .control = kRemeshPatchTescSpirv,
                                                   .evaluation = kRemeshPatchTeseSpirv,
                                                   .pushBytes = sizeof(PushedPatch),
                                                   .set = setLayout,
                                                   .colours = {kRemeshColours.begin(), kRemeshColours.end()}}));
        return {};
    }
    /// Binds levels and pieces, a set a batch.
    Result<void> bind(const std::vector<RemeshSwept>& swept, const HeightPool& heights) {
        sets.clear();
        for (const RemeshSwept& batch : swept) {
            const VkDescriptorPoolSize size{kTexels, 2};
            VCP_TRY_ASSIGN(auto owner, allocateSet(device, setLayout, std::span(&size, 1)));
            const VkBufferView views[] = {heights.view(), batch.quadsView.handle()};
            VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
            write.dstSet = owner.set;
            write.descriptorCount = 1;
            write.descriptorType = kTexels;
            for (write.dstBinding = 0; write.dstBinding < 2; ++write.dstBinding) {
                write.pTexelBufferView = &views[write.dstBinding];
                vkUpdateDescriptorSets(device, 1, &write, 0, nullptr);
            }
            sets.push_back(std::move(owner));
        }
        return {};
    }
};

}  // namespace

struct RemeshMeter::State {
    std::unique_ptr<Instance> instance;
    TessellatingDevice made;
    std::unique_ptr<Device> device;
    std::unique_ptr<MesoResources> resources;
    std::unique_ptr<RemeshSweepPass> pass;
    PassTimer timer;
    meso::RemeshPieces pieces;
    std::vector<RemeshSwept> swept;
    RasterPipeline triangles;
    Patches patches;
    RasterTarget target;
    Buffer hits;

    Result<std::unique_ptr<HeightPool>> heightsOf(std::shared_ptr<const meso::HeightLevels> heights) const {
        VCP_TRY_ASSIGN(auto pool, HeightPool::create(*device, std::move(heights)));
        VCP_TRY(pool->loadAll());
        return pool;
    }
    Result<void> prepareTarget(uint32_t width, uint32_t height) {
        if (!triangles.exists()) {
            VCP_TRY_ASSIGN(triangles, createRemeshPipeline(*device));
        }
        if (target.size().width == width && target.size().height == height) return {};
        target = {};
        VCP_TRY_ASSIGN(target, RasterTarget::create(*device, triangles, kRemeshColours, {width, height}));
        VCP_TRY_ASSIGN(hits, device->createBuffer(uint64_t{width} * height * sizeof(glm::vec4),
                                                  VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
        return {};
    }
    void drawTriangles(VkCommandBuffer commands, const RemeshProjection& projection) const {
        triangles.begin(commands, target.framebuffer(), target.size());
        vkCmdPushConstants(commands, triangles.layout(), triangles.pushStages(), 0, sizeof projection, &projection);
        drawSwept(commands, swept);
        vkCmdEndRenderPass(commands);
    }
    void drawPatches(VkCommandBuffer commands, const RemeshProjection& projection,
                     const meso::HeightLevels& heights) const {
        const RasterPipeline& pipeline = patches.pipeline;
        pipeline.begin(commands, target.framebuffer(), target.size());
        const PushedPatch pushed{projection, pieces.view, uint32_t(heights.used()),
                                 uint32_t(heights.levels().front().size.x)};
        vkCmdPushConstants(commands, pipeline.layout(), pipeline.pushStages(), 0, sizeof pushed, &pushed);
        for (size_t i = 0; i < swept.size(); ++i) {
            if (swept[i].columns == 0) continue;
            vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.layout(), 0, 1,
                                    &patches.sets[i].set, 0, nullptr);
            for (uint32_t first = 0; first < swept[i].pieces; first += kPatchesOfADraw)
                vkCmdDraw(commands, 3 * std::min(kPatchesOfADraw, swept[i].pieces - first), 1, 3 * first, 0);
        }
        vkCmdEndRenderPass(commands);
    }
};

RemeshMeter::RemeshMeter(std::unique_ptr<State> state) : state_(std::move(state)) {}
RemeshMeter::~RemeshMeter() = default;

Result<std::unique_ptr<RemeshMeter>> RemeshMeter::create(const std::string& device, bool validation) {
    auto state = std::make_unique<State>();
    VCP_TRY_ASSIGN(state->instance, Instance::create(validation, {}));
    VCP_TRY_ASSIGN(const auto physical, state->instance->physicalDevices());
    std::vector<DeviceInfo> infos;
    for (uint32_t i = 0; i < physical.size(); ++i) infos.push_back(describeDevice(physical[i], i));
    VCP_TRY_ASSIGN(const uint32_t chosen, chooseDevice(infos, device));
    VCP_TRY_ASSIGN(const uint32_t family, familyOf(physical[chosen], infos[chosen].name));
    VCP_TRY(state->made.create(physical[chosen], family));
    HostDevice host{state->instance->handle(), physical[chosen], state->made.handle, VK_NULL_HANDLE, family};
    vkGetDeviceQueue(host.device, family, 0, &host.queue);
    VCP_TRY_ASSIGN(state->device, Device::borrow(host));
    VCP_TRY_ASSIGN(state->resources, MesoResources::create(*state->device));
    VCP_TRY_ASSIGN(state->timer, PassTimer::create(*state->device, 2));
    state->pass = std::make_unique<RemeshSweepPass>(*state->device);
    return std::unique_ptr<RemeshMeter>(new RemeshMeter(std::move(state)));
}

const DeviceInfo& RemeshMeter::device() const { return state_->device->info(); }

Result<RemeshTimes> RemeshMeter::measure(const meso::RemeshSurface& surface, const meso::RemeshCamera& camera,
                                         const meso::RemeshOptions& options, int rounds) {
    return timed(
        surface.heights,
        [&] { return meso::makeRemeshPieces(surface, camera, options, state_->pieces, state_->pass->limits()); },
        rounds);
}

Result<RemeshTimes> RemeshMeter::measure(meso::CertifiedCells& cells, const meso::RemeshCamera& camera,
                                         const meso::RemeshOptions& options, int rounds) {
    return timed(
        cells.patches().heights,
        [&] { return meso::makeRemeshPieces(cells, camera, options, state_->pieces, state_->pass->limits()); }, rounds);
}

template <class Make>
Result<RemeshTimes> RemeshMeter::timed(const std::shared_ptr<const meso::HeightLevels>& heights, const Make& make,
                                       int rounds) {
    State& s = *state_;
    VCP_TRY_ASSIGN(const auto pool, s.heightsOf(heights));
    std::vector<double> pieces, sweeps, processor;
    for (int round = 0; round <= rounds; ++round) {
        const double start = processorMs();
        VCP_TRY(make());
        VCP_TRY(s.pass->prepare(s.swept, s.pieces, *pool));
        const double prepared = processorMs();
        VCP_TRY_ASSIGN(const double ms, s.timer.timed(*s.device, [&](VkCommandBuffer commands) {
            barrierToAll(commands);
            s.pass->record(commands, s.swept, *heights, s.pieces.view);
        }));
        if (round == 0) continue;
        pieces.push_back(prepared - start), sweeps.push_back(ms), processor.push_back(processorMs() - prepared);
    }
    RemeshTimes times{medianOf(pieces), medianOf(sweeps), medianOf(processor)};
    for (const RemeshSwept& batch : s.swept) {
        if (batch.columns == 0) continue;
        VCP_TRY_ASSIGN(const auto drawn, readWords(*s.device, batch.drawn, 0, 6));
        times.triangles += drawn[0] / 3, times.vertices += drawn[5];
        times.bytes += batch.vertices.bytes() + batch.indices.bytes();
    }
    return times;
}

Result<RemeshDrawn> RemeshMeter::draw(const meso::RemeshSurface& surface, const meso::RemeshCamera& camera,
                                      const meso::RemeshOptions& options, RemeshWay way, uint32_t width,
                                      uint32_t height, int rounds) {
    State& s = *state_;
    const bool sweeps = way == RemeshWay::Sweep;
    if (!sweeps && !s.made.tessellates)
        return Error{.code = ErrorCode::Unsupported, .message = "'" + device().name + "' has no tessellator"};
    meso::RemeshOptions cut = options;
    if (!sweeps) cut.mostCells = std::min(options.mostCells, kMostTessellated);
    VCP_TRY_ASSIGN(const auto pool, s.heightsOf(surface.heights));
    VCP_TRY(s.prepareTarget(width, height));
    VCP_TRY(meso::makeRemeshPieces(surface, camera, cut, s.pieces, s.pass->limits()));
    VCP_TRY(s.pass->prepare(s.swept, s.pieces, *pool));
    if (!sweeps) {
        VCP_TRY(s.patches.create(*s.device));
        VCP_TRY(s.patches.bind(s.swept, *pool));
    }
    const RemeshProjection projection = projectionOf(camera);
    std::vector<double> times, processor;
    for (int round = 0; round <= rounds; ++round) {
        const double start = processorMs();
        VCP_TRY_ASSIGN(const double ms, s.timer.timed(*s.device, [&](VkCommandBuffer commands) {
            barrierToAll(commands);
            if (sweeps) {
                s.pass->record(commands, s.swept, *surface.heights, s.pieces.view);
                s.drawTriangles(commands, projection);
            } else {
                s.drawPatches(commands, projection, *surface.heights);
            }
            s.target.copy(commands, 0, s.hits);
            barrierTransferToHost(commands);
        }));
        if (round == 0) continue;
        times.push_back(ms), processor.push_back(processorMs() - start);
    }
    RemeshDrawn drawn{medianOf(times), medianOf(processor)};
    drawn.hits.resize(size_t{width} * height);
    std::memcpy(drawn.hits.data(), s.hits.mapped(), drawn.hits.size() * sizeof(glm::vec4));
    for (size_t i = 0; i < s.pieces.used; ++i) {
        if (!sweeps) {
            addTessellated(s.pieces.batches[i], drawn);
            continue;
        }
        VCP_TRY_ASSIGN(const auto words, readWords(*s.device, s.swept[i].drawn, 0, 6));
        drawn.triangles += words[0] / 3, drawn.vertices += words[5];
    }
    return drawn;
}

std::vector<std::string> RemeshMeter::validationMessages() const { return state_->instance->log().messages(); }

}  // namespace vcp
