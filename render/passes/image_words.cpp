#include "render/passes/image_words.h"

#include <vector>

#include <fmt/format.h>

namespace vcp {

namespace {

// What the tables of images may take beside their texels.
constexpr uint64_t kTableBytes = 1ull << 20;

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

}  // namespace

uint64_t mostImageBytes(const Device& device) {
    const uint64_t most = device.limits().maxStorageBufferRange;
    return most > kTableBytes ? most - kTableBytes : 0;
}

Result<Buffer> uploadImages(Device& device, const ImageSet& images) {
    const std::vector<uint32_t> tables = tableWords(images);
    const auto head = std::as_bytes(std::span(tables)), texels = std::as_bytes(images.texels());
    const uint64_t bytes = head.size() + texels.size(), most = device.limits().maxStorageBufferRange;
    if (bytes > most)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("{} bytes of images with their tables; this device reads {} at most", bytes, most)};
    return device.createFilled({head, texels}, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
}

}  // namespace vcp
