#include "render/passes/image_words.h"

#include <vector>

#include <fmt/format.h>

namespace vcp {

namespace {

// What the tables of images may take beside their texels.
constexpr uint64_t kTableBytes = 1ull << 20;

/// Returns the tables, which the texels follow, image by image (images.glsl).
std::vector<uint32_t> tableWords(const ImageSet& set) {
    std::vector<uint32_t> words{uint32_t(set.materials().size()), 0, 0, 0};
    std::vector<uint32_t> placeOf;
    auto end = uint32_t(4 + 4 * set.materials().size());
    for (const ImageSet::Image& image : set.images()) {
        placeOf.push_back(image.levels.empty() ? 0 : end);
        end += uint32_t(4 + 4 * image.levels.size());
    }
    for (const MaterialRow& material : set.materials())
        words.insert(words.end(), {placeOf[material.image], material.factor,
                                   uint32_t(material.wrapU) | uint32_t(material.wrapV) << 8, 0});
    uint64_t texels = end;
    for (const ImageSet::Image& image : set.images()) {
        words.insert(words.end(), {image.width, image.height, image.finest, uint32_t(image.levels.size())});
        for (const ImageSet::Level& level : image.levels) {
            words.insert(words.end(), {level.width, level.height, uint32_t(texels), 0});
            texels += level.bytes() / sizeof(uint32_t);
        }
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
    std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(tables))};
    for (const ImageSet::Image& image : images.images())
        for (const ImageSet::Level& level : image.levels)
            parts.push_back({reinterpret_cast<const std::byte*>(level.texels.get()), level.bytes()});
    const uint64_t bytes = parts.front().size() + images.bytes(), most = device.limits().maxStorageBufferRange;
    if (bytes > most)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("{} bytes of images with their tables; this device reads {} at most", bytes, most)};
    return device.createFilled(parts, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
}

}  // namespace vcp
