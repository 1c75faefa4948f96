#include "render/passes/image_words.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace vcp {

namespace {

// What the tables of images may take beside their texels.
constexpr uint64_t kTableBytes = 1ull << 20;
constexpr uint64_t kStagedBytes = 16ull << 20;

/// Returns the tables, which the texels follow (images.glsl).
std::vector<uint32_t> tableWords(const ImageSet& set) {
    std::vector<uint32_t> words{uint32_t(set.materials().size()), 0, 0, 0};
    std::vector<uint32_t> placeOf;
    auto end = uint32_t(4 + 4 * set.materials().size());
    for (const ImageSet::Image& image : set.images()) {
        placeOf.push_back(end);
        end += uint32_t(4 + 4 * image.levels.size());
    }
    for (const MaterialRow& material : set.materials())
        words.insert(words.end(), {placeOf[material.image], material.factor,
                                   uint32_t(material.wrapU) | uint32_t(material.wrapV) << 8, 0});
    for (const ImageSet::Image& image : set.images()) {
        words.insert(words.end(), {image.width, image.height, image.finest, uint32_t(image.levels.size())});
        for (const ImageSet::Level& level : image.levels)
            words.insert(words.end(), {level.width, level.height, uint32_t(end + level.first), 0});
    }
    return words;
}

/// Copies words into a buffer that the CPU does not see, a part at a time.
Result<void> copyStaged(Device& device, const Buffer& buffer, uint64_t at, std::span<const std::byte> bytes) {
    if (bytes.empty()) return {};
    VCP_TRY_ASSIGN(const auto staging, device.createBuffer(std::min<uint64_t>(bytes.size(), kStagedBytes),
                                                           VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload));
    for (uint64_t done = 0; done < bytes.size(); done += staging.bytes()) {
        const auto part = bytes.subspan(done, std::min<uint64_t>(staging.bytes(), bytes.size() - done));
        std::memcpy(staging.mapped(), part.data(), part.size());
        VCP_TRY(device.submitAndWait([&](VkCommandBuffer commands) {
            const VkBufferCopy region{0, at + done, part.size()};
            vkCmdCopyBuffer(commands, staging.handle(), buffer.handle(), 1, &region);
        }));
    }
    return {};
}

}  // namespace

uint64_t mostImageBytes(const Device& device) {
    const uint64_t most = device.limits().maxStorageBufferRange;
    return most > kTableBytes ? most - kTableBytes : 0;
}

Result<Buffer> uploadImages(Device& device, const ImageSet& images) {
    const std::vector<uint32_t> tables = tableWords(images);
    const auto head = std::as_bytes(std::span(tables)), texels = std::as_bytes(images.texels());
    VCP_TRY_ASSIGN(
        auto buffer,
        device.createBuffer(head.size() + texels.size(),
                            VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Local));
    if (std::byte* const mapped = buffer.mapped()) {
        std::ranges::copy(head, mapped);
        std::ranges::copy(texels, mapped + head.size());
        return buffer;
    }
    VCP_TRY(copyStaged(device, buffer, 0, head));
    VCP_TRY(copyStaged(device, buffer, head.size(), texels));
    return buffer;
}

}  // namespace vcp
