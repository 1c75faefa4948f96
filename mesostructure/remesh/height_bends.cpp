#include "mesostructure/remesh/height_bends.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <glm/common.hpp>

namespace vcp::meso {

namespace {

constexpr int kLog2Block = 1;

int halfOf(int size) { return (size + 1) / 2; }

}  // namespace

HeightBends::HeightBends(const HeightLevels& levels) : texels_(levels.texels()), mapSize_(levels.levels()[0].size) {
    const HeightLevel& map = levels.levels().front();
    const int block = 1 << kLog2Block;
    Level finest{(mapSize_ + (block - 1)) / block, {}};
    finest.most.assign(size_t(finest.size.x) * size_t(finest.size.y), 0);
    // What lies beyond a border may have nothing to do with what lies within.
    for (int j = 1; j + 1 < mapSize_.y; ++j) {
        const uint16_t *row = &map.texels[size_t(map.size.x) * size_t(j)], *below = row - map.size.x,
                       *above = row + map.size.x;
        for (int i = 1; i + 1 < mapSize_.x; ++i) {
            const int twice = 2 * row[i],
                      bend = std::max(std::abs(row[i - 1] + row[i + 1] - twice), std::abs(below[i] + above[i] - twice));
            uint16_t& most = finest.most[size_t(i / block) + size_t(finest.size.x) * size_t(j / block)];
            most = uint16_t(std::max(int(most), std::min(bend, 65535)));
        }
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

double HeightBends::along(glm::vec2 a, glm::vec2 b) const {
    const glm::dvec2 from = glm::dvec2(a) * texels_, to = glm::dvec2(b) * texels_;
    const double around = 0.5 * glm::length(to - from);
    const glm::dvec2 low = glm::min(from, to) - around, high = glm::max(from, to) + around;
    // Some four blocks along each axis are looked at.
    const int log2 =
        std::clamp(int(std::floor(std::log2(std::max(around, 1.0)))), kLog2Block, kLog2Block + int(levels_.size()) - 1);
    const Level& level = levels_[size_t(log2 - kLog2Block)];
    const int block = 1 << log2;
    const glm::ivec2 first(glm::floor(low / double(block))), last(glm::floor(high / double(block)));
    uint16_t most = 0;
    for (int j = first.y; j <= last.y; ++j)
        for (int i = first.x; i <= last.x; ++i) {
            const int x = wrapped(i * block, mapSize_.x) / block, y = wrapped(j * block, mapSize_.y) / block;
            most = std::max(most, level.most[size_t(x) + size_t(level.size.x) * size_t(y)]);
        }
    return most / 65535.0;
}

}  // namespace vcp::meso
