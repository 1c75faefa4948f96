#include "mesostructure/remesh/height_levels.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

HeightLevel sampledLevel(const HeightLevel& map, glm::ivec2 size) {
    std::vector<uint16_t> heights;
    for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) {
            const int64_t x = int64_t{i} * map.size.x / size.x, y = int64_t{j} * map.size.y / size.y;
            heights.push_back(map.texels[size_t(x + map.size.x * y)]);
        }
    return {size, std::move(heights)};
}

Result<HeightLevel> levelOf(const std::vector<HeightLevel>& below, glm::ivec2 size, const LevelFitOptions& options,
                            LevelVolume& volume) {
    if (options.fit == LevelFit::Sampled) return sampledLevel(below.front(), size);
    if (options.fit == LevelFit::Averaged) return averagedLevel(below.back(), size, options.store);
    return fitLevel(below.front(), size, options, volume);
}

}  // namespace

Result<HeightLevels> HeightLevels::build(HeightMap map, const LevelFitOptions& options) {
    if (map.size.x < 1 || map.size.y < 1 || map.texels.size() != size_t(map.size.x) * size_t(map.size.y))
        return Error{.message = fmt::format("a height map of {} x {} texels with {} heights", map.size.x, map.size.y,
                                            map.texels.size())};
    if (!(map.range > 0) || !std::isfinite(map.range))
        return Error{.message = "the range of the heights must be above 0"};
    HeightLevels made;
    made.rows_ = map.extent().y;
    made.levels_.push_back({map.size, std::move(map.texels)});
    made.volumes_.emplace_back();
    while (made.levels_.back().size != glm::ivec2(1)) {
        const glm::ivec2 below = made.levels_.back().size, size(std::max(below.x / 2, 1), std::max(below.y / 2, 1));
        LevelVolume volume;
        const bool isUsed = int(made.levels_.size()) < options.mostLevels;
        auto level = isUsed ? levelOf(made.levels_, size, options, volume)
                            : averagedLevel(made.levels_.back(), size, options.store);
        if (!level) return level.error();
        made.levels_.push_back(*std::move(level));
        if (isUsed) made.used_ = int(made.levels_.size());
        made.volumes_.push_back(volume);
    }
    made.letGo();
    return made;
}

void HeightLevels::letGo() const {
    for (const HeightLevel& level : levels_) level.texels.letGo();
}

uint64_t HeightLevels::bytes() const {
    uint64_t sum = 0;
    for (const HeightLevel& level : levels_) sum += level.texels.size() * sizeof(uint16_t);
    return sum;
}

}  // namespace vcp::meso
