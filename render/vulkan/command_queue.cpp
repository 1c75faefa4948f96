#include "render/vulkan/command_queue.h"

#include <algorithm>

#include "render/vulkan/check.h"

namespace vcp {

Result<void> CommandQueue::create(VkDevice device, VkQueue queue, uint32_t family, DeviceWork& work) {
    device_ = device;
    queue_ = queue;
    work_ = &work;
    VkCommandPoolCreateInfo info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    info.queueFamilyIndex = family;
    VCP_VK(vkCreateCommandPool, device_, &info, nullptr, &pool_);
    return {};
}

void CommandQueue::destroy() {
    if (device_ == VK_NULL_HANDLE) return;
    // Signals of semaphores have no fence to wait for.
    vkQueueWaitIdle(queue_);
    for (const Recording& recording : recordings_) vkDestroyFence(device_, recording.fence, nullptr);
    vkDestroyCommandPool(device_, pool_, nullptr);
    device_ = VK_NULL_HANDLE;
}

/// Returns a recording that no submission uses, and makes one where there is none.
Result<size_t> CommandQueue::freeRecording() {
    for (size_t i = 0; i < recordings_.size(); ++i)
        if (isDone(recordings_[i].number)) return i;
    Recording made;
    VkCommandBufferAllocateInfo commands{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    commands.commandPool = pool_;
    commands.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    commands.commandBufferCount = 1;
    VCP_VK(vkAllocateCommandBuffers, device_, &commands, &made.commands);
    const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
    VCP_VK(vkCreateFence, device_, &fence, nullptr, &made.fence);
    recordings_.push_back(made);
    return recordings_.size() - 1;
}

Result<VkCommandBuffer> CommandQueue::begin() {
    if (current_) {
        VCP_VK(vkResetCommandBuffer, recordings_[*current_].commands, 0);
    } else {
        VCP_TRY_ASSIGN(current_, freeRecording());
    }
    VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    VCP_VK(vkBeginCommandBuffer, recordings_[*current_].commands, &begin);
    return recordings_[*current_].commands;
}

Result<uint64_t> CommandQueue::submit(const QueueSemaphores& semaphores) {
    Recording& recording = recordings_[*current_];
    VCP_VK(vkEndCommandBuffer, recording.commands);
    VCP_VK(vkResetFences, device_, 1, &recording.fence);
    VkSemaphore waits[2];
    VkPipelineStageFlags stages[2];
    VkSubmitInfo info{VK_STRUCTURE_TYPE_SUBMIT_INFO};
    for (int i = 0; i < 2; ++i) {
        if (semaphores.waits[i] == VK_NULL_HANDLE) continue;
        waits[info.waitSemaphoreCount] = semaphores.waits[i];
        stages[info.waitSemaphoreCount++] = semaphores.stages[i];
    }
    info.pWaitSemaphores = waits;
    info.pWaitDstStageMask = stages;
    info.commandBufferCount = 1;
    info.pCommandBuffers = &recording.commands;
    info.signalSemaphoreCount = semaphores.signal != VK_NULL_HANDLE ? 1 : 0;
    info.pSignalSemaphores = &semaphores.signal;
    VCP_TRY(submitTo(info, recording.fence));
    current_.reset();
    return recording.number = ++last_;
}

Result<void> CommandQueue::submitSignal(VkSemaphore semaphore) {
    VkSubmitInfo info{VK_STRUCTURE_TYPE_SUBMIT_INFO};
    info.signalSemaphoreCount = 1;
    info.pSignalSemaphores = &semaphore;
    return submitTo(info, VK_NULL_HANDLE);
}

Result<void> CommandQueue::submitTo(const VkSubmitInfo& info, VkFence fence) {
    // A device that is lost stays lost, also one that is only said to be.
    const bool isLost = work_->isLost || ++work_->submissions == work_->lostAtSubmission;
    const VkResult done = isLost ? VK_ERROR_DEVICE_LOST : vkQueueSubmit(queue_, 1, &info, fence);
    work_->isLost = work_->isLost || done == VK_ERROR_DEVICE_LOST;
    return done == VK_SUCCESS ? Result<void>() : vulkanError("vkQueueSubmit", done);
}

bool CommandQueue::isDone(uint64_t number) {
    if (number <= done_) return true;
    for (const Recording& recording : recordings_)
        if (recording.number > done_ && vkGetFenceStatus(device_, recording.fence) == VK_SUCCESS)
            done_ = recording.number;
    return number <= done_;
}

Result<void> CommandQueue::waitFor(uint64_t number) {
    if (isDone(number)) return {};
    ++work_->waits;
    const auto recording = std::find_if(recordings_.begin(), recordings_.end(),
                                        [&](const Recording& each) { return each.number == number; });
    const VkResult done = vkWaitForFences(device_, 1, &recording->fence, VK_TRUE, UINT64_MAX);
    work_->isLost = work_->isLost || done == VK_ERROR_DEVICE_LOST;
    if (done != VK_SUCCESS) return vulkanError("vkWaitForFences", done);
    done_ = std::max(done_, number);
    return {};
}

}  // namespace vcp
