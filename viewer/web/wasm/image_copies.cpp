#include "viewer/web/wasm/image_copies.h"

#include <algorithm>

namespace vcp {

std::vector<TileRecord> tilesNeeded(const Residency& residency, const SelectionView& view,
                                    std::span<const CutRecord> pages) {
    std::vector<TileRecord> needed;
    const auto shown = residency.images();
    if (!shown || shown->bytes() == 0) return needed;
    std::vector<uint64_t> numbers;
    for (const CutRecord& page : pages) numbers.push_back(page.number);
    const std::vector<float> needs = residency.needsOn(view, numbers);
    uint32_t first = 0;
    for (uint32_t i = 0; i < shown->images().size(); ++i)
        for (uint32_t l = 0; l < shown->images()[i].levels.size(); ++l) {
            const ImageSet::Level& level = shown->images()[i].levels[l];
            for (uint32_t tile = 0; tile < level.tiles.size(); ++tile) {
                const glm::uvec2 place(tile % level.tilesX, tile / level.tilesX);
                if (level.tiles[tile] && needs[residency.pieces().pieceOf(i, l, place)] > 0)
                    needed.push_back({first + tile, uint32_t(level.texelsOf(tile) * sizeof(uint32_t)),
                                      uint32_t(uintptr_t(level.tiles[tile].get()))});
            }
            first += uint32_t(level.tiles.size());
        }
    return needed;
}

ImageCopies::ImageCopies(const ImageTables& tables) : without_(tables) {
    uint32_t first = 0;
    for (uint32_t i = 0; i < without_.images().size(); ++i)
        for (uint32_t l = 0; l < without_.images()[i].levels.size(); ++l) {
            levels_.push_back({first, i, l});
            first += uint32_t(without_.images()[i].levels[l].tiles.size());
        }
}

const ImageCopies::Level& ImageCopies::levelOf(uint32_t number) const {
    const auto isAfter = [](uint32_t tile, const Level& level) { return tile < level.first; };
    return *(std::upper_bound(levels_.begin(), levels_.end(), number, isAfter) - 1);
}

std::byte* ImageCopies::room(uint32_t number) {
    const auto [first, image, level] = levelOf(number);
    const std::shared_ptr<uint32_t[]> texels(
        new uint32_t[without_.images()[image].levels[level].texelsOf(number - first)]);
    tiles_[number] = texels;
    return reinterpret_cast<std::byte*>(texels.get());
}

Result<std::shared_ptr<const ImageSet>> ImageCopies::setOf(std::span<const TileRecord> records) const {
    ImageSet set = without_;
    for (const TileRecord& record : records) {
        const auto copy = tiles_.find(record.number);
        if (copy == tiles_.end())
            return Error{.code = ErrorCode::Usage, .message = "a tile of an image was not copied"};
        const auto [first, image, level] = levelOf(record.number);
        const uint32_t tilesX = without_.images()[image].levels[level].tilesX;
        set.set(image, level, {(record.number - first) % tilesX, (record.number - first) / tilesX}, copy->second);
    }
    return std::make_shared<const ImageSet>(std::move(set));
}

}  // namespace vcp
