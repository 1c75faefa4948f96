#include "mesostructure/compressed_map.h"

#include <algorithm>

#include <glm/common.hpp>

namespace vcp::meso {

namespace {

/// Returns the value that covers `edge` cells from `lower`: the least length of a cone, or kOccupied where a cell is
/// occupied.
uint8_t leastOf(const DistanceMap& map, int cone, glm::ivec3 lower, int edge) {
    uint8_t least = kMostSteps;
    const glm::ivec3 upper = glm::min(lower + edge, map.grid.cells);
    for (int z = lower.z; z < upper.z; ++z)
        for (int y = lower.y; y < upper.y; ++y)
            for (int x = lower.x; x < upper.x; ++x) {
                const uint8_t step = map.steps[map.slot(cone, {x, y, z})];
                if (step == kOccupied) return kOccupied;
                least = std::min(least, step);
            }
    return least;
}

/// Returns the lowest cells of a level's entries; bricks come in the order of the entries above that have surface.
std::vector<glm::ivec3> cornersOfBricks(const std::vector<glm::ivec3>& above, const CompressedMap::Level& upper,
                                        int edge, int factor) {
    std::vector<glm::ivec3> corners;
    for (uint32_t i = 0; i < upper.entries; ++i) {
        if ((upper.blocks[i] & CompressedMap::kBrick) == 0) continue;
        for (int k = 0; k < factor * factor * factor; ++k)
            corners.push_back(above[i] + edge * glm::ivec3(k % factor, k / factor % factor, k / factor / factor));
    }
    return corners;
}

void fill(CompressedMap::Level& level, const DistanceMap& map, const std::vector<glm::ivec3>& corners) {
    level.entries = uint32_t(corners.size());
    for (int cone = 0; cone < map.cones.count(); ++cone) {
        uint32_t bricks = 0;
        for (const glm::ivec3 corner : corners) {
            const uint8_t least = leastOf(map, cone, corner, level.edge);
            if (level.edge == 1)
                level.steps.push_back(least);
            else
                level.blocks.push_back(least == kOccupied ? CompressedMap::kBrick | bricks++ : least);
        }
    }
}

}  // namespace

uint64_t CompressedMap::bytes() const {
    uint64_t sum = 0;
    for (const Level& level : levels) sum += level.steps.size() + level.blocks.size() * 4;
    return sum;
}

double CompressedMap::texelRatio() const {
    double texels = 0;
    for (const Level& level : levels) texels += level.entries;
    return double(grid.count()) / texels;
}

Result<CompressedMap> compressMap(const DistanceMap& map, std::span<const int> factors) {
    int edge = 1;
    for (const int factor : factors) edge = factor >= 2 && factor <= 16 && edge <= 64 ? edge * factor : 1 << 20;
    if (factors.empty() || edge > 64)
        return Error{.code = ErrorCode::Usage,
                     .message = "block sizes must be from 2 to 16 each, and at most 64 cells together"};
    CompressedMap result{map.grid, map.cones, map.unit, (map.grid.cells + edge - 1) / edge, {}};
    std::vector<glm::ivec3> corners;
    for (int z = 0; z < result.top.z; ++z)
        for (int y = 0; y < result.top.y; ++y)
            for (int x = 0; x < result.top.x; ++x) corners.push_back(edge * glm::ivec3(x, y, z));
    result.levels.resize(factors.size() + 1);
    result.levels[0].edge = edge;
    fill(result.levels[0], map, corners);
    for (size_t i = 1; i < result.levels.size(); ++i) {
        CompressedMap::Level& level = result.levels[i];
        level.factor = factors[i - 1];
        level.edge = result.levels[i - 1].edge / level.factor;
        corners = cornersOfBricks(corners, result.levels[i - 1], level.edge, level.factor);
        fill(level, map, corners);
    }
    return result;
}

}  // namespace vcp::meso
