// Whole builds of meshes with masks: rays hit where bilinear alpha says, the bytes do not depend on threads, memory and
// parts, and what measures sees the same mesh.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "builder/build.h"
#include "builder/estimate.h"
#include "builder/measure/indexed_mesh.h"
#include "octree/reference_caster.h"
#include "tests/support/build_in_parts.h"
#include "tests/support/mesh_files.h"
#include "tests/support/png_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

/// A square of 2 x 2 about the origin, in two triangles, whose image is shown twice along x. Each image is a disc of
/// radius 22 about (30, 34), of 64 x 64 texels.
class MaskBuild : public ::testing::Test {
protected:
    static constexpr double kRepeats = 2, kTexels = 64, kRadius = 22;

    void SetUp() override { write("map_Kd leaf.png\n", 6); }
    /// `type`: of the PNG; 6 has alpha.
    void write(const std::string& mtl, int type) const {
        std::string rows;
        for (int y = 0; y < 64; ++y) {
            rows += '\0';
            for (int x = 0; x < 64; ++x) {
                const double inside = kRadius - std::hypot(x + 0.5 - 30, y + 0.5 - 34);
                rows += "\x20\x90\x30";
                if (type == 6) rows += char(uint8_t(std::clamp(127.5 + 127.5 * inside, 0.0, 255.0)));
            }
        }
        std::ofstream(folder_ / "leaf.png", std::ios::binary) << test::pngFile(64, 64, 8, type, rows);
        std::ofstream(folder_ / "leaf.mtl") << "newmtl leaf\n" << mtl;
        std::ofstream(folder_ / "leaf.obj") << "mtllib leaf.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
                                               "vt 0 0\nvt 2 0\nvt 2 1\nvt 0 1\nusemtl leaf\n"
                                               "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    }
    [[nodiscard]] BuildOptions options() const {
        BuildOptions o;
        o.inputs = {folder_ / "leaf.obj"};
        o.output = folder_ / "leaf.vcp";
        o.threads = 2;
        o.cell = 0.02;
        o.overwrite = true;
        return o;
    }
    BuildReport build(const BuildOptions& o) const {
        const auto report = buildOctree(o);
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? *report : BuildReport();
    }
    [[nodiscard]] std::string bytesOf(const BuildOptions& o) const {
        build(o);
        return contentOf(o.output);
    }
    /// How far a point of the square lies inside of a disc, in texels; negative outside.
    static double insideOf(double x, double y) {
        const double u = std::fmod((x + 1) / 2 * kRepeats * kTexels, kTexels), v = (1 - (y + 1) / 2) * kTexels;
        return kRadius - std::hypot(u - 30, v - 34);
    }

    TestFolder folder_{"vcp_mask_build"};
};

TEST_F(MaskBuild, RaysHitWhereAlphaIsAboveTheCutoff) {
    const BuildReport report = build(options());
    EXPECT_EQ(report.cutTriangles, 2u);
    EXPECT_GT(report.triangles, 20u);
    auto cache = PageCache::open(folder_ / "leaf.vcp");
    ASSERT_TRUE(cache.ok() && cache->loadAll().ok());
    const auto cut = cutAtLevel(cache->dataset(), cache->dataset().header.levels - 1);
    const auto caster = ReferenceCaster::create(*cache, cut);
    ASSERT_TRUE(caster.ok());
    int hits = 0, sure = 0;
    for (int j = 0; j < 150; ++j)
        for (int i = 0; i < 150; ++i) {
            const double x = -1 + (i + 0.37) / 75, y = -1 + (j + 0.61) / 75, inside = insideOf(x, y);
            const bool isHit = caster->cast({.origin = {x, y, 1}, .direction = {0, 0, -1}}).has_value();
            hits += isHit;
            // What an outline may be off, and what a bilinear disc is off a round one.
            if (std::abs(inside) < 1.6) continue;
            ++sure;
            EXPECT_EQ(isHit, inside > 0) << x << ' ' << y;
        }
    EXPECT_GT(sure, 18000);
    EXPECT_NEAR(hits / 22500.0, 3.14159265 * kRadius * kRadius / kTexels / kTexels, 0.03);
}

TEST_F(MaskBuild, ThreadsMemoryAndPartsDoNotMatter) {
    BuildOptions o = options();
    const std::string bytes = bytesOf(o);
    o.threads = 1;
    EXPECT_EQ(bytesOf(o), bytes);
    o.threads = 4;
    o.memoryBytes = uint64_t{200} << 20;
    EXPECT_EQ(bytesOf(o), bytes);
    fs::remove(o.output);
    o.memoryBytes = uint64_t{600} << 20;
    test::buildInParts(o, 3);
    EXPECT_EQ(contentOf(o.output), bytes);
}

TEST_F(MaskBuild, TrianglesStayWholeWithoutMasksAndOnDemand) {
    BuildOptions o = options();
    o.masks = false;
    EXPECT_EQ(build(o).triangles, 2u);
    write("map_Kd leaf.png\n", 2);
    const std::string without = bytesOf(o);
    o.masks = true;
    EXPECT_EQ(bytesOf(o), without);
    EXPECT_EQ(build(o).cutTriangles, 0u);
    write("map_Kd leaf.png\nd 0.3\n", 2);
    EXPECT_EQ(bytesOf(o), without) << "d alone does not cut";
}

TEST_F(MaskBuild, ColourIsNotNeeded) {
    BuildOptions o = options();
    o.colour = ColourChoice::None;
    EXPECT_EQ(build(o).cutTriangles, 2u);
}

TEST_F(MaskBuild, AnImageThatIsMissingOrBrokenKeepsThemWhole) {
    write("map_Kd other.png\n", 6);
    EXPECT_EQ(build(options()).triangles, 2u);
    write("map_Kd leaf.png\n", 6);
    fs::resize_file(folder_ / "leaf.png", 200);
    const BuildReport report = build(options());
    EXPECT_EQ(report.triangles, 2u);
    const auto isOfMask = [](const std::string& line) { return line.ends_with("material 'leaf' is not cut"); };
    EXPECT_EQ(std::ranges::count_if(report.warnings, isOfMask), 1);
}

TEST_F(MaskBuild, NothingLeftIsAnError) {
    // A corner of the image, outside of the disc.
    write("map_Kd leaf.png\nmap_d -s 0.01 0.01 -o 0.9 0.9 leaf.png\n", 6);
    const auto report = buildOctree(options());
    ASSERT_FALSE(report.ok());
    EXPECT_NE(report.error().line().find("masks cut out"), std::string::npos) << report.error().line();
}

TEST_F(MaskBuild, WhatMeasuresAndEstimatesSeesTheSame) {
    const BuildReport report = build(options());
    const auto mesh = loadMesh(folder_ / "leaf.obj");
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(mesh->triangles.size(), report.triangles);
    double area = 0;
    for (size_t t = 0; t < mesh->triangles.size(); ++t) {
        const auto c = mesh->corners(t);
        area += glm::length(glm::cross(c[1] - c[0], c[2] - c[0])) / 2;
    }
    const double texel = 2.0 / kTexels / kTexels * 2.0 / kRepeats;
    const double disc = 2 * 3.14159265 * kRadius * kRadius * texel;
    EXPECT_NEAR(area, disc, 0.05 * disc);
    const auto estimate = estimateBuild(options());
    ASSERT_TRUE(estimate.ok());
    EXPECT_EQ(estimate->measures.triangles, report.triangles);
    EXPECT_NEAR(estimate->measures.area, area, 1e-9);
    EXPECT_EQ(loadMesh(folder_ / "leaf.obj", {.masks = false})->triangles.size(), 2u);
}

}  // namespace
}  // namespace vcp
