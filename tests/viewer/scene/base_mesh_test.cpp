#include "viewer/scene/base_mesh.h"

#include <gtest/gtest.h>

#include "mesostructure/base/surface_edges.h"
#include "viewer/asset/tile_mesh.h"
#include "viewer/scene/scene_file.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

Result<meso::BaseSurface> read(std::string_view text, double tiles = 1) {
    return readBaseObj(ByteSource::fromMemory(text, "a.obj", ByteSource::kWindowBytes), tiles);
}

std::string refusal(std::string_view text) {
    const auto made = read(text);
    EXPECT_FALSE(made) << text;
    return made ? "" : made.error().line();
}

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

TEST(BaseMesh, KeepsTheCoordinatesOfEachCornerToTheLastBit) {
    const auto made = read(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.1 0.7\nvt 0.123456789012345 -3e-9\nvt 1 .3 0.5\nvn 0 0 1\n"
        "usemtl wood\nf 1/1 2/2/1 3/3\nf -1/-1 -2/2 -3/-3\n",
        3);
    ASSERT_TRUE(made) << made.error().line();
    ASSERT_EQ(made->uvs.size(), 2u);
    EXPECT_EQ(made->uvs[0][0], glm::dvec2(0.1 * 3, 0.7 * 3));
    EXPECT_EQ(made->uvs[0][1], glm::dvec2(0.123456789012345 * 3, -3e-9 * 3));
    EXPECT_EQ(made->uvs[0][2], glm::dvec2(3, 0.3 * 3));
    EXPECT_EQ(made->uvs[1][0], made->uvs[0][2]);
    EXPECT_EQ(made->uvs[1][1], made->uvs[0][1]);
    EXPECT_EQ(made->uvs[1][2], made->uvs[0][0]);
}

TEST(BaseMesh, KeepsSeamsAndJoinsPlaces) {
    // Two squares side by side whose maps do not go on; their common places are there twice.
    const auto made = read(kSquare + "v 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nf 1/1 2/2 3/3 4/4\nf 5/1 6/2 7/3 8/4\n");
    ASSERT_TRUE(made) << made.error().line();
    EXPECT_EQ(made->positions.size(), 6u);
    const auto edges = meso::edgesOf(*made);
    ASSERT_TRUE(edges);
    EXPECT_EQ(edges->parts, 1u);
    EXPECT_EQ(edges->seams, 1u);
    EXPECT_EQ(edges->border, 6u);
}

TEST(BaseMesh, SaysWhatItRefuses) {
    EXPECT_EQ(refusal(kSquare + "f 1/1 2/2 3\n"),
              "a.obj: line 9: has no texture coordinates before it, which say where things go on the surface; unwrap "
              "the mesh first");
    EXPECT_NE(refusal(kSquare + "f 1/1 2/2 3/5\n").find("line 9: has no texture coordinates"), std::string::npos);
    EXPECT_NE(refusal(kSquare + "f 1/1 2/2 3/99999999999999999999\n").find("no texture coordinates"),
              std::string::npos);
    EXPECT_NE(refusal(kSquare + "f 1/1 2/2 4294967297/3\n").find("a face names vertex 4294967297"), std::string::npos);
    EXPECT_NE(refusal(kSquare + "f 1/1 2/2 -5/3\n").find("only 4 vertices precede it"), std::string::npos);
    EXPECT_NE(refusal(kSquare + "f 1/1 2/2 0/3\n").find("numbered from 1"), std::string::npos);
    EXPECT_NE(refusal(kSquare + "vt nan 0\n").find("line 9: byte 62: texture coordinates are two finite"),
              std::string::npos);
    EXPECT_NE(refusal(kSquare + "vt 1\n").find("two finite numbers"), std::string::npos);
    EXPECT_NE(refusal(kSquare + "vt x 1\n").find("is not a number"), std::string::npos);
    EXPECT_NE(refusal(kSquare).find("has no faces"), std::string::npos);
    EXPECT_NE(refusal("").find("a.obj"), std::string::npos);
    EXPECT_NE(refusal(kSquare + "f 1/1 2/1 3/1\n").find("with an area"), std::string::npos);
}

// Every mesh that other projects test their readers with, broken ones among them, as a base and as a tile: each is
// read, or refused in one line with its name.
TEST(BaseMesh, FilesOfOthersAreReadOrRefusedInOneLine) {
    const fs::path data = fs::path(VCP_SHARED_DATA_DIR) / "suites";
    if (!fs::exists(data)) GTEST_SKIP() << data << " is not there";
    size_t bases = 0, tiles = 0, files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(data)) {
        if (!entry.is_regular_file() || entry.file_size() > 4 << 20) continue;
        ++files;
        const auto base = readBaseMesh(entry.path(), 1);
        const auto tile = readTileMesh(entry.path(), {});
        bases += base.ok(), tiles += tile.ok();
        for (const Error* error : {base ? nullptr : &base.error(), tile ? nullptr : &tile.error()}) {
            if (!error) continue;
            EXPECT_EQ(error->line().find('\n'), std::string::npos) << error->line();
            EXPECT_FALSE(error->file.empty()) << entry.path() << error->line();
        }
        const auto edges = base ? meso::edgesOf(*base) : meso::SurfaceEdges();
        EXPECT_TRUE(edges || edges.error().line().starts_with("triangle ")) << edges.error().line();
    }
    EXPECT_GT(files, 100u);
    EXPECT_GT(bases, 5u);
    EXPECT_GT(tiles, 5u);
}

TEST(BaseMesh, ScenesSubdivideTheirSurfaces) {
    const std::string scene =
        R"({"mesostructure": [{"asset": "edge", "method": "pyramid", "surface": "quad", "subdivide": 2}]})";
    const auto file = sceneFromJson(scene, "a.json", {});
    ASSERT_TRUE(file) << file.error().line();
    EXPECT_EQ(file->surfaces[0].subdivide, 2);
    const auto made = makeMesoScene(file->surfaces);
    ASSERT_TRUE(made) << made.error().line();
    EXPECT_EQ(made->surfaces[0].shell.pieces, 3u * 2 * 16);
}

}  // namespace
}  // namespace vcp
