// The sample of a mesh: bounded, of whole cubes, and near to what the whole takes.
#include "builder/build_sample.h"

#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

/// A rough sheet of n x n squares, with noise as a scan has.
std::vector<BuildSample::Triangle> sheet(int n) {
    const auto at = [](int x, int y) {
        std::minstd_rand random(uint32_t(y * 8191 + x + 1));
        random.discard(3);
        const auto noise = [&] { return 0.2 * (double(random()) / double(std::minstd_rand::max()) - 0.5); };
        return glm::dvec3(x + noise(), y + noise(), 3 * std::sin(x * 0.07) * std::cos(y * 0.09) + noise());
    };
    std::vector<BuildSample::Triangle> all;
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            all.push_back({.corner = {at(x, y), at(x + 1, y), at(x, y + 1)}, .colour = {}});
            all.push_back({.corner = {at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)}, .colour = {}});
        }
    return all;
}

TEST(BuildSample, ASmallMeshIsItsOwnSample) {
    BuildSample sample(10000);
    for (const auto& t : sheet(50)) sample.add(t);
    EXPECT_EQ(sample.triangles().size(), 5000u);
}

TEST(BuildSample, IsBoundedAndOfWholeCubes) {
    BuildSample sample(200000);
    const auto all = sheet(1500);
    for (const auto& t : all) {
        sample.add(t);
        ASSERT_LE(sample.triangles().size(), 200000u);
    }
    const size_t held = sample.triangles().size();
    EXPECT_GT(held, 20000u);
    // A triangle inside of a cube has its neighbours there as well.
    std::set<std::pair<double, double>> corners;
    for (const auto& t : sample.triangles()) corners.insert({std::round(t.corner[0].x), std::round(t.corner[0].y)});
    size_t alone = 0;
    for (const auto& [x, y] : corners) alone += !corners.contains({x + 1, y}) && !corners.contains({x - 1, y});
    EXPECT_LT(alone, corners.size() / 20);
}

TEST(BuildSample, FiguresAreNearThoseOfTheWhole) {
    const TestFolder folder("vcp_build_sample_test");
    const auto all = sheet(500);
    BuildSample whole(1000000), part(120000);
    for (const auto& t : all) {
        whole.add(t);
        part.add(t);
    }
    ASSERT_LT(part.triangles().size(), all.size() / 3);
    BuildOptions options;
    options.threads = 2;
    const auto of = buildSample(options, 3, whole, false), foretold = buildSample(options, 3, part, false);
    ASSERT_TRUE(of.ok()) << of.error().line();
    ASSERT_TRUE(foretold.ok()) << foretold.error().line();
    // Cut surfaces weigh more than whole ones.
    EXPECT_GT(foretold->fileBytes, 0.8 * of->fileBytes);
    EXPECT_LT(foretold->fileBytes, 1.6 * of->fileBytes);
    EXPECT_GT(foretold->seconds, 0);
    const auto coloured = buildSample(options, 3, part, true);
    ASSERT_TRUE(coloured.ok()) << coloured.error().line();
    EXPECT_GT(coloured->fileBytes, foretold->fileBytes * 0.99);
}

TEST(BuildSample, IsCancelled) {
    BuildSample sample;
    for (const auto& t : sheet(100)) sample.add(t);
    BuildOptions options;
    options.progress = [](const BuildProgress&) { return false; };
    const auto none = buildSample(options, 3, sample, false);
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace vcp
