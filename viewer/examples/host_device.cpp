// Draws on a Vulkan device of the host's, into an image of the host's: host_device FILE.vcp. Reads the image back, and
// says how many of its pixels differ from the background in the corner.
#include <vulkan/vulkan.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include <vcp/vcp.hpp>

namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;

void check(VkResult result, const char* call) {
    if (result != VK_SUCCESS) throw std::runtime_error(std::string(call) + ": " + std::to_string(result));
}
#define VK(call, ...) check(call(__VA_ARGS__), #call)

// What a host already has: instance, device, queue, and an image in linear memory that it can read.
struct Host {
    VkInstance instance = nullptr;
    VkPhysicalDevice physical = nullptr;
    VkDevice device = nullptr;
    VkQueue queue = nullptr;
    uint32_t family = 0;
    VkImage image = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;

    Host() {
        VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
        application.apiVersion = VK_API_VERSION_1_2;  // the widget wants this
        VkInstanceCreateInfo info{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
        info.pApplicationInfo = &application;
        VK(vkCreateInstance, &info, nullptr, &instance);
        uint32_t one = 1;
        if (vkEnumeratePhysicalDevices(instance, &one, &physical) < 0 || one == 0)
            throw std::runtime_error("no Vulkan device");
        chooseFamily();
        makeDevice();
        makeImage();
    }
    ~Host() {
        vkDestroyImage(device, image, nullptr);
        vkFreeMemory(device, memory, nullptr);
        vkDestroyDevice(device, nullptr);
        vkDestroyInstance(instance, nullptr);
    }

    void chooseFamily() {
        uint32_t count = 0;
        vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
        std::vector<VkQueueFamilyProperties> families(count);
        vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
        constexpr VkQueueFlags kWanted = VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT;
        while (family < count && (families[family].queueFlags & kWanted) != kWanted) ++family;
    }
    void makeDevice() {
        const float priority = 1;
        VkDeviceQueueCreateInfo queues{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
        queues.queueFamilyIndex = family;
        queues.queueCount = 1;
        queues.pQueuePriorities = &priority;
        VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
        info.queueCreateInfoCount = 1;
        info.pQueueCreateInfos = &queues;
        VK(vkCreateDevice, physical, &info, nullptr, &device);
        vkGetDeviceQueue(device, family, 0, &queue);
    }
    void makeImage() {
        VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
        info.imageType = VK_IMAGE_TYPE_2D;
        info.format = VK_FORMAT_R8G8B8A8_UNORM;
        info.extent = {kWidth, kHeight, 1};
        info.mipLevels = info.arrayLayers = 1;
        info.samples = VK_SAMPLE_COUNT_1_BIT;
        info.tiling = VK_IMAGE_TILING_LINEAR;
        info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
        VK(vkCreateImage, device, &info, nullptr, &image);
        VkMemoryRequirements needs;
        VkPhysicalDeviceMemoryProperties has;
        vkGetImageMemoryRequirements(device, image, &needs);
        vkGetPhysicalDeviceMemoryProperties(physical, &has);
        constexpr VkMemoryPropertyFlags kMapped =
            VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
        VkMemoryAllocateInfo allocation{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
        allocation.allocationSize = needs.size;
        while ((needs.memoryTypeBits >> allocation.memoryTypeIndex & 1) == 0 ||
               (has.memoryTypes[allocation.memoryTypeIndex].propertyFlags & kMapped) != kMapped)
            if (++allocation.memoryTypeIndex == has.memoryTypeCount)
                throw std::runtime_error("no memory that can be looked into");
        VK(vkAllocateMemory, device, &allocation, nullptr, &memory);
        VK(vkBindImageMemory, device, image, memory, 0);
    }
    uint32_t pixelsUnlikeTheCorner() const {
        const VkImageSubresource part{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0};
        VkSubresourceLayout layout;
        vkGetImageSubresourceLayout(device, image, &part, &layout);
        void* mapped = nullptr;
        VK(vkMapMemory, device, memory, 0, VK_WHOLE_SIZE, 0, &mapped);
        uint32_t different = 0;
        for (uint32_t y = 0; y < kHeight; ++y) {
            const unsigned char* row = static_cast<unsigned char*>(mapped) + layout.offset + y * layout.rowPitch;
            for (uint32_t x = 0; x < kWidth; ++x) different += std::memcmp(row + 4 * x, row, 4) != 0;
        }
        vkUnmapMemory(device, memory);
        return different;
    }
};

void run(const char* file) {
    const Host host;
    vcp_host_device device = vcp::widget::sized<vcp_host_device>();
    device.instance = host.instance;
    device.physical_device = host.physical;
    device.device = host.device;
    device.queue = host.queue;
    device.queue_family = host.family;
    vcp_context_options options = vcp::widget::sized<vcp_context_options>();
    options.host_device = &device;
    vcp::widget::Context context(options);
    context.open(file);
    vcp::widget::View view(context, kWidth, kHeight);
    view.settle(60);

    vcp_host_image target = vcp::widget::sized<vcp_host_image>();
    target.image = uint64_t(host.image);
    target.width = kWidth;
    target.height = kHeight;
    target.layout_after = VK_IMAGE_LAYOUT_GENERAL;
    view.copyTo(target);
    std::printf("%u pixels show the surface\n", host.pixelsUnlikeTheCorner());
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc < 2) throw std::runtime_error("usage: host_device FILE.vcp");
        run(argv[1]);
        return EXIT_SUCCESS;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return EXIT_FAILURE;
    }
}
