#include "render/passes/remesh_sweep.h"

#include <algorithm>
#include <cstring>

#include "render/passes/descriptor_types.h"
#include "render/remesh_count_spirv.h"
#include "render/remesh_emit_spirv.h"
#include "render/remesh_scan_spirv.h"
#include "render/vulkan/check.h"
#include "render/vulkan/raster_pipeline.h"

namespace vcp {

namespace {

using Math = meso::RemeshMath<float>;

constexpr VkDescriptorType kBindings[] = {kTexels, kTexels, kTexels, kStorage, kStorage, kStorage, kStorage, kStorage};
constexpr uint32_t kBindingCount = std::size(kBindings);
constexpr VkDescriptorPoolSize kPoolSizes[] = {{kTexels, 3}, {kStorage, 5}};
// Columns of a workgroup of the counting and of the writing shader.
constexpr uint32_t kCounted = 256, kEmitted = 64;
constexpr uint64_t kVertexBytes = sizeof(meso::RemeshVertex<float>);

/// As remesh_piece.glsl has it.
struct PushedSweep {
    Math::RemeshView view;
    uint32_t levels, mapWidth, pieces, columns, mostVertices, mostIndices;
};
static_assert(sizeof(PushedSweep) == 48);

uint32_t groups(uint32_t columns, uint32_t each) { return (columns + each - 1) / each; }

}  // namespace

RemeshSweepPass::~RemeshSweepPass() {
    vkDestroyPipelineLayout(device_.handle(), layout_, nullptr);
    vkDestroyDescriptorSetLayout(device_.handle(), setLayout_, nullptr);
}

Result<void> RemeshSweepPass::createPipelines() {
    if (emitOfAll_.handle() != VK_NULL_HANDLE) return {};
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (uint32_t i = 0; i < kBindingCount; ++i)
        bindings.push_back({i, kBindings[i], 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    set.bindingCount = kBindingCount;
    set.pBindings = bindings.data();
    if (setLayout_ == VK_NULL_HANDLE) VCP_VK(vkCreateDescriptorSetLayout, device_.handle(), &set, nullptr, &setLayout_);
    const VkPushConstantRange pushed{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(PushedSweep)};
    VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &setLayout_;
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &pushed;
    if (layout_ == VK_NULL_HANDLE) VCP_VK(vkCreatePipelineLayout, device_.handle(), &layout, nullptr, &layout_);
    VCP_TRY_ASSIGN(count_, ComputePipeline::create(device_, layout_, kRemeshCountSpirv, {}));
    VCP_TRY_ASSIGN(scan_, ComputePipeline::create(device_, layout_, kRemeshScanSpirv, {}));
    VCP_TRY_ASSIGN(emit_, ComputePipeline::create(device_, layout_, kRemeshEmitSpirv, {}));
    const uint32_t allTiles = 1;
    VCP_TRY_ASSIGN(emitOfAll_, ComputePipeline::create(device_, layout_, kRemeshEmitSpirv, {&allTiles, 1}));
    return {};
}

/// Makes a buffer that has room, where there is none; returns whether it did. It grows by halves, so that a camera's
/// way makes few buffers.
Result<bool> RemeshSweepPass::grow(Buffer& buffer, uint64_t bytes, VkBufferUsageFlags usage, MemoryUse use) const {
    if (bytes <= buffer.bytes()) return false;
    buffer = {};
    // Texels of four words are whole.
    const uint64_t roomy = (bytes + bytes / 2 + 15) / 16 * 16;
    VCP_TRY_ASSIGN(buffer, device_.createBuffer(roomy, usage, use));
    return true;
}

Result<void> RemeshSweepPass::upload(RemeshSwept& swept, const meso::RemeshBatch& batch) const {
    const auto send = [&](Buffer& buffer, TexelView& view, VkFormat format,
                          std::span<const std::byte> bytes) -> Result<void> {
        VCP_TRY_ASSIGN(const bool isNew,
                       grow(buffer, bytes.size(), VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, MemoryUse::Upload));
        if (isNew) {
            VCP_TRY_ASSIGN(view, device_.createTexelView(buffer, format, buffer.bytes()));
        }
        std::memcpy(buffer.mapped(), bytes.data(), bytes.size());
        return {};
    };
    VCP_TRY(send(swept.quads, swept.quadsView, VK_FORMAT_R32G32B32A32_UINT, std::as_bytes(std::span(batch.quads))));
    return send(swept.firstColumns, swept.firstColumnsView, VK_FORMAT_R32_UINT,
                std::as_bytes(std::span(batch.firstColumns)));
}

void RemeshSweepPass::writeSet(const RemeshSwept& swept, const HeightPool& heights) const {
    const VkBufferView views[] = {heights.view(), swept.quadsView.handle(), swept.firstColumnsView.handle()};
    const VkBuffer buffers[] = {swept.counts.handle(), swept.drawn.handle(), swept.vertices.handle(),
                                swept.indices.handle(), heights.marks().handle()};
    VkDescriptorBufferInfo infos[kBindingCount] = {};
    VkWriteDescriptorSet writes[kBindingCount];
    for (uint32_t i = 0; i < kBindingCount; ++i) {
        writes[i] = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        writes[i].dstSet = swept.set.set;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = kBindings[i];
        if (i < std::size(views)) {
            writes[i].pTexelBufferView = &views[i];
        } else {
            infos[i] = {buffers[i - std::size(views)], 0, VK_WHOLE_SIZE};
            writes[i].pBufferInfo = &infos[i];
        }
    }
    vkUpdateDescriptorSets(device_.handle(), kBindingCount, writes, 0, nullptr);
}

meso::RemeshBatchLimits RemeshSweepPass::limits() const {
    meso::RemeshBatchLimits limits;
    // Buffers may have half as much room again.
    const uint64_t texels = device_.limits().maxTexelBufferElements, quads = 2 * uint64_t{Math::kRemeshPieceQuads};
    limits.pieces = std::min(limits.pieces, texels / quads);
    return limits;
}

Result<void> RemeshSweepPass::prepare(std::vector<RemeshSwept>& swept, const meso::RemeshPieces& pieces,
                                      const HeightPool& heights) {
    VCP_TRY(createPipelines());
    for (RemeshSwept& batch : swept) batch.pieces = batch.columns = 0;
    if (swept.size() < pieces.used) swept.resize(pieces.used);
    for (size_t i = 0; i < pieces.used; ++i) {
        const meso::RemeshBatch& batch = pieces.batches[i];
        RemeshSwept& made = swept[i];
        constexpr VkBufferUsageFlags kRead = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
        const uint64_t columns = batch.columns();
        VCP_TRY(upload(made, batch));
        VCP_TRY(grow(made.counts, 8 * (columns + groups(uint32_t(columns), kCounted)), kRead, MemoryUse::Local));
        VCP_TRY(grow(made.drawn, 24, kRead | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT, MemoryUse::Local));
        VCP_TRY(grow(made.vertices, kVertexBytes * batch.mostVertices, kRead | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT,
                     MemoryUse::Local));
        VCP_TRY(
            grow(made.indices, 24 * batch.mostVertices, kRead | VK_BUFFER_USAGE_INDEX_BUFFER_BIT, MemoryUse::Local));
        if (made.set.set == VK_NULL_HANDLE) {
            VCP_TRY_ASSIGN(made.set, allocateSet(device_.handle(), setLayout_, kPoolSizes));
        }
        writeSet(made, heights);
        made.pieces = batch.pieces(), made.columns = batch.columns(), made.hasAllTiles = heights.hasAll();
    }
    return {};
}

void RemeshSweepPass::record(VkCommandBuffer commands, const std::vector<RemeshSwept>& swept,
                             const meso::HeightLevels& heights, const Math::RemeshView& view) const {
    const uint32_t levels = uint32_t(heights.used()), width = uint32_t(heights.levels().front().size.x);
    const auto dispatch = [&](const ComputePipeline& pipeline, const RemeshSwept& batch, uint32_t groupCount) {
        const PushedSweep pushed{view,
                                 levels,
                                 width,
                                 batch.pieces,
                                 batch.columns,
                                 uint32_t(batch.vertices.bytes() / kVertexBytes),
                                 uint32_t(batch.indices.bytes() / 4)};
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
        vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &batch.set.set, 0, nullptr);
        vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof pushed, &pushed);
        vkCmdDispatch(commands, groupCount, 1, 1);
    };
    const auto forEach = [&](const auto& call) {
        for (const RemeshSwept& batch : swept)
            if (batch.columns > 0) call(batch);
    };
    forEach([&](const RemeshSwept& batch) { dispatch(count_, batch, groups(batch.columns, kCounted)); });
    barrierComputeToCompute(commands);
    forEach([&](const RemeshSwept& batch) { dispatch(scan_, batch, 1); });
    barrierComputeToCompute(commands);
    forEach([&](const RemeshSwept& batch) {
        dispatch(batch.hasAllTiles ? emitOfAll_ : emit_, batch, groups(batch.columns, kEmitted));
    });
    barrierComputeToDraw(commands);
}

void drawSwept(VkCommandBuffer commands, const std::vector<RemeshSwept>& swept) {
    for (const RemeshSwept& batch : swept) {
        if (batch.columns == 0) continue;
        const VkBuffer vertices = batch.vertices.handle();
        const VkDeviceSize start = 0;
        vkCmdBindVertexBuffers(commands, 0, 1, &vertices, &start);
        vkCmdBindIndexBuffer(commands, batch.indices.handle(), 0, VK_INDEX_TYPE_UINT32);
        vkCmdDrawIndexedIndirect(commands, batch.drawn.handle(), 0, 1, 0);
    }
}

}  // namespace vcp
