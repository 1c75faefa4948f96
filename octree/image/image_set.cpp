#include "octree/image/image_set.h"

#include <utility>

namespace vcp {

ImageSet::ImageSet(const ImageTables& tables) : materials_(tables.materials) {
    for (const ImageRow& row : tables.images) images_.push_back({row.width, row.height, row.levels, {}});
}

uint64_t ImageSet::bytes() const {
    uint64_t bytes = 0;
    for (const Image& image : images_)
        for (const Level& level : image.levels) bytes += level.bytes();
    return bytes;
}

void ImageSet::add(uint32_t image, Level level) {
    --images_[image].finest;
    images_[image].levels.insert(images_[image].levels.begin(), std::move(level));
}

void ImageSet::drop(uint32_t image, uint32_t finest) {
    while (images_[image].finest < finest) {
        images_[image].levels.erase(images_[image].levels.begin());
        ++images_[image].finest;
    }
}

std::vector<uint32_t> finestWithin(std::span<const ImageRow> images, std::vector<uint32_t> finest,
                                   const std::vector<uint32_t>& coarsest, uint64_t mostBytes) {
    std::vector<std::vector<ImageLevel>> levels;
    uint64_t bytes = 0;
    for (size_t i = 0; i < images.size(); ++i) {
        levels.push_back(levelsOf(images[i]));
        for (size_t l = finest[i]; l < levels.back().size(); ++l) bytes += levels.back()[l].texels() * sizeof(uint32_t);
    }
    // What the finest level of an image takes that may go.
    const auto largest = [&](size_t i) {
        return finest[i] < coarsest[i] ? levels[i][finest[i]].texels() * sizeof(uint32_t) : 0;
    };
    while (bytes > mostBytes) {
        size_t image = 0;
        for (size_t i = 1; i < images.size(); ++i)
            if (largest(i) > largest(image)) image = i;
        if (images.empty() || largest(image) == 0) break;
        bytes -= largest(image);
        ++finest[image];
    }
    return finest;
}

}  // namespace vcp
