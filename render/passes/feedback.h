// What the rays of a frame report to the CPU, in a buffer of their own that is copied, where the CPU cannot see it,
// with the frame's own commands: reading it once the frame is done waits for nothing. It holds
//
//   what the rays of 24 x 16 pixels met (shaders/feedback.comp), which drives the order in which pages are read
//   (streaming/load_order.h): frames that miss pages have this pass;
//   which pages any ray hit (shaders/cast.glsl), which drives what is read (streaming/pages_seen.h): the trace and
//   light passes say so in frames that draw pages which could be refined.
//
// Other frames have neither, and nothing is made before the first that has. The pass reads constants, table, tile
// starts and hits, and writes the buffer. Before: the trace pass. After: FeedbackTarget::recordReadback(), with the
// barrier to the CPU.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "render/passes/frame_resources.h"
#include "streaming/load_order.h"
#include "streaming/pages_seen.h"

namespace vcp {

/// What one frame reports into. It stays as it is until that frame has ended.
class FeedbackTarget {
public:
    /// Makes the buffer as large as `table`, the frame's page table, needs, and lets the shaders see it. Errors:
    /// Device.
    Result<void> prepare(Device& device, FrameResources& resources, std::span<const frame::TableRecord> table);
    /// The value of FrameConstants::firstHitMark with which pages are marked.
    [[nodiscard]] uint32_t firstHitMark() const;
    /// Records that the buffer is cleared. Before the passes comes barrierToAll. Precondition: prepare().
    void clear(VkCommandBuffer commands) const;
    /// Records the copy to where it is read, and the barrier to the CPU.
    void recordReadback(VkCommandBuffer commands) const;

    /// Returns what the last frame with the pass reported. Precondition: that frame is done.
    [[nodiscard]] RayFeedback read() const;
    /// Returns which pages the rays of the last frame that marked pages hit. Precondition: that frame is done.
    [[nodiscard]] PagesHit pagesHit() const;

private:
    Result<void> reserve(Device& device, uint64_t words);
    [[nodiscard]] uint64_t words() const;
    [[nodiscard]] std::vector<uint32_t> readWords() const;

    Buffer buffer_, readback_;  // readback_ is used where buffer_ is not mapped
    struct Recorded {
        uint64_t page, asked;  // the latter is another one where a page is drawn in the place of a finer one
    };
    std::vector<Recorded> pages_;  // for each record of the table; records of the cut only
};

class FeedbackPass {
public:
    FeedbackPass();
    /// Makes the pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants);
    /// Precondition: prepare(), and the frame's FeedbackTarget is cleared.
    void record(VkCommandBuffer commands);
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
