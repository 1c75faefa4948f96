#include "octree/surface/clearance.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(Clearance, IsThatOfTheNearestOccupiedCell) {
    for (uint32_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const int n = 2 << seed % 6;
        const auto any = [&](int below) { return int(random() % unsigned(below)); };
        Clearance clearance(n);
        std::vector<std::pair<glm::ivec3, int>> boxes;
        for (auto i = random() % 4; i > 0; --i) {
            const int edge = 1 << any(2);
            boxes.emplace_back(edge * glm::ivec3(any(n / edge), any(n / edge), any(n / edge)), edge);
            clearance.occupy(boxes.back().first, edge);
        }
        for (int i = 0; i < 200; ++i) {
            const int edge = 1 << any(4);
            if (edge > n) continue;
            const glm::ivec3 lower = edge * glm::ivec3(any(n / edge), any(n / edge), any(n / edge));
            int expected = n;  // cells between the two boxes along the axis that parts them most
            for (const auto& [low, size] : boxes) {
                int gap = -1;
                for (int axis = 0; axis < 3; ++axis)
                    gap = std::max({gap, low[axis] - (lower[axis] + edge), lower[axis] - (low[axis] + size)});
                if (gap >= 0)
                    expected = std::min(expected, gap);
                else
                    expected = std::min(expected, 0);
            }
            ASSERT_EQ(clearance.of(lower, edge), expected);
        }
    }
}

}  // namespace
}  // namespace vcp
