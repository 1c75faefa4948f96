// Signed distances whose truth is known, and what is drawn and written of them.
#include "builder/measure/mesh_deviation.h"
#include "tests/support/mesh_reading.h"
#include "tests/viewer/export/exported_mesh.h"
#include "viewer/export/deviation_picture.h"
#include "viewer/export/diverging_colours.h"
#include "viewer/export/surface_mesh.h"

namespace vcp::test {
namespace {

Deviation deviationOf(const IndexedMesh& a, const IndexedMesh& b, const DeviationOptions& options = {}) {
    const DeviationTarget target(b);
    const auto deviation = measureDeviation(a, target, options);
    EXPECT_TRUE(deviation.ok()) << deviation.error().line();
    return deviation.ok() ? *deviation : Deviation{};
}

/// A sheet of triangles that look up.
IndexedMesh sheet(double height, uint32_t n = 12) {
    IndexedMesh mesh;
    for (uint32_t y = 0; y <= n; ++y)
        for (uint32_t x = 0; x <= n; ++x) mesh.positions.emplace_back(double(x) / n, double(y) / n, height);
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = y * (n + 1) + x;
            mesh.triangles.push_back({a, a + 1, a + n + 2});
            mesh.triangles.push_back({a, a + n + 2, a + n + 1});
        }
    return mesh;
}

TEST(Deviation, OfATranslatedPlaneIsTheWay) {
    for (const double way : {0.25, -0.125}) {
        const Deviation d = deviationOf(sheet(way), sheet(0));
        EXPECT_NEAR(d.mean, way, 1e-12);
        EXPECT_NEAR(d.rms, std::abs(way), 1e-12);
        EXPECT_NEAR(d.quantile(0.01), way, 1e-12);
        EXPECT_NEAR(d.quantile(0.99), way, 1e-12);
        EXPECT_NEAR(d.absoluteQuantile(1), std::abs(way), 1e-12);
        EXPECT_EQ(d.withoutCounterpart(), 0u);
    }
}

TEST(Deviation, OfASphereFromALargerOneIsNegative) {
    // The chords of the facets lie within the spheres by up to 1 - cos(pi / 160), 0.0002.
    const IndexedMesh small = sphereMesh({0, 0, 0}, 1, 160), large = sphereMesh({0, 0, 0}, 1.1, 160);
    const Deviation inwards = deviationOf(small, large, {.samples = 20000}),
                    outwards = deviationOf(large, small, {.samples = 20000});
    // Whether the sphere's triangles look outwards decides the sign, not the size.
    EXPECT_NEAR(std::abs(inwards.mean), 0.1, 0.0005);
    EXPECT_NEAR(outwards.mean, -inwards.mean, 0.001);
    const auto c = small.corners(small.triangles.size() / 2);
    const bool looksOut = glm::dot(c[0], glm::cross(c[1] - c[0], c[2] - c[0])) > 0;
    EXPECT_EQ(inwards.mean < 0, looksOut);
    EXPECT_NEAR(inwards.quantile(0.99) - inwards.quantile(0.01), 0, 0.001);
}

TEST(Deviation, DoesNotDependOnThreads) {
    const IndexedMesh a = sphereMesh({0.01, 0, 0}, 1, 30), b = sphereMesh({0, 0, 0}, 1, 40);
    const Deviation one = deviationOf(a, b, {.samples = 5000, .threads = 1}),
                    four = deviationOf(a, b, {.samples = 5000, .threads = 4});
    EXPECT_EQ(one.distances, four.distances);
    EXPECT_EQ(one.mean, four.mean);
}

TEST(Deviation, WhatIsFarAwayHasNoCounterpart) {
    IndexedMesh a = sheet(0.01);
    append(a, sheet(5));
    const Deviation d = deviationOf(a, sheet(0), {.samples = 20000, .within = 0.5});
    EXPECT_NEAR(double(d.withoutCounterpart()) / 20000, 0.5, 0.02);
    EXPECT_NEAR(d.mean, 0.01, 1e-12);
    const IndexedMesh low = sheet(0);
    const DeviationTarget target(low);
    EXPECT_FALSE(measureDeviation(sheet(5), target, {.within = 0.5}).ok());
}

TEST(Deviation, HistogramCountsAll) {
    const IndexedMesh a = sphereMesh({0.02, 0, 0}, 1, 30), b = sphereMesh({0, 0, 0}, 1, 40);
    const Deviation d = deviationOf(a, b, {.samples = 5000});
    for (const double range : {0.005, 0.02, 1.0}) {
        const DeviationHistogram h = histogramOf(d, range, 10);
        uint64_t sum = h.below + h.above;
        for (const uint64_t count : h.counts) sum += count;
        EXPECT_EQ(sum, 5000u);
        EXPECT_EQ(h.below, uint64_t(std::ranges::count_if(d.distances, [&](double x) { return x < -range; })));
    }
}

TEST(Deviation, OfADatasetFromItsMeshIsWhatIsCertified) {
    const ExportedMesh built("deviation", torusMesh({0, 0, 0}, 1, 0.4, 100, 40), {.cell = 0.03});
    for (const uint32_t level : {built.levels() - 1, built.levels() - 2}) {
        const auto surface = loadSurface(built.reader(), built.cut(level), {});
        ASSERT_TRUE(surface.ok());
        EXPECT_LE(deviationOf(surface->mesh, built.mesh(), {.samples = 20000}).absoluteQuantile(1), surface->certified);
        EXPECT_LE(deviationOf(built.mesh(), surface->mesh, {.samples = 20000}).absoluteQuantile(1), surface->certified);
    }
}

TEST(DivergingColours, AreAsLightOnBothSides) {
    const auto luminance = [](glm::dvec3 c) {
        return 0.2126 * std::pow(c.x, 2.2) + 0.7152 * std::pow(c.y, 2.2) + 0.0722 * std::pow(c.z, 2.2);
    };
    double last = luminance(divergingColour(0));
    for (double value = 0.1; value <= 1; value += 0.1) {
        const double below = luminance(divergingColour(-value)), above = luminance(divergingColour(value));
        EXPECT_NEAR(below, above, 0.05) << value;
        EXPECT_LT(std::max(below, above), last) << value;
        last = std::max(below, above);
    }
    EXPECT_GT(divergingColour(1).x, divergingColour(1).z);
    EXPECT_LT(divergingColour(-1).x, divergingColour(-1).z);
    EXPECT_EQ(divergingColour(7), divergingColour(1));
    const glm::dvec3 none = divergingColour(std::nan(""));
    EXPECT_EQ(none.x, none.z);
}

TEST(DeviationPicture, ShowsTheSurfaceInItsColours) {
    const IndexedMesh a = sheet(0.1), b = sheet(0);
    const DeviationTarget target(b);
    const Deviation d = deviationOf(a, b, {.samples = 1000});
    Camera camera;
    camera.eye = {0.5, 0.5, 3};
    camera.forward = {0, 0, -1};
    const MeshBvh surface(a);
    const auto picture =
        drawDeviation(surface, target, d, {.camera = camera, .width = 320, .height = 200, .range = 0.1, .unit = "mm"});
    ASSERT_TRUE(picture.ok());
    const auto at = [&](uint32_t x, uint32_t y) {
        const uint8_t* p = &picture->rgba[4 * (size_t{y} * 320 + x)];
        return glm::ivec3(p[0], p[1], p[2]);
    };
    // The middle of the surface is the upper end of the scale; a corner is background.
    const glm::dvec3 red = 255.0 * divergingColour(1);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(at(80, 100)[c], red[c], 2);
    EXPECT_EQ(at(2, 2), glm::ivec3(255));
    // The scale's bar has both ends, and something is written beside it.
    bool hasBlue = false, hasInk = false;
    for (uint32_t y = 0; y < 200; ++y)
        for (uint32_t x = 320 - scaleWidth(320); x < 320; ++x) {
            hasBlue = hasBlue || (at(x, y).z > 170 && at(x, y).x < 90);
            hasInk = hasInk || (at(x, y).x < 90 && at(x, y).z < 90);
        }
    EXPECT_TRUE(hasBlue);
    EXPECT_TRUE(hasInk);
}

TEST(DeviationMesh, HasDistancesAndColours) {
    const TestFolder folder("vcp_deviation_mesh_test");
    const IndexedMesh a = sheet(0.25);
    const std::vector<float> distances(a.positions.size(), 0.25f);
    ASSERT_TRUE(writeDistances(a, distances, 0.25, folder / "d.ply", {}, {{"unit", "mm"}}).ok());
    const std::string text = contentOf(folder / "d.ply");
    EXPECT_NE(text.find("property float distance\n"), std::string::npos);
    const ReadMesh back = readAll(openMesh(folder / "d.ply"));
    ASSERT_EQ(back.positions.size(), a.positions.size());
    EXPECT_EQ(back.triangles.size(), a.triangles.size());
    const glm::dvec3 red = 255.0 * divergingColour(1);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(double(back.colours[0] >> 8 * c & 255), red[c], 1);
}

}  // namespace
}  // namespace vcp::test
