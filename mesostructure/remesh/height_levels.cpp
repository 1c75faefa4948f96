#include "mesostructure/remesh/height_levels.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

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
    return made;
}

uint64_t HeightLevels::bytes() const {
    uint64_t sum = 0;
    for (const HeightLevel& level : levels_) sum += level.heights.size() * sizeof(float);
    return sum;
}

}  // namespace vcp::meso
