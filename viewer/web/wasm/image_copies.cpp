#include "viewer/web/wasm/image_copies.h"

#include <algorithm>

namespace vcp {

std::vector<LevelRecord> levelsNeeded(const Residency& residency, const SelectionView& view,
                                      std::span<const CutRecord> pages) {
    std::vector<LevelRecord> needed;
    const auto shown = residency.images();
    if (!shown || shown->bytes() == 0) return needed;
    std::vector<uint64_t> numbers;
    for (const CutRecord& page : pages) numbers.push_back(page.number);
    const std::vector<uint32_t> finest = residency.finestOn(view, numbers);
    for (uint32_t i = 0; i < finest.size(); ++i) {
        const ImageSet::Image& image = shown->images()[i];
        const auto levels = image.finest + uint32_t(image.levels.size());
        for (uint32_t level = levels; level-- > std::max(finest[i], image.finest);) {
            const ImageSet::Level& there = image.levels[level - image.finest];
            needed.push_back({i, level, uint32_t(there.bytes()), uint32_t(uintptr_t(there.texels.get()))});
        }
    }
    return needed;
}

std::byte* ImageCopies::room(uint32_t image, uint32_t level) {
    const ImageLevel size = levelsOf(tables_.images[image])[level];
    const std::shared_ptr<uint32_t[]> texels(new uint32_t[size.texels()]);
    levels_[{image, level}] = {size.width, size.height, texels};
    return reinterpret_cast<std::byte*>(texels.get());
}

Result<std::shared_ptr<const ImageSet>> ImageCopies::setOf(std::span<const LevelRecord> records) const {
    ImageSet set(tables_);
    for (const auto& [image, number, bytes, address] : records) {
        const auto copy = levels_.find({image, number});
        if (copy == levels_.end())
            return Error{.code = ErrorCode::Usage, .message = "a level of an image was not copied"};
        set.add(image, copy->second);
    }
    return std::make_shared<const ImageSet>(std::move(set));
}

}  // namespace vcp
