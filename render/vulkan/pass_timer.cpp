#include "render/vulkan/pass_timer.h"

#include <chrono>
#include <utility>

#include "render/vulkan/check.h"

namespace vcp {

Result<PassTimer> PassTimer::create(const Device& device, uint32_t marks) {
    PassTimer made;
    made.device_ = &device, made.marks_ = marks;
    if (device.timestampNanoseconds() == 0) return made;
    VkQueryPoolCreateInfo info{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    info.queryCount = marks;
    VCP_VK(vkCreateQueryPool, device.handle(), &info, nullptr, &made.pool_);
    return made;
}

PassTimer& PassTimer::operator=(PassTimer&& other) noexcept {
    std::swap(device_, other.device_), std::swap(marks_, other.marks_), std::swap(pool_, other.pool_);
    return *this;
}

PassTimer::~PassTimer() {
    if (hasClock()) vkDestroyQueryPool(device_->handle(), pool_, nullptr);
}

void PassTimer::reset(VkCommandBuffer commands) const {
    if (hasClock()) vkCmdResetQueryPool(commands, pool_, 0, marks_);
}

void PassTimer::mark(VkCommandBuffer commands, uint32_t i) const {
    if (hasClock()) vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, pool_, i);
}

Result<std::vector<double>> PassTimer::read() const {
    std::vector<double> ms(marks_ - 1, 0.0);
    if (!hasClock()) return ms;
    std::vector<uint64_t> t(marks_);
    VCP_VK(vkGetQueryPoolResults, device_->handle(), pool_, 0, marks_, t.size() * sizeof(uint64_t), t.data(),
           sizeof(uint64_t), VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
    for (uint32_t i = 0; i + 1 < marks_; ++i) ms[i] = double(t[i + 1] - t[i]) * device_->timestampNanoseconds() * 1e-6;
    return ms;
}

Result<double> PassTimer::timed(Device& device, const std::function<void(VkCommandBuffer)>& record) const {
    const auto start = std::chrono::steady_clock::now();
    VCP_TRY(device.submitAndWait([&](VkCommandBuffer commands) {
        reset(commands);
        mark(commands, 0);
        record(commands);
        mark(commands, 1);
    }));
    if (!hasClock()) return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    VCP_TRY_ASSIGN(const auto ms, read());
    return ms.front();
}

}  // namespace vcp
