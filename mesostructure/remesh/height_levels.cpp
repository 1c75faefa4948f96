#include "mesostructure/remesh/height_levels.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>

namespace vcp::meso {

Result<HeightLevels> HeightLevels::build(const HeightMap& map, const LevelFitOptions& options) {
    if (map.size.x < 1 || map.size.y < 1 || map.texels.size() != size_t(map.size.x) * size_t(map.size.y))
        return Error{.message = fmt::format("a height map of {} x {} texels with {} heights", map.size.x, map.size.y,
                                            map.texels.size())};
    if (!(map.range > 0) || !std::isfinite(map.range))
        return Error{.message = "the range of the heights must be above 0"};
    HeightLevels made;
    made.rows_ = map.extent().y;
    HeightLevel finest{map.size, std::vector<float>(map.texels.size())};
    for (size_t i = 0; i < map.texels.size(); ++i) finest.heights[i] = float(map.texels[i] / 65535.0);
    made.levels_.push_back(std::move(finest));
    made.volumes_.emplace_back();
    while (made.levels_.back().size != glm::ivec2(1) && int(made.levels_.size()) < options.mostLevels) {
        const glm::ivec2 below = made.levels_.back().size, size(std::max(below.x / 2, 1), std::max(below.y / 2, 1));
        LevelVolume volume;
        HeightLevel level = fitLevel(made.levels_.front(), size, options, volume);
        made.levels_.push_back(std::move(level));
        made.volumes_.push_back(volume);
    }
    made.addRanges();
    return made;
}

uint64_t HeightLevels::bytes() const {
    uint64_t sum = 0;
    for (const HeightLevel& level : levels_) sum += level.heights.size() * sizeof(float);
    for (const Blocks& blocks : blocks_) sum += blocks.ranges.size() * sizeof(HeightRange);
    return sum;
}

void HeightLevels::addRanges() {
    const HeightLevel& map = levels_.front();
    Blocks finest{map.size, std::vector<HeightRange>(map.heights.size())};
    for (int j = 0; j < map.size.y; ++j)
        for (int i = 0; i < map.size.x; ++i) {
            const auto [least, most] =
                std::minmax({map.at(i, j), map.at(i + 1, j), map.at(i, j + 1), map.at(i + 1, j + 1)});
            finest.ranges[size_t(i) + size_t(map.size.x) * size_t(j)] = {least, most};
        }
    blocks_.push_back(std::move(finest));
    while (blocks_.back().size != glm::ivec2(1)) {
        const Blocks& below = blocks_.back();
        Blocks made{{(below.size.x + 1) / 2, (below.size.y + 1) / 2}, {}};
        for (int j = 0; j < made.size.y; ++j)
            for (int i = 0; i < made.size.x; ++i) {
                HeightRange range{1, 0};
                for (int y = 2 * j; y < std::min(2 * j + 2, below.size.y); ++y)
                    for (int x = 2 * i; x < std::min(2 * i + 2, below.size.x); ++x) {
                        const HeightRange& from = below.ranges[size_t(x) + size_t(below.size.x) * size_t(y)];
                        range = {std::min(range.least, from.least), std::max(range.most, from.most)};
                    }
                made.ranges.push_back(range);
            }
        blocks_.push_back(std::move(made));
    }
}

HeightRange HeightLevels::range(glm::dvec2 low, glm::dvec2 high) const {
    const glm::ivec2 size = levels_.front().size;
    const glm::dvec2 texels(size.x, size.y / rows_);
    // A box that is a texel wider also holds what rounding moves over its border.
    const glm::dvec2 first = glm::floor(low * texels - 1e-3), last = glm::floor(high * texels + 1e-3);
    const double widest = std::max(last.x - first.x, last.y - first.y) + 1;
    if (!(widest < std::max(size.x, size.y))) return blocks_.back().ranges.front();
    size_t level = 0;
    while ((1 << level) < widest) ++level;
    level = std::min(level, blocks_.size() - 1);
    const Blocks& blocks = blocks_[level];
    HeightRange range{1, 0};
    const auto next = [&](int i, int n) {  // the first cell of the block after a cell's
        const int at = wrapped(i, n), end = std::min(((at >> level) + 1) << level, n);
        return i + end - at;
    };
    for (int j = int(first.y); j <= int(last.y); j = next(j, size.y))
        for (int i = int(first.x); i <= int(last.x); i = next(i, size.x)) {
            const HeightRange& from = blocks.ranges[size_t(wrapped(i, size.x) >> level) +
                                                    size_t(blocks.size.x) * size_t(wrapped(j, size.y) >> level)];
            range = {std::min(range.least, from.least), std::max(range.most, from.most)};
        }
    return range;
}

}  // namespace vcp::meso
