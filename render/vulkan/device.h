// A logical device with one queue, and one only for copies where it has such; its buffers and commands.
//
// What is submitted runs in the order of submission, beside the CPU; submitAndWait() waits for its end. A submission
// that overwrites what an earlier one reads begins with barrierToAll (compute_pipeline.h). Copies on a queue of their
// own wait for all frames submitted before them, and what is submitted next waits for the copies; the CPU does not.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"
#include "render/vulkan/command_queue.h"
#include "render/vulkan/device_info.h"
#include "render/vulkan/instance.h"

namespace vcp {

class Device;

/// A buffer with memory of its own. Move-only; destroyed with its last owner, before the device.
class Buffer {
public:
    Buffer() = default;
    ~Buffer() { destroy(); }
    Buffer(Buffer&& other) noexcept { *this = std::move(other); }
    Buffer& operator=(Buffer&& other) noexcept;

    [[nodiscard]] VkBuffer handle() const { return buffer_; }
    [[nodiscard]] uint64_t bytes() const { return bytes_; }
    /// Returns the mapped memory, or null where the CPU cannot see it.
    [[nodiscard]] std::byte* mapped() const { return mapped_; }

private:
    friend class Device;
    void destroy();

    VkDevice device_ = VK_NULL_HANDLE;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    std::byte* mapped_ = nullptr;
    uint64_t bytes_ = 0;
    uint64_t* account_ = nullptr;  // the device's count of allocated bytes
};

/// A view of a buffer as texels. Move-only.
class TexelView {
public:
    TexelView() = default;
    ~TexelView() { destroy(); }
    TexelView(TexelView&& other) noexcept { *this = std::move(other); }
    TexelView& operator=(TexelView&& other) noexcept;
    [[nodiscard]] VkBufferView handle() const { return view_; }

private:
    friend class Device;
    void destroy();

    VkDevice device_ = VK_NULL_HANDLE;
    VkBufferView view_ = VK_NULL_HANDLE;
};

/// Where a buffer lives. Local: in the device's memory, mapped where the device allows it (software and
/// integrated devices). Upload: written by the CPU, read by copies or shaders. Readback: written by the
/// device, read by the CPU.
enum class MemoryUse { Local, Upload, Readback };

class Device {
public:
    /// `choice` as in RendererOptions::device. `forWindows` asks for the swapchain extension and a queue with graphics,
    /// a surface for a queue that can show pictures in it. Errors: Device.
    static Result<std::unique_ptr<Device>> create(const Instance& instance, const std::string& choice,
                                                  VkSurfaceKHR surface, bool forWindows,
                                                  const DeviceFaults& faults = {});
    /// Wraps the host's device, not owned. Errors: Usage (something is missing), Device (too old, no such queue).
    static Result<std::unique_ptr<Device>> borrow(const HostDevice& host, const DeviceFaults& faults = {});
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    [[nodiscard]] VkDevice handle() const { return device_; }
    [[nodiscard]] VkPhysicalDevice physical() const { return physical_; }
    [[nodiscard]] VkQueue queue() const { return frames_.handle(); }
    [[nodiscard]] uint32_t queueFamily() const { return family_; }
    [[nodiscard]] VkPipelineCache pipelineCache() const { return pipelineCache_; }
    /// Whether the queue can scale pictures.
    [[nodiscard]] bool hasGraphics() const { return hasGraphics_; }
    [[nodiscard]] const DeviceInfo& info() const { return info_; }
    [[nodiscard]] const VkPhysicalDeviceLimits& limits() const { return limits_; }
    /// Nanoseconds of a timestamp step, 0 where the queue has no timestamps.
    [[nodiscard]] double timestampNanoseconds() const { return timestampNanoseconds_; }

    /// Counts submissions, and how often the CPU waited for one, since create().
    [[nodiscard]] const DeviceWork& work() const { return work_; }

    /// Whether the queue can show pictures in this window.
    [[nodiscard]] bool shows(VkSurfaceKHR surface) const;
    /// Whether the device was lost: then nothing works any more but destroying it.
    [[nodiscard]] bool isLost() const { return work_.isLost; }
    /// Whether memory for a buffer was lacking since the last call.
    [[nodiscard]] bool takeOutOfMemory() const { return std::exchange(outOfMemory_, false); }

    /// Makes a buffer. Errors: Device (out of memory).
    Result<Buffer> createBuffer(uint64_t bytes, VkBufferUsageFlags usage, MemoryUse use) const;
    /// Makes a buffer in the device's memory that holds `parts`, one after the other. Where the CPU does not see that
    /// memory, it waits for the copies: not while commands are recorded. Errors: Device.
    Result<Buffer> createFilled(std::span<const std::span<const std::byte>> parts, VkBufferUsageFlags usage);
    /// Returns a memory type among the bits `allowed`. Errors: Device.
    Result<uint32_t> memoryType(uint32_t allowed, MemoryUse use) const;
    Result<TexelView> createTexelView(const Buffer& buffer, VkFormat format, uint64_t bytes) const;

    /// Hands `record` a command buffer, submits it and waits until it is done.
    template <class Record>
    Result<void> submitAndWait(Record record) {
        VCP_TRY_ASSIGN(auto commands, beginCommands());
        record(commands);
        return endCommandsAndWait();
    }
    Result<VkCommandBuffer> beginCommands() { return frames_.begin(); }
    /// Submits what was recorded and returns the submission's number. With semaphores, transfers wait for `wait`, and
    /// `signal` is signalled. Errors: Device.
    Result<uint64_t> endCommands(VkSemaphore wait = VK_NULL_HANDLE, VkSemaphore signal = VK_NULL_HANDLE);
    Result<void> endCommandsAndWait(VkSemaphore wait = VK_NULL_HANDLE, VkSemaphore signal = VK_NULL_HANDLE);
    /// Whether a submission has ended. Never waits.
    [[nodiscard]] bool isDone(uint64_t submission) { return frames_.isDone(submission); }
    Result<void> waitFor(uint64_t submission) { return frames_.waitFor(submission); }
    /// Waits for all submissions, not for copies on a queue of their own.
    Result<void> waitForAll() { return frames_.waitFor(frames_.last()); }

    /// Copies between buffers; the copies begin when all that was submitted before them has ended, and are done before
    /// anything that is submitted after them. Returns a number for waitForCopies().
    template <class Record>
    Result<uint64_t> submitCopies(Record record) {
        VCP_TRY_ASSIGN(auto commands, beginCopies());
        record(commands);
        return endCopies(commands);
    }
    /// Waits for copies. Errors: Device.
    Result<void> waitForCopies(uint64_t copies) { return copyQueue().waitFor(copies); }
    Result<void> waitForCopies() { return waitForCopies(copyQueue().last()); }

private:
    Device() = default;
    /// Whether the device's memory is the processor's, too.
    [[nodiscard]] bool hasUnifiedMemory() const;
    Result<void> allocate(Buffer& buffer, VkBufferUsageFlags usage, MemoryUse use) const;
    void describe(VkPhysicalDevice physical, const DeviceInfo& info);
    [[nodiscard]] std::vector<VkQueueFamilyProperties> queueFamilies() const;
    void useFamily(uint32_t index, const VkQueueFamilyProperties& family);
    Result<void> chooseQueue(VkSurfaceKHR surface, bool forWindows);
    Result<void> createDevice();
    Result<void> createObjects();
    void chooseCopyFamily();
    [[nodiscard]] CommandQueue& copyQueue() { return copies_.exists() ? copies_ : frames_; }
    Result<VkCommandBuffer> beginCopies();
    Result<uint64_t> endCopies(VkCommandBuffer commands);

    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue hostQueue_ = VK_NULL_HANDLE;  // the queue of a device that is not ours
    DeviceWork work_;
    CommandQueue frames_, copies_;  // copies_ exists where there is a queue for copies only
    VkPipelineCache pipelineCache_ = VK_NULL_HANDLE;
    uint32_t family_ = 0;
    VkSemaphore copiesDone_ = VK_NULL_HANDLE;  // signalled by copies, waited for by what is submitted next
    VkSemaphore framesDone_ = VK_NULL_HANDLE;  // signalled after frames, waited for by copies
    bool copiesAwaited_ = false;               // nothing waits for copiesDone_ yet
    uint64_t framesBeforeCopies_ = 0;          // the last submission that copies have waited for
    std::optional<uint32_t> copyFamily_;
    double timestampNanoseconds_ = 0;
    DeviceInfo info_;
    VkPhysicalDeviceLimits limits_{};
    VkPhysicalDeviceMemoryProperties memory_{};
    DeviceFaults faults_;
    mutable uint64_t allocated_ = 0;
    mutable bool outOfMemory_ = false;
    bool hasSwapchain_ = false, hasGraphics_ = false, borrowed_ = false;
};

}  // namespace vcp
