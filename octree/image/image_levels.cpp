#include "octree/image/image_levels.h"

#include <algorithm>

#include <glm/common.hpp>

#include "octree/surface/morton.h"

namespace vcp {

glm::uvec2 ImageLevel::sizeOf(glm::uvec2 tile) const {
    return glm::min(glm::uvec2(width, height) - tile * tileEdge, glm::uvec2(tileEdge));
}

std::vector<ImageLevel> imageLevels(uint32_t width, uint32_t height, uint64_t firstTile, uint32_t tileEdge) {
    std::vector<ImageLevel> levels{{width, height, 0, tileEdge}};
    while (levels.back().width > 1 || levels.back().height > 1)
        levels.push_back({std::max(levels.back().width / 2, 1u), std::max(levels.back().height / 2, 1u), 0, tileEdge});
    for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
        level->firstTile = firstTile;
        firstTile += level->tiles();
    }
    return levels;
}

uint64_t tilesOf(const std::vector<ImageLevel>& levels) {
    uint64_t tiles = 0;
    for (const ImageLevel& level : levels) tiles += level.tiles();
    return tiles;
}

std::vector<glm::uvec2> tileOrder(const ImageLevel& level) {
    std::vector<glm::uvec2> order;
    order.reserve(level.tiles());
    for (uint32_t y = 0; y < level.tilesY(); ++y)
        for (uint32_t x = 0; x < level.tilesX(); ++x) order.emplace_back(x, y);
    std::sort(order.begin(), order.end(), [](glm::uvec2 a, glm::uvec2 b) {
        return mortonEncode({a.x, a.y, 0}) < mortonEncode({b.x, b.y, 0});
    });
    return order;
}

}  // namespace vcp
