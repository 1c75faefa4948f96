// A queue of the device, with its command buffers. Submissions are numbered from 1 and end in the order of their
// numbers. Each has a command buffer and a fence of its own until it is known to have ended; then both are used again.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"

namespace vcp {

/// What all queues of a device have done together.
struct DeviceWork {
    uint64_t submissions = 0, waits = 0;  ///< waits: how often the CPU waited for a submission
    uint64_t lostAtSubmission = 0;        ///< DeviceFaults::lostAtSubmission
    bool isLost = false;
};

/// What is submitted waits for these, at these stages, and signals one. Null ones are left out.
struct QueueSemaphores {
    VkSemaphore waits[2] = {VK_NULL_HANDLE, VK_NULL_HANDLE};
    VkPipelineStageFlags stages[2] = {0, 0};
    VkSemaphore signal = VK_NULL_HANDLE;
};

/// Used by one thread.
class CommandQueue {
public:
    CommandQueue() = default;
    ~CommandQueue() { destroy(); }
    CommandQueue(const CommandQueue&) = delete;
    CommandQueue& operator=(const CommandQueue&) = delete;

    /// `work` is counted in. Errors: Device.
    Result<void> create(VkDevice device, VkQueue queue, uint32_t family, DeviceWork& work);
    /// Waits for all that runs. The device must still be there.
    void destroy();

    [[nodiscard]] bool exists() const { return queue_ != VK_NULL_HANDLE; }
    [[nodiscard]] VkQueue handle() const { return queue_; }

    /// Returns a command buffer that records; what was recorded and not submitted is forgotten. Errors: Device.
    Result<VkCommandBuffer> begin();

    /// Submits what was recorded since begin() and returns its number at once. Errors: Device.
    Result<uint64_t> submit(const QueueSemaphores& semaphores);
    /// Submits nothing but the signal of a semaphore: given when all earlier submissions have ended. Errors: Device.
    Result<void> submitSignal(VkSemaphore semaphore);

    /// Returns the number of the last submission; 0: there was none.
    [[nodiscard]] uint64_t last() const { return last_; }
    /// Whether that submission has ended; asks the device, and waits for nothing. 0 has ended.
    [[nodiscard]] bool isDone(uint64_t number);
    /// Waits until that submission has ended; counted only where it had not. Errors: Device.
    Result<void> waitFor(uint64_t number);

private:
    struct Recording {
        VkCommandBuffer commands = VK_NULL_HANDLE;
        VkFence fence = VK_NULL_HANDLE;
        uint64_t number = 0;  // of the submission; 0: none yet
    };
    Result<void> submitTo(const VkSubmitInfo& info, VkFence fence);
    Result<size_t> freeRecording();

    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    std::vector<Recording> recordings_;
    std::optional<size_t> current_;  // records
    uint64_t last_ = 0, done_ = 0;
    DeviceWork* work_ = nullptr;  // not owned
};

}  // namespace vcp
