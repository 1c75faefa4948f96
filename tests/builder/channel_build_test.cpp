// Files that keep what materials have beside their colour: what is in them, their coarser levels, the same bytes
// however they are built, and what becomes of channels that cannot be read.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "builder/build.h"
#include "octree/dataset_reader.h"
#include "octree/vcp_verify.h"
#include "tests/support/build_in_parts.h"
#include "tests/support/channelled_floor.h"
#include "tests/support/image_file.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using test::ChannelledFloor, test::normalTexel;

class ChannelBuild : public ::testing::Test {
protected:
    static ChannelledFloor wholeFloor() {
        ChannelledFloor floor;
        floor.colour = [](uint32_t x, uint32_t y) { return x * 2 | y * 3 << 8 | 90u << 16; };
        floor.normals = [](uint32_t x, uint32_t) { return normalTexel(x % 2 == 0 ? 0.6 : -0.6, 0, 0.8); };
        floor.surface = [](uint32_t x, uint32_t y) { return (x < 48 ? 20u : 220u) << 8 | (y < 32 ? 255u : 0u) << 16; };
        floor.emission = [](uint32_t x, uint32_t) { return x % 2 == 0 ? 0u : 0xffffffu; };
        floor.normalScale = 0.5;
        floor.roughness = 0.75;
        floor.metalness = 0.25;
        floor.emissionFactor = "0.5,0.25,1";
        return floor;
    }
    [[nodiscard]] BuildOptions options() const {
        BuildOptions o = ChannelledFloor::options(folder_.path());
        o.imageQuality = {.finest = 0, .coarser = 0};
        return o;
    }
    [[nodiscard]] fs::path output() const { return folder_ / "floor.vcp"; }
    [[nodiscard]] std::string built(const BuildOptions& options) const {
        const auto report = buildOctree(options);
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? contentOf(output()) : std::string();
    }
    /// Builds, and returns the tables of images; none where there are no images. Expects so many warnings.
    [[nodiscard]] ImageTables tablesOf(const ChannelledFloor& floor, size_t warnings = 0) const {
        floor.write(folder_.path());
        const auto report = buildOctree(options());
        EXPECT_TRUE(report.ok()) << report.error().line();
        if (!report) return {};
        EXPECT_EQ(report->warnings.size(), warnings);
        for (const std::string& line : report->warnings) EXPECT_EQ(line.find('\n'), std::string::npos);
        const auto file = openFile(output());
        const auto verified = verifyFile(**file);
        EXPECT_TRUE(verified.ok()) << verified.error().line();
        const auto dataset = readDataset(**file);
        return dataset->hasImages() ? *readImageTables(**file, dataset->header.images) : ImageTables();
    }

    TestFolder folder_{"vcp_channel_build"};
};

TEST_F(ChannelBuild, KeepsImagesAndFactors) {
    const ImageTables tables = tablesOf(wholeFloor());
    ASSERT_EQ(tables.images.size(), 4u);
    ASSERT_EQ(tables.channels.size(), 1u);
    const ChannelRow& row = tables.channels[0];
    EXPECT_EQ(row.isGiven, 1u);
    EXPECT_EQ(row.normals, 2u);
    EXPECT_EQ(row.surface, 3u);
    EXPECT_EQ(row.emission, 4u);
    EXPECT_EQ(row.normalScale, 0.5f);
    EXPECT_EQ(row.roughness, 0.75f);
    EXPECT_EQ(row.metalness, 0.25f);
    EXPECT_EQ(row.emissionFactor[1], 0.25f);
    const auto file = openFile(output());
    const auto header = readDataset(**file)->header;
    EXPECT_NE(header.flags & kFlagChannels, 0u);
    const auto set = readAllImages(**file, header.images);
    ASSERT_TRUE(set.ok());
    // Numbers are averaged as they are: two normals that lean apart make a short one. Light is averaged as light.
    const std::vector<uint32_t> normals = test::texelsOf(set->images()[1].levels[1]);
    EXPECT_EQ(normals[5], 0xff000000u | normalTexel(0, 0, 0.8));
    EXPECT_EQ(test::texelsOf(set->images()[2].levels[3])[0] >> 8 & 255u, 20u);
    EXPECT_EQ(test::texelsOf(set->images()[3].levels[1])[0] & 255u, 188u);
}

TEST_F(ChannelBuild, WithoutThemFilesAreAsEver) {
    wholeFloor().write(folder_.path());
    BuildOptions without = options();
    without.channels = false;
    const std::string plain = built(without);
    EXPECT_FALSE(built(options()) == plain);
    ChannelledFloor bare = wholeFloor();
    bare.normals = bare.surface = bare.emission = nullptr;
    bare.write(folder_.path());
    EXPECT_TRUE(built(options()) == plain) << "factors alone are no channels";
    EXPECT_EQ(readDataset(**openFile(output()))->header.flags & (kFlagImages | kFlagChannels), kFlagImages);
}

TEST_F(ChannelBuild, IsTheSameHoweverItIsBuilt) {
    wholeFloor().write(folder_.path());
    const std::string whole = built(options());
    BuildOptions o = options();
    o.threads = 1;
    EXPECT_TRUE(built(o) == whole) << "one thread";
    fs::remove(output());
    o = options();
    o.checkpointSeconds = 0;
    o.resume = true;
    bool stop = true;
    o.progress = [&](const BuildProgress& at) { return !(stop && at.stage.starts_with("writing")); };
    ASSERT_FALSE(buildOctree(o).ok());
    BuildOptions other = o;
    other.channels = false;
    stop = false;
    const auto refused = buildOctree(other);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().line().find("other inputs or options"), std::string::npos) << refused.error().line();
    EXPECT_TRUE(built(o) == whole) << "resumed";
    fs::remove(output());
    o = options();
    o.overwrite = false;
    ASSERT_NO_FATAL_FAILURE(test::buildInParts(o, 2));
    EXPECT_TRUE(contentOf(output()) == whole) << "in parts";
}

TEST_F(ChannelBuild, AMaterialWithoutAColourImageIsWhite) {
    ChannelledFloor floor;
    floor.normals = wholeFloor().normals;
    const ImageTables tables = tablesOf(floor);
    ASSERT_EQ(tables.images.size(), 2u);
    EXPECT_EQ(tables.images[0].width * tables.images[0].height, 1u);
    ASSERT_EQ(tables.channels.size(), 1u);
    EXPECT_EQ(tables.channels[0].normals, 2u);
    const auto set = readAllImages(**openFile(output()), readDataset(**openFile(output()))->header.images);
    EXPECT_EQ(test::texelsOf(set->images()[0].levels[0])[0], 0xffffffffu);
}

TEST_F(ChannelBuild, WhatLiesElsewhereIsLeftOut) {
    ChannelledFloor floor = wholeFloor();
    floor.normalTexture = R"(,"texCoord":1)";
    ImageTables tables = tablesOf(floor, 1);
    ASSERT_EQ(tables.channels.size(), 1u);
    EXPECT_EQ(tables.channels[0].normals, 0u);
    EXPECT_NE(tables.channels[0].surface, 0u);
    // Nor is a wrong number the end of it.
    floor.normalTexture = R"(,"texCoord":-1)";
    tables = tablesOf(floor, 1);
    EXPECT_TRUE(tables.channels.empty());
    EXPECT_EQ(tables.images.size(), 1u);
}

TEST_F(ChannelBuild, WhatCannotBeReadIsLeftOut) {
    wholeFloor().write(folder_.path());
    // One is no picture, and one is cut off.
    std::ofstream(folder_ / "surface.png") << "no picture";
    const std::string emission = contentOf(folder_ / "emission.png");
    std::ofstream(folder_ / "emission.png", std::ios::binary) << emission.substr(0, emission.size() / 2);
    const auto report = buildOctree(options());
    ASSERT_TRUE(report.ok()) << report.error().line();
    ASSERT_EQ(report->warnings.size(), 2u);
    EXPECT_NE(report->warnings[0].find("surface.png"), std::string::npos) << report->warnings[0];
    EXPECT_NE(report->warnings[1].find("emission.png"), std::string::npos) << report->warnings[1];
    const auto file = openFile(output());
    const ImageTables tables = *readImageTables(**file, readDataset(**file)->header.images);
    ASSERT_EQ(tables.images.size(), 2u);
    ASSERT_EQ(tables.channels.size(), 1u);
    // Factors without their images say nothing.
    EXPECT_EQ(tables.channels[0].surface, 0u);
    EXPECT_EQ(tables.channels[0].metalness, 0.0f);
    EXPECT_EQ(tables.channels[0].roughness, 1.0f);
    EXPECT_EQ(tables.channels[0].emissionFactor[2], 0.0f);
}

}  // namespace
}  // namespace vcp
