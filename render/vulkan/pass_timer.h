// Reads the queue's clock between passes.
#pragma once

#include <functional>
#include <vector>

#include "octree/io/result.h"
#include "render/vulkan/device.h"

namespace vcp {

class PassTimer {
public:
    /// `marks`: readings of a recording. Without a clock on the queue nothing is made, times are 0. Errors: Device.
    static Result<PassTimer> create(const Device& device, uint32_t marks);
    PassTimer() = default;
    PassTimer(PassTimer&& other) noexcept { *this = std::move(other); }
    PassTimer& operator=(PassTimer&& other) noexcept;
    ~PassTimer();

    [[nodiscard]] bool hasClock() const { return pool_ != VK_NULL_HANDLE; }
    /// Records the reset, before the first mark of a recording.
    void reset(VkCommandBuffer commands) const;
    /// Records a reading of the clock when all before it is done.
    void mark(VkCommandBuffer commands, uint32_t i) const;
    /// Returns the milliseconds between consecutive marks. Precondition: what was recorded is done. Errors: Device.
    [[nodiscard]] Result<std::vector<double>> read() const;

    /// Submits what `record` records, with a mark before and behind it, and waits. Returns the milliseconds between the
    /// marks, or without a clock those of the call. Precondition: there are two marks. Errors: Device.
    Result<double> timed(Device& device, const std::function<void(VkCommandBuffer)>& record) const;

private:
    const Device* device_ = nullptr;  // not owned
    uint32_t marks_ = 0;
    VkQueryPool pool_ = VK_NULL_HANDLE;
};

}  // namespace vcp
