// Scans in shards: each shard is a .vcp file that is intact, the one file comes back, and what a change of one part of
// the scan leaves as it is keeps its shards.
#include "streaming/shard/shard_folder.h"

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "builder/build.h"
#include "octree/vcp_verify.h"
#include "tests/support/channelled_floor.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"
#include "tests/support/textured_walls.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

const auto kGoOn = [](double) { return true; };

class ShardFolder : public ::testing::Test {
protected:
    BuildReport build(std::vector<fs::path> inputs, double cell, std::optional<glm::dvec3> origin = {}) const {
        BuildOptions o;
        o.inputs = std::move(inputs);
        o.output = whole();
        o.cell = cell;
        o.origin = origin;
        o.threads = 2;
        const auto report = buildOctree(o);
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? *report : BuildReport{};
    }
    ShardReport split(uint64_t shardBytes) const {
        const auto report = writeShards(**openFile(whole()), {.folder = shards(), .shardBytes = shardBytes});
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? *report : ShardReport{};
    }
    /// Expects each shard to be intact, and the one file to come back.
    void expectWhole() const {
        for (const auto& entry : fs::directory_iterator(shards())) {
            const auto reader = openDatasetFile(entry.path());
            ASSERT_TRUE(reader.ok()) << reader.error().line();
            const auto intact = verifyFile(**reader);
            EXPECT_TRUE(intact.ok()) << intact.error().line();
        }
        const auto reader = openDatasetFile(shards());
        ASSERT_TRUE(reader.ok());
        const auto packed = packShards(**reader, folder_ / "packed.vcp", {}, kGoOn);
        ASSERT_TRUE(packed.ok()) << packed.error().line();
        EXPECT_TRUE(contentOf(folder_ / "packed.vcp") == contentOf(whole()));
    }
    fs::path whole() const { return folder_ / "whole.vcp"; }
    fs::path shards() const { return folder_ / "shards"; }

    TestFolder folder_{"vcp_shard_folder"};
};

TEST_F(ShardFolder, OfAScanWithColours) {
    writeBall(folder_ / "ball.ply", 60, 120);
    build({folder_ / "ball.ply"}, 0.008);
    EXPECT_GT(split(fs::file_size(whole()) / 12).shards, 8u);
    expectWhole();
}

TEST_F(ShardFolder, OfAScanWithImages) {
    test::TexturedWalls::write(
        folder_.path(), [](uint32_t x, uint32_t y) { return x * 2 | y * 5 << 8 | (x + y) << 16; },
        [](uint32_t x, uint32_t y) { return (x / 4 + y / 4) % 2 == 0 ? 0xffffffu : 0x4060u; });
    build({folder_ / "walls.obj"}, 0.02);
    // Pages are so small that each with children begins a shard.
    EXPECT_GT(split(4000).shards, 3u);
    expectWhole();
}

TEST_F(ShardFolder, OfAScanWhoseMaterialsHaveChannels) {
    test::ChannelledFloor floor;
    floor.colour = [](uint32_t x, uint32_t y) { return x * 2 | y * 3 << 8; };
    floor.normals = [](uint32_t x, uint32_t) { return test::normalTexel(std::sin(0.3 * x) * 0.5, 0, 0.85); };
    floor.emission = [](uint32_t x, uint32_t y) { return x > 40 && y > 20 ? 0xffffffu : 0u; };
    floor.write(folder_.path());
    build({folder_ / "floor.gltf"}, 0.02);
    EXPECT_GT(split(4000).shards, 1u);
    expectWhole();
}

/// Hills in tiles of 8 x 8; `raised`: how much higher the hills of one tile in the middle are, less near its edge.
void writeTile(const fs::path& path, int column, int row, double raised) {
    constexpr int kSteps = 48;
    IndexedMesh mesh;
    for (int y = 0; y <= kSteps; ++y)
        for (int x = 0; x <= kSteps; ++x) {
            const double u = column + double(x) / kSteps, v = row + double(y) / kSteps;
            const double inside = std::sin(M_PI * x / kSteps) * std::sin(M_PI * y / kSteps);
            const double height = 0.05 * std::sin(5 * u) * std::cos(4 * v) + raised * inside * inside;
            mesh.positions.emplace_back(float(u), float(v), float(height));
        }
    for (uint32_t y = 0; y < kSteps; ++y)
        for (uint32_t x = 0; x < kSteps; ++x) {
            const uint32_t a = y * (kSteps + 1) + x, d = a + kSteps + 1;
            mesh.triangles.push_back({a, a + 1, d + 1});
            mesh.triangles.push_back({a, d + 1, d});
        }
    test::writePly(mesh, path);
}

TEST_F(ShardFolder, AReplacedTileLeavesOtherShardsAsTheyAre) {
    std::vector<fs::path> tiles;
    for (int row = 0; row < 8; ++row)
        for (int column = 0; column < 8; ++column) {
            tiles.push_back(folder_ / fmt::format("tile-{}-{}.ply", row, column));
            writeTile(tiles.back(), column, row, 0);
        }
    const glm::dvec3 origin(-0.1, -0.1, -0.5);
    build(tiles, 0.03, origin);
    const uint64_t shardBytes = fs::file_size(whole()) / 40;
    const ShardReport before = split(shardBytes);
    EXPECT_GT(before.shards, 20u);
    // So high that the bounds are others.
    writeTile(folder_ / "tile-2-5.ply", 5, 2, 0.1);
    build(tiles, 0.03, origin);
    const ShardReport after = split(shardBytes);
    EXPECT_EQ(after.shards, before.shards);
    // The shards with the tile, those beside it that its cells' neighbours touch, and those above.
    EXPECT_GE(after.shardsKept + 8, after.shards);
    EXPECT_LT(after.shardsKept, after.shards);
    expectWhole();
}

TEST_F(ShardFolder, AnOriginInsideOfTheMeshIsRefused) {
    writeTile(folder_ / "tile.ply", 0, 0, 0);
    BuildOptions o;
    o.inputs = {folder_ / "tile.ply"};
    o.output = whole();
    o.cell = 0.03;
    for (const glm::dvec3 origin : {glm::dvec3(0.5, -1, -1), glm::dvec3(-1, -0.02, -1), glm::dvec3(-1, -1, -1e9)}) {
        o.origin = origin;
        const auto report = buildOctree(o);
        ASSERT_FALSE(report.ok());
        EXPECT_NE(report.error().line().find("the origin that is asked for"), std::string::npos)
            << report.error().line();
    }
}

TEST_F(ShardFolder, PackingChecksWhatItReads) {
    writeBall(folder_ / "ball.ply", 30, 60);
    build({folder_ / "ball.ply"}, 0.01);
    split(fs::file_size(whole()) / 6);
    for (const auto& entry : fs::directory_iterator(shards())) {
        if (!isShardName(entry.path().filename().string())) continue;
        std::string content = contentOf(entry.path());
        content[content.size() / 2] = char(content[content.size() / 2] ^ 4);
        fs::permissions(entry.path(), fs::perms::owner_write, fs::perm_options::add);
        std::ofstream(entry.path(), std::ios::binary) << content;
    }
    const auto reader = openDatasetFile(shards());
    ASSERT_TRUE(reader.ok());
    EXPECT_FALSE(packShards(**reader, folder_ / "packed.vcp", {}, kGoOn).ok());
    EXPECT_FALSE(fs::exists(folder_ / "packed.vcp"));
}

}  // namespace
}  // namespace vcp
