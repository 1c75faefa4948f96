// Cells that triangles meet, against the test of one box at a time.
#include "builder/page/cell_overlap.h"

#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr double kMargin = 0.125;

/// Corners on the lattice of 1/2048, or on whole and half cells, so that walls are touched all the time.
Triangle3 randomTriangle(uint64_t seed) {
    std::mt19937_64 random(seed);
    const double steps = seed % 2 ? 2048 : 2;
    const int reach = int((seed % 3 == 0 ? 6 : 1.5) * steps);
    std::uniform_int_distribution<int> step(-reach, reach);
    Triangle3 t;
    for (glm::dvec3& corner : t) corner = glm::dvec3(step(random), step(random), step(random)) / steps;
    return t;
}

TEST(CellOverlap, AgreesWithBoxOverlap) {
    size_t near = 0, touching = 0, none = 0;
    for (uint64_t seed = 0; seed < 4000; ++seed) {
        const Triangle3 t = randomTriangle(seed);
        if (glm::cross(t[1] - t[0], t[2] - t[0]) == glm::dvec3(0)) continue;
        const BoxOverlap boxes(t);
        const CellOverlap overlap(t, kMargin);
        std::vector<uint8_t> cells;
        overlap.classify(overlap.lower(), overlap.upper(), cells);
        size_t i = 0;
        for (int z = overlap.lower().z; z <= overlap.upper().z; ++z)
            for (int y = overlap.lower().y; y <= overlap.upper().y; ++y)
                for (int x = overlap.lower().x; x <= overlap.upper().x; ++x, ++i) {
                    const glm::dvec3 centre = glm::dvec3(x, y, z) + 0.5;
                    const int want = boxes.test(centre, 0.5)             ? CellOverlap::kTouches
                                     : boxes.test(centre, 0.5 + kMargin) ? CellOverlap::kNear
                                                                         : 0;
                    ASSERT_EQ(int(cells[i]), want) << "seed " << seed << " cell " << x << ' ' << y << ' ' << z;
                    touching += want == CellOverlap::kTouches;
                    near += want == CellOverlap::kNear;
                    none += want == 0;
                }
        ASSERT_EQ(i, cells.size());
    }
    EXPECT_GT(touching, 10000u);
    EXPECT_GT(near, 5000u);
    EXPECT_GT(none, 10000u);
}

TEST(CellOverlap, NothingTouchesOutsideItsRange) {
    for (uint64_t seed = 0; seed < 500; ++seed) {
        const Triangle3 t = randomTriangle(seed);
        const BoxOverlap boxes(t);
        const CellOverlap overlap(t, kMargin);
        const glm::ivec3 low = overlap.lower() - 1, high = overlap.upper() + 1;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    const bool within = x > low.x && y > low.y && z > low.z && x < high.x && y < high.y && z < high.z;
                    ASSERT_TRUE(within || !boxes.test(glm::dvec3(x, y, z) + 0.5, 0.5)) << "seed " << seed;
                }
    }
}

TEST(CellOverlap, PartOfTheRange) {
    for (uint64_t seed = 0; seed < 500; ++seed) {
        const CellOverlap overlap(randomTriangle(seed), kMargin);
        std::vector<uint8_t> all, part;
        overlap.classify(overlap.lower(), overlap.upper(), all);
        const glm::ivec3 size = overlap.upper() - overlap.lower() + 1, low = overlap.lower() + size / 3;
        overlap.classify(low, overlap.upper(), part);
        size_t i = 0;
        for (int z = low.z; z <= overlap.upper().z; ++z)
            for (int y = low.y; y <= overlap.upper().y; ++y)
                for (int x = low.x; x <= overlap.upper().x; ++x, ++i) {
                    const glm::ivec3 at = glm::ivec3(x, y, z) - overlap.lower();
                    ASSERT_EQ(part[i], all[size_t(at.x + size.x * (at.y + size.y * at.z))]) << "seed " << seed;
                }
    }
}

}  // namespace
}  // namespace vcp
