#include "mesostructure/remesh/height_bends.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <glm/common.hpp>

namespace vcp::meso {

namespace {

constexpr int kLog2Finest = 1;
constexpr double kMostKept = 1 << 22;  // blocks of the smallest edge

int halfOf(int size) { return (size + 1) / 2; }

int keptBlock(glm::ivec2 size) {
    int log2 = kLog2Finest;
    while (double(size.x) * size.y > kMostKept * std::exp2(2 * log2)) ++log2;
    return log2;
}

/// Returns by how much the slope changes at a texel. What lies beyond a border may have nothing to do with what lies
/// within: there it is 0.
int bendAt(const HeightLevel& map, int x, int y) {
    if (x < 1 || y < 1 || x + 1 >= map.size.x || y + 1 >= map.size.y) return 0;
    const uint16_t *row = &map.texels[size_t(map.size.x) * size_t(y)], *below = row - map.size.x,
                   *above = row + map.size.x;
    const int twice = 2 * row[x],
              bend = std::max(std::abs(row[x - 1] + row[x + 1] - twice), std::abs(below[x] + above[x] - twice));
    return std::min(bend, 65535);
}

}  // namespace

HeightBends::HeightBends(const HeightLevels& levels)
    : map_(levels.levels().front()), texels_(levels.texels()), log2Block_(keptBlock(map_.size)) {
    constexpr int kLetGo = 64;  // rows
    const int block = 1 << log2Block_;
    Level finest{(map_.size + (block - 1)) / block, {}};
    finest.most.assign(size_t(finest.size.x) * size_t(finest.size.y), 0);
    for (int y = 0; y < map_.size.y; ++y) {
        for (int x = 0; x < map_.size.x; ++x) {
            uint16_t& most = finest.most[size_t(x / block) + size_t(finest.size.x) * size_t(y / block)];
            most = uint16_t(std::max(int(most), bendAt(map_, x, y)));
        }
        if (y % kLetGo == 0) map_.texels.letGo();
    }
    levels_.push_back(std::move(finest));
    while (levels_.back().size != glm::ivec2(1)) {
        const Level& below = levels_.back();
        Level made{{halfOf(below.size.x), halfOf(below.size.y)}, {}};
        made.most.assign(size_t(made.size.x) * size_t(made.size.y), 0);
        for (int j = 0; j < below.size.y; ++j)
            for (int i = 0; i < below.size.x; ++i) {
                uint16_t& most = made.most[size_t(i / 2) + size_t(made.size.x) * size_t(j / 2)];
                most = std::max(most, below.most[size_t(i) + size_t(below.size.x) * size_t(j)]);
            }
        levels_.push_back(std::move(made));
    }
}

uint16_t HeightBends::mostIn(glm::ivec2 block, int log2) const {
    if (log2 >= log2Block_) {
        const Level& level = levels_[size_t(log2 - log2Block_)];
        return level.most[size_t(block.x) + size_t(level.size.x) * size_t(block.y)];
    }
    const glm::ivec2 first = block << log2, end = glm::min((block + 1) << log2, map_.size);
    int most = 0;
    for (int y = first.y; y < end.y; ++y)
        for (int x = first.x; x < end.x; ++x) most = std::max(most, bendAt(map_, x, y));
    return uint16_t(most);
}

double HeightBends::along(glm::vec2 a, glm::vec2 b) const {
    const glm::dvec2 from = glm::dvec2(a) * texels_, to = glm::dvec2(b) * texels_;
    const double around = 0.5 * glm::length(to - from);
    const glm::dvec2 low = glm::min(from, to) - around, high = glm::max(from, to) + around;
    // Some four blocks along each axis are looked at.
    const int log2 = std::clamp(int(std::floor(std::log2(std::max(around, 1.0)))), kLog2Finest,
                                log2Block_ + int(levels_.size()) - 1);
    const int block = 1 << log2;
    const glm::ivec2 first(glm::floor(low / double(block))), last(glm::floor(high / double(block)));
    uint16_t most = 0;
    for (int j = first.y; j <= last.y; ++j)
        for (int i = first.x; i <= last.x; ++i)
            most = std::max(
                most, mostIn({wrapped(i * block, map_.size.x) / block, wrapped(j * block, map_.size.y) / block}, log2));
    return most / 65535.0;
}

}  // namespace vcp::meso
