// Sweeps the pieces of remeshed surfaces on the device (mesostructure/shared/remesh_sweep.h): counts the vertices and
// indices of each column of grid points, adds the counts up, and writes both to where they are drawn from
// (shaders/remesh_count.comp, remesh_scan.comp, remesh_emit.comp). The processor culls, halves and uploads pieces
// (mesostructure/remesh/remesh_pieces.h); how much room a piece needs it knows without counting, so it waits for
// nothing.
//
// Reads levels and pieces; writes vertices, indices and what is drawn. record() ends with barrierComputeToDraw; before
// it nothing may read the buffers any more.
#pragma once

#include <vector>

#include "mesostructure/remesh/remesh_pieces.h"
#include "render/height_pool.h"
#include "render/passes/meso_resources.h"
#include "render/vulkan/compute_pipeline.h"
#include "render/vulkan/device.h"

namespace vcp {

/// A batch of pieces in one frame. What is drawn: VkDrawIndexedIndirectCommand, and the number of vertices.
struct RemeshSwept {
    Buffer quads, firstColumns;  ///< uploaded
    TexelView quadsView, firstColumnsView;
    Buffer counts, drawn, vertices, indices;
    MesoSet set;
    uint32_t pieces = 0, columns = 0;
    bool hasAllTiles = false;  ///< of its heights
};

class RemeshSweepPass {
public:
    explicit RemeshSweepPass(Device& device) : device_(device) {}
    ~RemeshSweepPass();
    RemeshSweepPass(const RemeshSweepPass&) = delete;
    RemeshSweepPass& operator=(const RemeshSweepPass&) = delete;

    /// Returns what a batch may have on this device.
    [[nodiscard]] meso::RemeshBatchLimits limits() const;
    /// Uploads the pieces, and makes room for what they become; batches that are no longer used keep theirs.
    /// Precondition: no frame in flight uses the batches; they are within limits(). Errors: Device.
    Result<void> prepare(std::vector<RemeshSwept>& swept, const meso::RemeshPieces& pieces, const HeightPool& heights);
    /// Records the sweep. Precondition: prepare() with the same pieces.
    void record(VkCommandBuffer commands, const std::vector<RemeshSwept>& swept, const meso::HeightLevels& heights,
                const meso::RemeshMath<float>::RemeshView& view) const;

private:
    Result<void> createPipelines();
    Result<bool> grow(Buffer& buffer, uint64_t bytes, VkBufferUsageFlags usage, MemoryUse use) const;
    Result<void> upload(RemeshSwept& swept, const meso::RemeshBatch& batch) const;
    void writeSet(const RemeshSwept& swept, const HeightPool& heights) const;

    Device& device_;
    VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    ComputePipeline count_, scan_, emit_, emitOfAll_;  // the last: where all tiles are there
};

/// Records the draws of what was swept, within a render pass.
void drawSwept(VkCommandBuffer commands, const std::vector<RemeshSwept>& swept);

}  // namespace vcp
