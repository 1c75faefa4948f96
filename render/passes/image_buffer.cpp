#include "render/passes/image_buffer.h"

#include <vector>

#include <fmt/format.h>

#include "render/pages/image_words.h"

namespace vcp {

namespace {

// What the tables of images may take beside their texels: those of a million tiles.
constexpr uint64_t kTableBytes = 4ull << 20;

}  // namespace

uint64_t mostImageBytes(const Device& device) {
    const uint64_t most = device.limits().maxStorageBufferRange;
    return most > kTableBytes ? most - kTableBytes : 0;
}

Result<Buffer> uploadImages(Device& device, const ImageSet& images) {
    ImageSet within = images;
    within.shrinkTo(mostImageBytes(device));
    const ImageWords words = imageWords(within);
    std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(words.tables))};
    for (const std::span<const uint32_t> texels : words.texels) parts.push_back(std::as_bytes(texels));
    const uint64_t bytes = parts.front().size() + within.bytes(), most = device.limits().maxStorageBufferRange;
    if (bytes > most)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("{} bytes of images with their tables; this device reads {} at most", bytes, most)};
    return device.createFilled(parts, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
}

}  // namespace vcp
