// Composes pictures of several datasets, dataset after dataset (shaders/compose.comp): the nearest surface is seen.
// Reads constants, tile list, hits and picture of the dataset's resources; writes the target: the picture of the first
// dataset's resources, and depths of its own. Before: the shade pass. After: barrierComputeToReadback, recorded here.
// Where datasets shade each other, gathers normals in the place of the picture, after the trace pass; then come the
// scene's light (passes/scene_light.h) and the shade pass, which composes by itself.
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

/// What the pictures are composed into: one target a view, as large as its picture.
class ComposeTarget {
public:
    /// Makes the depths as large as the picture, and with `lit` the planes of light. Returns whether any is new or
    /// gone. Errors: Device.
    Result<bool> resize(Device& device, PictureSize size, bool lit);
    /// Marks all pixels as not hit, before the first dataset of a frame. Between begin() and the passes' first barrier.
    void clear(VkCommandBuffer commands) const;
    [[nodiscard]] const Buffer& depths() const { return depths_; }
    /// Null where there are no planes of light.
    [[nodiscard]] const Buffer* light() const { return light_.bytes() > 0 ? &light_ : nullptr; }
    /// Records the copy of the count of hits to where hitPixels() reads it. Comes after ComposePass::record; ends with
    /// barrierTransferToHost.
    void recordReadback(VkCommandBuffer commands) const;
    /// Returns the number of pixels where something is hit. Precondition: the frame is done.
    [[nodiscard]] uint32_t hitPixels() const;

private:
    PictureSize size_;
    Buffer depths_;   // a word a pixel, and the count of pixels that are hit
    Buffer counted_;  // that count, for the CPU
    Buffer light_;    // frame::kScenePlanes words a pixel
};

class ComposePass {
public:
    ComposePass();
    /// `resources` are the dataset's, with the target set. Makes the pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, bool gathers);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources) const;
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
