// Reports what the rays of 24 x 16 pixels met (shaders/feedback.comp); that drives the order in which pages are read
// (streaming/load_order.h). Only frames that miss pages have this pass, and nothing is made before the first.
// Reads constants, table, tile starts, hits. Writes its own buffer, and copies it where the CPU cannot see it, with
// the frame's own commands: reading it once the frame is done waits for nothing. Before: the trace pass. After: the
// barrier to the CPU, recorded here.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "render/passes/frame_resources.h"
#include "streaming/load_order.h"

namespace vcp {

/// What one frame's pass reports into. It stays as it is until that frame has ended.
class FeedbackTarget {
public:
    /// Returns what the last frame with the pass reported. Precondition: that frame is done.
    [[nodiscard]] RayFeedback read() const;

private:
    friend class FeedbackPass;
    Result<void> reserve(Device& device, uint64_t words);

    Buffer buffer_, readback_;     // readback_ is used where buffer_ is not mapped
    std::vector<uint64_t> pages_;  // for each record of the table, its page; pages of the cut only
};

class FeedbackPass {
public:
    FeedbackPass();
    /// `table`: the frame's page table. Makes pipeline and buffers on first use. Errors: Device.
    Result<void> prepare(Device& device, FeedbackTarget& target, FrameResources& resources,
                         const PassConstants& constants, std::span<const frame::TableRecord> table);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FeedbackTarget& target);
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

    /// The number of passes recorded so far.
    [[nodiscard]] uint64_t passes() const { return passes_; }
    /// Where in their parts of the picture the rays of the next pass go, 0 to 1: another place each time.
    [[nodiscard]] glm::vec2 jitter() const;

private:
    PipelineVariants pipelines_;
    uint64_t passes_ = 0;
};

}  // namespace vcp
