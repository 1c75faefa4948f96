// The colours of a file measured against the mesh's (vcp verify --against), on meshes whose colours are known.
#include "builder/measure/hit_colour.h"

#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "builder/build.h"
#include "builder/measure/surface_distance.h"
#include "builder/stream/colour_difference.h"
#include "builder/stream/colour_encoding.h"
#include "octree/image/image_assembly.h"
#include "tests/support/test_folder.h"
#include "tests/support/textured_walls.h"

namespace vcp {
namespace {

TEST(CornerWeights, BlendTheCornersToThePoint) {
    const glm::dvec3 a(1, 2, 3), b(4, 2, -1), c(0, 7, 2);
    for (const glm::dvec3 w : {glm::dvec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {0.2, 0.3, 0.5}, {1.5, -0.25, -0.25}}) {
        const glm::dvec3 found = cornerWeights(w.x * a + w.y * b + w.z * c, a, b, c);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], w[i], 1e-12);
    }
    EXPECT_EQ(cornerWeights(a, b, b, b), glm::dvec3(1, 0, 0)) << "no area";
}

class ColoursOfAFile : public testing::Test {
protected:
    ColoursOfAFile() : folder_("vcp_hit_colour_test") {}

    /// A square of `quads` x `quads` whose vertices have the colours of a slope, or `shift` more red than that.
    [[nodiscard]] std::filesystem::path writeSlope(const char* name, int quads, int shift) const {
        const auto path = folder_ / name;
        std::ofstream ply(path);
        ply << "ply\nformat ascii 1.0\nelement vertex " << (quads + 1) * (quads + 1)
            << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
               "property uchar blue\nelement face "
            << 2 * quads * quads << "\nproperty list uchar int vertex_indices\nend_header\n";
        for (int j = 0; j <= quads; ++j)
            for (int i = 0; i <= quads; ++i)
                ply << fmt::format("{} {} {} {} {} {}\n", i, j, 0.02 * i * j, 40 + 160 * i / quads + shift,
                                   200 - 160 * j / quads, 90);
        for (int j = 0; j < quads; ++j)
            for (int i = 0; i < quads; ++i) {
                const int at = j * (quads + 1) + i;
                ply << fmt::format("3 {} {} {}\n3 {} {} {}\n", at, at + 1, at + quads + 2, at, at + quads + 2,
                                   at + quads + 1);
            }
        return path;
    }

    [[nodiscard]] PageCache build(const std::filesystem::path& mesh, double cell = 0) const {
        BuildOptions options;
        options.inputs = {mesh};
        options.output = folder_ / "out.vcp";
        options.cell = cell;
        const auto built = buildOctree(options);
        EXPECT_TRUE(built.ok()) << built.error().line();
        auto cache = PageCache::open(options.output);
        EXPECT_TRUE(cache.ok());
        EXPECT_TRUE(cache->loadAll().ok());
        return std::move(*cache);
    }

    /// Measures a level against a mesh's file.
    static SurfaceDistance measured(const PageCache& cache, const std::filesystem::path& path, uint32_t level,
                                    unsigned threads = 2, const ImageSet* images = nullptr) {
        MeshPaint paint;
        LoadOptions load;
        load.chunk = [&](size_t file, const MeshStream& stream, const MeshChunk& chunk) {
            paint.add(file, stream, chunk);
        };
        const auto mesh = loadMesh(path, load);
        EXPECT_TRUE(mesh.ok());
        paint.loadImages();
        const MeshBvh bvh(*mesh);
        SurfaceDistanceOptions options;
        options.samples = 4000;
        options.threads = threads;
        options.level = level;
        options.paint = &paint;
        options.images = images;
        const auto result = measureSurfaceDistance(cache, bvh, options);
        EXPECT_TRUE(result.ok()) << result.error().line();
        return *result;
    }

    TestFolder folder_;
};

TEST_F(ColoursOfAFile, TheFinestLevelHasTheMeshsOwn) {
    const auto mesh = writeSlope("slope.ply", 60, 0);
    const PageCache cache = build(mesh, 0.25);
    const SurfaceDistance d = measured(cache, mesh, UINT32_MAX);
    EXPECT_GT(d.colourSamples, 1000u);
    EXPECT_LT(d.colourDifference.max, 0.5);
    // A coarser level's slabs have one colour each: as far off as the slope changes over half of one.
    ASSERT_GT(cache.dataset().header.levels, 1u);
    const SurfaceDistance coarse = measured(cache, mesh, 0);
    EXPECT_GT(coarse.colourDifference.p95, d.colourDifference.p95);
    EXPECT_LT(coarse.colourDifference.max, 25);
}

TEST_F(ColoursOfAFile, AShiftIsMeasured) {
    const PageCache cache = build(writeSlope("slope.ply", 30, 0));
    const SurfaceDistance d = measured(cache, writeSlope("shifted.ply", 30, 30), UINT32_MAX);
    const auto light = [](int r, int g, int b) {
        return glm::dvec3(lightOfByte()[size_t(r)], lightOfByte()[size_t(g)], lightOfByte()[size_t(b)]);
    };
    double least = 100, most = 0;
    for (int r = 40; r <= 200; r += 10)
        for (int g = 40; g <= 200; g += 10) {
            const double shift = colourDifference(light(r, g, 90), light(r + 30, g, 90));
            least = std::min(least, shift);
            most = std::max(most, shift);
        }
    EXPECT_GT(d.colourDifference.p50, least);
    EXPECT_LT(d.colourDifference.max, most + 0.5);
    EXPECT_GT(d.colourDifference.max, (least + most) / 2);
}

TEST_F(ColoursOfAFile, ImagesAreMeasuredAtTheirFinestTexels) {
    const auto noise = [](uint32_t x, uint32_t y) { return (x * 37 + y * 91) % 256 | ((x * 7) ^ (y * 5)) % 256 << 8; };
    test::TexturedWalls::write(folder_.path(), noise, noise);
    const auto mesh = folder_ / "walls.obj";
    const PageCache cache = build(mesh, 0.2);
    ASSERT_TRUE(cache.dataset().hasImages());
    const auto file = openFile(folder_ / "out.vcp");
    const auto images = readAllImages(**file, cache.dataset().header.images);
    ASSERT_TRUE(images.ok());
    const SurfaceDistance seen = measured(cache, mesh, UINT32_MAX, 2, &*images);
    EXPECT_GT(seen.colourSamples, 1000u);
    EXPECT_LT(seen.colourDifference.p95, 0.5) << "coordinates are kept to 1/32 texel";
    EXPECT_GT(measured(cache, mesh, UINT32_MAX).colourDifference.p50, 5) << "of the vertices' colours";
}

TEST_F(ColoursOfAFile, SameForAnyThreads) {
    const auto mesh = writeSlope("slope.ply", 30, 0);
    const PageCache cache = build(mesh);
    const SurfaceDistance one = measured(cache, mesh, UINT32_MAX, 1), three = measured(cache, mesh, UINT32_MAX, 3);
    EXPECT_EQ(one.colourSamples, three.colourSamples);
    EXPECT_EQ(one.colourDifference.p50, three.colourDifference.p50);
    EXPECT_EQ(one.colourDifference.max, three.colourDifference.max);
}

TEST_F(ColoursOfAFile, WithoutColourThereIsNothingToCompare) {
    const auto path = folder_ / "plain.obj";
    std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.1\nf 1 2 3\nf 2 4 3\n";
    const PageCache cache = build(path);
    EXPECT_EQ(measured(cache, path, UINT32_MAX).colourSamples, 0u);
}

}  // namespace
}  // namespace vcp
