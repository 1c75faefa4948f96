// Finds first hits in a dataset of the method `paper` (shaders/paper_trace.comp), in place of the trace pass.
// Reads constants, pool, table, tile list. Writes hits, counters. Before: the beam pass. After:
// barrierComputeToCompute, recorded here. Made only where such a dataset is drawn.
#pragma once

#include "octree/page/paper_page.h"
#include "render/passes/frame_resources.h"

namespace vcp {

class PaperTracePass {
public:
    PaperTracePass();
    /// Makes the variant's pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, bool sections,
                         const PaperMarch& march);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
