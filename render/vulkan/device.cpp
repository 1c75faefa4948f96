#include "render/vulkan/device.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "render/vulkan/check.h"
#include "render/vulkan/compute_pipeline.h"

namespace vcp {

Buffer& Buffer::operator=(Buffer&& other) noexcept {
    if (this == &other) return *this;
    destroy();
    device_ = std::exchange(other.device_, VK_NULL_HANDLE);
    buffer_ = std::exchange(other.buffer_, VK_NULL_HANDLE);
    memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
    mapped_ = std::exchange(other.mapped_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
    account_ = std::exchange(other.account_, nullptr);
    return *this;
}

void Buffer::destroy() {
    if (device_ == VK_NULL_HANDLE) return;
    vkDestroyBuffer(device_, buffer_, nullptr);
    vkFreeMemory(device_, memory_, nullptr);
    if (account_ != nullptr) *account_ -= bytes_;
}

TexelView& TexelView::operator=(TexelView&& other) noexcept {
    if (this == &other) return *this;
    destroy();
    device_ = std::exchange(other.device_, VK_NULL_HANDLE);
    view_ = std::exchange(other.view_, VK_NULL_HANDLE);
    return *this;
}

void TexelView::destroy() {
    if (device_ != VK_NULL_HANDLE) vkDestroyBufferView(device_, view_, nullptr);
}

void Device::describe(VkPhysicalDevice physical, const DeviceInfo& info) {
    physical_ = physical;
    info_ = info;
    info_.chosen = true;
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(physical_, &properties);
    limits_ = properties.limits;
    vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
}

Result<std::unique_ptr<Device>> Device::create(const Instance& instance, const std::string& choice,
                                               VkSurfaceKHR surface, bool forWindows, const DeviceFaults& faults) {
    VCP_TRY_ASSIGN(auto physical, instance.physicalDevices());
    std::vector<DeviceInfo> infos;
    for (uint32_t i = 0; i < physical.size(); ++i) infos.push_back(describeDevice(physical[i], i));
    VCP_TRY_ASSIGN(auto chosen, chooseDevice(infos, choice));

    std::unique_ptr<Device> made(new Device);
    made->faults_ = faults;
    made->describe(physical[chosen], infos[chosen]);
    VCP_TRY(made->chooseQueue(surface, forWindows));
    made->hasSwapchain_ = forWindows;
    VCP_TRY(made->createDevice());
    VCP_TRY(made->createObjects());
    return made;
}

Result<std::unique_ptr<Device>> Device::borrow(const HostDevice& host, const DeviceFaults& faults) {
    if (host.instance == VK_NULL_HANDLE || host.physical == VK_NULL_HANDLE || host.device == VK_NULL_HANDLE ||
        host.queue == VK_NULL_HANDLE)
        return Error{.code = ErrorCode::Usage,
                     .message = "the host's device lacks its instance, physical device, device or queue"};
    std::unique_ptr<Device> made(new Device);
    made->borrowed_ = true;
    made->faults_ = faults;
    made->describe(host.physical, describeDevice(host.physical, 0));
    if (!made->info_.usable)
        return Error{.code = ErrorCode::Device,
                     .message = "device '" + made->info_.name + "' has no Vulkan 1.2 with compute"};
    const auto families = made->queueFamilies();
    if (host.queueFamily >= families.size() || (families[host.queueFamily].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0)
        return Error{.code = ErrorCode::Device,
                     .message = "queue family " + std::to_string(host.queueFamily) + " of device '" + made->info_.name +
                                "' does not compute"};
    made->useFamily(host.queueFamily, families[host.queueFamily]);
    made->device_ = host.device;
    made->hostQueue_ = host.queue;
    made->hasSwapchain_ = vkGetDeviceProcAddr(host.device, "vkCreateSwapchainKHR") != nullptr;
    VCP_TRY(made->createObjects());
    return made;
}

std::vector<VkQueueFamilyProperties> Device::queueFamilies() const {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, families.data());
    return families;
}

void Device::useFamily(uint32_t index, const VkQueueFamilyProperties& family) {
    family_ = index;
    hasGraphics_ = (family.queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0;
    timestampNanoseconds_ = family.timestampValidBits > 0 ? double(limits_.timestampPeriod) : 0;
}

Result<void> Device::chooseQueue(VkSurfaceKHR surface, bool forWindows) {
    const auto families = queueFamilies();
    // Pictures are scaled to windows and to the host's images on queues with graphics, so these are tried
    // first.
    for (const bool graphics : {true, false}) {
        for (uint32_t i = 0; i < families.size(); ++i) {
            const VkQueueFlags wanted = graphics ? VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT : VK_QUEUE_COMPUTE_BIT;
            if ((families[i].queueFlags & wanted) != wanted) continue;
            VkBool32 shows = VK_TRUE;
            if (surface != VK_NULL_HANDLE) VCP_VK(vkGetPhysicalDeviceSurfaceSupportKHR, physical_, i, surface, &shows);
            if (shows != VK_TRUE) continue;
            useFamily(i, families[i]);
            return {};
        }
        if (forWindows) break;
    }
    return Error{.code = ErrorCode::Device,
                 .message = "device '" + info_.name + "' has no queue that computes and shows pictures"};
}

bool Device::shows(VkSurfaceKHR surface) const {
    VkBool32 shows = VK_FALSE;
    return hasSwapchain_ && vkGetPhysicalDeviceSurfaceSupportKHR(physical_, family_, surface, &shows) == VK_SUCCESS &&
           shows == VK_TRUE;
}

/// Chooses a family that can only copy and runs beside the processors, as discrete GPUs have.
void Device::chooseCopyFamily() {
    const auto families = queueFamilies();
    for (uint32_t i = 0; i < families.size() && !copyFamily_; ++i)
        if ((families[i].queueFlags & (VK_QUEUE_TRANSFER_BIT | VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT)) ==
            VK_QUEUE_TRANSFER_BIT)
            copyFamily_ = i;
    if (faults_.separateCopies && !copyFamily_) copyFamily_ = family_;
}

Result<void> Device::createDevice() {
    const float priority = 1;
    chooseCopyFamily();
    std::vector<VkDeviceQueueCreateInfo> queues(copyFamily_.value_or(family_) != family_ ? 2 : 1,
                                                {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO});
    for (VkDeviceQueueCreateInfo& queue : queues) {
        queue.queueFamilyIndex = &queue == &queues[0] ? family_ : *copyFamily_;
        queue.queueCount = 1;
        queue.pQueuePriorities = &priority;
    }

    const char* swapchain = VK_KHR_SWAPCHAIN_EXTENSION_NAME;
    VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    info.queueCreateInfoCount = uint32_t(queues.size());
    info.pQueueCreateInfos = queues.data();
    info.enabledExtensionCount = hasSwapchain_ ? 1 : 0;
    info.ppEnabledExtensionNames = &swapchain;
    VCP_VK(vkCreateDevice, physical_, &info, nullptr, &device_);
    return {};
}

Result<void> Device::createObjects() {
    work_.lostAtSubmission = faults_.lostAtSubmission;
    VkQueue queue = hostQueue_;
    if (queue == VK_NULL_HANDLE) vkGetDeviceQueue(device_, family_, 0, &queue);
    VCP_TRY(frames_.create(device_, queue, family_, work_));
    const VkPipelineCacheCreateInfo cache{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
    VCP_VK(vkCreatePipelineCache, device_, &cache, nullptr, &pipelineCache_);
    if (!copyFamily_) return {};
    vkGetDeviceQueue(device_, *copyFamily_, 0, &queue);
    VCP_TRY(copies_.create(device_, queue, *copyFamily_, work_));
    const VkSemaphoreCreateInfo semaphore{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    VCP_VK(vkCreateSemaphore, device_, &semaphore, nullptr, &copiesDone_);
    VCP_VK(vkCreateSemaphore, device_, &semaphore, nullptr, &framesDone_);
    return {};
}

Device::~Device() {
    if (device_ == VK_NULL_HANDLE) return;
    copies_.destroy();
    frames_.destroy();
    vkDestroySemaphore(device_, framesDone_, nullptr);
    vkDestroySemaphore(device_, copiesDone_, nullptr);
    vkDestroyPipelineCache(device_, pipelineCache_, nullptr);
    if (!borrowed_) vkDestroyDevice(device_, nullptr);
}

bool Device::hasUnifiedMemory() const {
    return (info_.software || info_.type == "integrated") && !faults_.separateMemory;
}

Result<uint32_t> Device::memoryType(uint32_t allowed, MemoryUse use) const {
    constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    constexpr VkMemoryPropertyFlags kMapped =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
    // Local memory is mapped only on unified memory: a discrete device's mapped window is small.
    std::vector<VkMemoryPropertyFlags> wishes;
    if (use == MemoryUse::Local)
        wishes = hasUnifiedMemory() ? std::vector{kLocal | kMapped | kCached, kLocal | kMapped, kLocal}
                                    : std::vector{kLocal};
    if (use == MemoryUse::Upload) wishes = {kMapped};
    if (use == MemoryUse::Readback) wishes = {kMapped | kCached, kMapped};
    for (const VkMemoryPropertyFlags wish : wishes)
        for (uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
            if ((allowed >> i & 1) != 0 && (memory_.memoryTypes[i].propertyFlags & wish) == wish) return i;
    return Error{.code = ErrorCode::Device, .message = "device '" + info_.name + "' has no fitting memory"};
}

Result<Buffer> Device::createBuffer(uint64_t bytes, VkBufferUsageFlags usage, MemoryUse use) const {
    Buffer made;
    made.device_ = device_;
    made.bytes_ = bytes;
    VCP_TRY(allocate(made, usage, use));
    return made;
}

Result<Buffer> Device::createFilled(std::span<const std::span<const std::byte>> parts, VkBufferUsageFlags usage) {
    constexpr uint64_t kStagedBytes = 16ull << 20;
    uint64_t bytes = 0, done = 0, staged = 0;
    for (const auto part : parts) bytes += part.size();
    VCP_TRY_ASSIGN(auto filled, createBuffer(bytes, usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Local));
    Buffer staging;
    if (filled.mapped() == nullptr) {
        VCP_TRY_ASSIGN(
            staging, createBuffer(std::min(bytes, kStagedBytes), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload));
    }
    const auto send = [&]() -> Result<void> {
        const VkBufferCopy region{0, done, std::exchange(staged, 0)};
        done += region.size;
        return submitAndWait([&](VkCommandBuffer commands) {
            vkCmdCopyBuffer(commands, staging.handle(), filled.handle(), 1, &region);
        });
    };
    for (auto rest : parts) {
        if (filled.mapped() != nullptr) {
            std::ranges::copy(rest, filled.mapped() + done);
            done += rest.size();
            continue;
        }
        while (!rest.empty()) {
            const auto some = rest.first(std::min<uint64_t>(rest.size(), staging.bytes() - staged));
            std::ranges::copy(some, staging.mapped() + staged);
            rest = rest.subspan(some.size());
            staged += some.size();
            if (staged == staging.bytes()) VCP_TRY(send());
        }
    }
    if (staged > 0) VCP_TRY(send());
    return filled;
}

Result<void> Device::allocate(Buffer& made, VkBufferUsageFlags usage, MemoryUse use) const {
    VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = made.bytes_;
    info.usage = usage;
    // The buffer is shared by both queues, so that bytes need no change of owner between them.
    const std::array families{family_, copyFamily_.value_or(family_)};
    if (families[0] != families[1]) {
        info.sharingMode = VK_SHARING_MODE_CONCURRENT;
        info.queueFamilyIndexCount = uint32_t(families.size());
        info.pQueueFamilyIndices = families.data();
    }
    VCP_VK(vkCreateBuffer, device_, &info, nullptr, &made.buffer_);
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device_, made.buffer_, &needs);
    VCP_TRY_ASSIGN(auto type, memoryType(needs.memoryTypeBits, use));
    VkMemoryAllocateInfo allocation{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex = type;
    const bool isItsOwn = use == MemoryUse::Local || hasUnifiedMemory();
    const bool fits =
        !isItsOwn || (made.bytes_ <= faults_.memoryBytes && allocated_ <= faults_.memoryBytes - made.bytes_);
    const VkResult allocated =
        fits ? vkAllocateMemory(device_, &allocation, nullptr, &made.memory_) : VK_ERROR_OUT_OF_DEVICE_MEMORY;
    if (allocated != VK_SUCCESS) {
        made.memory_ = VK_NULL_HANDLE;
        outOfMemory_ = true;
        return vulkanError("vkAllocateMemory", allocated);
    }
    if (isItsOwn) {
        made.account_ = &allocated_;
        allocated_ += made.bytes_;
    }
    VCP_VK(vkBindBufferMemory, device_, made.buffer_, made.memory_, 0);
    const bool isHidden = use == MemoryUse::Local && faults_.separateMemory;
    if (!isHidden && (memory_.memoryTypes[type].propertyFlags & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) != 0) {
        void* mapped = nullptr;
        VCP_VK(vkMapMemory, device_, made.memory_, 0, VK_WHOLE_SIZE, 0, &mapped);
        made.mapped_ = static_cast<std::byte*>(mapped);
    }
    return {};
}

Result<TexelView> Device::createTexelView(const Buffer& buffer, VkFormat format, uint64_t bytes) const {
    TexelView made;
    made.device_ = device_;
    VkBufferViewCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
    info.buffer = buffer.handle();
    info.format = format;
    info.range = bytes;
    VCP_VK(vkCreateBufferView, device_, &info, nullptr, &made.view_);
    return made;
}

Result<uint64_t> Device::endCommands(VkSemaphore wait, VkSemaphore signal) {
    const auto done = frames_.submit({{wait, copiesAwaited_ ? copiesDone_ : VK_NULL_HANDLE},
                                      {VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT},
                                      signal});
    if (done) copiesAwaited_ = false;
    return done;
}

Result<void> Device::endCommandsAndWait(VkSemaphore wait, VkSemaphore signal) {
    const auto submission = endCommands(wait, signal);
    return submission ? waitFor(*submission) : submission.error();
}

Result<VkCommandBuffer> Device::beginCopies() {
    auto commands = copyQueue().begin();
    // On one queue the order of submission alone lets copies overtake the shaders that still read.
    if (commands && !copies_.exists()) barrierToAll(*commands);
    return commands;
}

Result<uint64_t> Device::endCopies(VkCommandBuffer commands) {
    if (!copies_.exists()) {
        barrierToAll(commands);
        return endCommands();
    }
    QueueSemaphores semaphores;
    // Earlier copies that nothing waits for yet: this submission's signal covers them too.
    if (copiesAwaited_) semaphores.waits[0] = copiesDone_, semaphores.stages[0] = VK_PIPELINE_STAGE_TRANSFER_BIT;
    if (frames_.last() > framesBeforeCopies_ && !frames_.isDone(frames_.last())) {
        VCP_TRY(frames_.submitSignal(framesDone_));
        semaphores.waits[1] = framesDone_, semaphores.stages[1] = VK_PIPELINE_STAGE_TRANSFER_BIT;
    }
    framesBeforeCopies_ = frames_.last();
    semaphores.signal = copiesDone_;
    const auto done = copies_.submit(semaphores);
    if (done) copiesAwaited_ = true;
    return done;
}

}  // namespace vcp
