// Adds samples to a picture, part by part (shaders/accumulate.comp). A picture of one sample has no such pass.
// Reads constants and the picture of the part's resources; reads and writes the sums and the picture that is shown.
// Before: the last pass that draws the part. After: barrierComputeToReadback, recorded here.
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

/// The sums of a view's last picture: light times alpha, and alpha, four floats a pixel.
class SampleSums {
public:
    /// Makes the sums as large as the picture. Errors: Limit, where the device cannot address them; Device.
    Result<void> resize(Device& device, PictureSize size);
    [[nodiscard]] const Buffer& buffer() const { return buffer_; }

private:
    PictureSize size_;
    Buffer buffer_;
};

class AccumulatePass {
public:
    AccumulatePass();
    /// `resources` are the part's, with the sums set. Makes the pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants);
    /// `rows`: of the part. Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources, uint32_t rows) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
