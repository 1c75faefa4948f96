#include "builder/mesh/obj_materials.h"

#include <fstream>

#include "tests/support/mesh_reading.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

struct Painted {
    std::vector<std::array<glm::vec2, 3>> uvs;
    std::vector<uint32_t> materials;
    std::vector<Material> list;
    std::vector<std::string> warnings;
    bool active = false;
};

class ObjMaterialFiles : public testing::Test {
protected:
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }

    Painted read(const std::string& obj, const MeshOpenOptions& options = {}) const {
        write("mesh.obj", obj);
        Painted painted;
        auto stream = openMesh(folder_ / "mesh.obj", options);
        EXPECT_TRUE(stream.ok());
        painted.active = (*stream)->info().hasMaterials;
        MeshChunk chunk;
        while (true) {
            const auto more = (*stream)->next(chunk);
            EXPECT_TRUE(more.ok()) << more.error().line();
            if (!more.ok() || !*more) break;
            EXPECT_EQ(chunk.uvs.size(), painted.active ? chunk.triangles.size() : 0);
            EXPECT_EQ(chunk.materials.size(), chunk.uvs.size());
            painted.uvs.insert(painted.uvs.end(), chunk.uvs.begin(), chunk.uvs.end());
            painted.materials.insert(painted.materials.end(), chunk.materials.begin(), chunk.materials.end());
        }
        painted.list.assign((*stream)->materials().begin(), (*stream)->materials().end());
        painted.warnings.assign((*stream)->warnings().begin(), (*stream)->warnings().end());
        return painted;
    }

    TestFolder folder_{"vcp_obj_materials"};
};

const std::string kTexturedSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 0.25\n";

TEST_F(ObjMaterialFiles, TexturesComeWithCoordinatesFromTheTop) {
    write("a b.mtl",
          "# comment\nnewmtl wood\n  Kd 0.5 0.5 0.5\n  map_Kd -s 2 4 1 -o 0.5 0 0 -clamp on  my wood.png \nnewmtl "
          "plain\nKd 1 0 0\n");
    write("my wood.png", "never looked into");
    const Painted mesh = read("mtllib a b.mtl\n" + kTexturedSquare +
                              "usemtl wood\nf 1/1 2/2 3/3 -1/-1\nusemtl plain\nf 1 2 3\nusemtl wood\nf 1/9 2/2 3//1\n");
    EXPECT_TRUE(mesh.active);
    ASSERT_EQ(mesh.warnings.size(), 1u) << "the corners without coordinates";
    ASSERT_EQ(mesh.list.size(), 2u);
    EXPECT_EQ(mesh.list[0].image.path, folder_ / "my wood.png");
    EXPECT_EQ(mesh.list[0].factor, kWhite) << "Kd beside an image does not count";
    EXPECT_TRUE(mesh.list[0].wrapU == Wrap::Clamp && mesh.list[0].wrapV == Wrap::Clamp);
    EXPECT_EQ(mesh.list[1].factor, 0xFF0000FFu);
    EXPECT_EQ(mesh.materials, (std::vector<uint32_t>{0, 0, 1, 0}));
    using Uvs = std::array<glm::vec2, 3>;
    EXPECT_EQ(mesh.uvs[0], (Uvs{glm::vec2(0.5f, 1), {2.5f, 1}, {2.5f, -3}}));
    EXPECT_EQ(mesh.uvs[1], (Uvs{glm::vec2(0.5f, 1), {2.5f, -3}, {0.5f, 0}}));
    EXPECT_EQ(mesh.uvs[3], (Uvs{glm::vec2(0), {2.5f, 1}, glm::vec2(0)})) << "what does not exist is 0";
}

TEST_F(ObjMaterialFiles, ChannelsLieWhereTheColourDoes) {
    for (const char* name : {"a.png", "n.png", "r.png", "e.png"}) write(name, "");
    write("m.mtl",
          "newmtl all\nKe 1 0.5 0\nPr 0.5\nmap_Kd -s 2 2 1 a.png\nnorm -s 2 2 1 -bm 0.5 n.png\nmap_Pr -s 2 2 1 "
          "r.png\nmap_Ke -s 2 2 1 e.png\nnewmtl elsewhere\nmap_Kd a.png\nnorm -s 2 2 1 n.png\nPm 1\nnewmtl "
          "alone\nnorm -o 0.5 0 0 n.png\nnewmtl bare\nKe 1 1 1\nPm 1\nnewmtl metal\nmap_Kd a.png\nmap_Pr r.png\nPm "
          "1\nmap_Pm r.png\n");
    const Painted mesh = read("mtllib m.mtl\n" + kTexturedSquare + "usemtl alone\nf 1/1 2/2 3/3\n");
    ASSERT_EQ(mesh.list.size(), 5u);
    const MaterialChannels& all = mesh.list[0].channels;
    EXPECT_EQ(all.normals.path, folder_ / "n.png");
    EXPECT_EQ(all.surface.path, folder_ / "r.png");
    EXPECT_EQ(all.emission.path, folder_ / "e.png");
    EXPECT_EQ(all.normalScale, 0.5f);
    EXPECT_EQ(all.roughness, 0.5f);
    EXPECT_EQ(all.metalness, 0.0f);
    EXPECT_EQ(all.emissionFactor, glm::vec3(1, 0.5f, 0));
    EXPECT_FALSE(mesh.list[1].channels.exist());
    EXPECT_TRUE(mesh.list[2].channels.normals.exists());
    EXPECT_FALSE(mesh.list[2].image.exists());
    EXPECT_FALSE(mesh.list[3].channels.exist()) << "it has no image";
    EXPECT_EQ(mesh.list[4].channels.metalness, 0.0f);
    EXPECT_EQ(mesh.warnings.size(), 3u) << "an image elsewhere, metalness beside roughness, an image of metalness";
    ASSERT_EQ(mesh.uvs.size(), 1u);
    EXPECT_EQ(mesh.uvs[0][0], glm::vec2(0.5f, 1)) << "they lie where the image of normals says";
}

TEST_F(ObjMaterialFiles, MasksAreMapDOrTheImageItself) {
    write("a.png", "");
    write("m.png", "");
    write("m.mtl",
          "newmtl own\nd 0.5\nmap_Kd a.png\nnewmtl both\nmap_Kd -s 2 4 1 -o 0.5 0.25 0 a.png\n"
          "map_d -s 1 2 1 -o 0.125 0.5 0 m.png\nnewmtl alone\nmap_d -s 3 3 1 m.png\nnewmtl plain\nd 0.1\n");
    const Painted mesh = read("mtllib m.mtl\n" + kTexturedSquare +
                              "usemtl own\nf 1/1 2/2 3/3\nusemtl both\nf 1/1 2/2 3/3\nusemtl alone\nf 1/1 2/2 3/3\n");
    ASSERT_EQ(mesh.list.size(), 4u);
    EXPECT_EQ(mesh.list[0].mask.image.path, folder_ / "a.png");
    EXPECT_FALSE(mesh.list[0].ignoresAlpha || mesh.list[0].mask.mayBeGrey);
    EXPECT_EQ(mesh.list[1].mask.image.path, folder_ / "m.png");
    EXPECT_TRUE(mesh.list[1].ignoresAlpha && mesh.list[1].mask.mayBeGrey);
    EXPECT_FALSE(mesh.list[3].mask.exists());
    // What the file's coordinates become for the mask, v growing downwards, as if nothing else had been done to them.
    for (const size_t material : {1, 2}) {
        const MaskRule& mask = mesh.list[material].mask;
        const glm::vec2 scale = material == 1 ? glm::vec2(1, 2) : glm::vec2(3),
                        offset = material == 1 ? glm::vec2(0.125f, 0.5f) : glm::vec2(0);
        for (size_t i = 0; i < 3; ++i) {
            const glm::vec2 own(mesh.uvs[0][i].x, 1 - mesh.uvs[0][i].y);
            const glm::vec2 wanted = own * scale + offset, found = mesh.uvs[material][i] * mask.uvScale + mask.uvOffset;
            EXPECT_NEAR(found.x, wanted.x, 1e-5) << material;
            EXPECT_NEAR(found.y, 1 - wanted.y, 1e-5) << material;
        }
    }
}

TEST_F(ObjMaterialFiles, PlainColoursCountWhereTheyDiffer) {
    const std::string faces = kTexturedSquare + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n";
    write("one.mtl", "newmtl a\nKd 0.8 0.8 0.8\nnewmtl b\nKd 0.8 0.8 0.8\n");
    EXPECT_FALSE(read("mtllib one.mtl\n" + faces).active);
    write("two.mtl", "newmtl a\nKd 0.8 0.8 0.8\nnewmtl b\nKd 0 1 0\n");
    const Painted mesh = read("mtllib two.mtl\n" + faces);
    EXPECT_TRUE(mesh.active);
    EXPECT_EQ(mesh.materials, (std::vector<uint32_t>{0, 1}));
    EXPECT_EQ(mesh.list[1].factor, 0xFF00FF00u);
    EXPECT_FALSE(read("mtllib two.mtl\n" + faces, {.format = "", .materials = false}).active);
}

TEST_F(ObjMaterialFiles, CoordinatesOfNoUseAreAWarning) {
    write("m.mtl", "newmtl a\nmap_Kd a.png\nnewmtl plain\nKd 1 0 0\n");
    write("a.png", "never looked into");
    const Painted mesh = read(
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt nan 0\nvt 2e6 0\nvt 0 inf\nusemtl plain\nf 1 2 3\n"
        "usemtl a\nf 1/1 2/1 3/2\nf 1/1 2/1 3/3\nf 1/1 2/1 3\nf 1/4 2/3 3\n");
    ASSERT_EQ(mesh.warnings.size(), 3u) << "each kind once";
    EXPECT_NE(mesh.warnings[0].find("mesh.obj: triangle 1 has texture coordinates that are no numbers"),
              std::string::npos)
        << mesh.warnings[0];
    EXPECT_NE(mesh.warnings[1].find("triangle 2 has texture coordinates beyond 1,000,000"), std::string::npos);
    EXPECT_NE(mesh.warnings[2].find("triangle 3 has an image and no texture coordinates"), std::string::npos);
    EXPECT_EQ(mesh.uvs[1][2], glm::vec2(0, 1)) << "0 stands for what is no number";
    EXPECT_EQ(mesh.uvs[2][2].x, 2e6f);
}

TEST_F(ObjMaterialFiles, WhatIsMissingIsAWarning) {
    write("m.mtl", "newmtl a\nmap_Kd missing.png\nnewmtl b\nmap_Kd ../outside.png\nnewmtl c\nKd 1 0 0\n");
    const Painted mesh =
        read("mtllib no.mtl m.mtl ../m.mtl\n" + kTexturedSquare + "usemtl unknown\nf 1 2 3\nusemtl unknown\nf 1 2 3\n");
    ASSERT_EQ(mesh.warnings.size(), 5u);
    EXPECT_NE(mesh.warnings[0].find("no.mtl: no such file"), std::string::npos);
    EXPECT_NE(mesh.warnings[1].find("missing.png' is missing"), std::string::npos);
    EXPECT_NE(mesh.warnings[2].find("outside its folder"), std::string::npos);
    EXPECT_NE(mesh.warnings[3].find("outside its folder"), std::string::npos);
    EXPECT_NE(mesh.warnings[4].find("'unknown' is in none"), std::string::npos);
    EXPECT_EQ(mesh.materials, (std::vector<uint32_t>{kNoMaterial, kNoMaterial}));
}

TEST_F(ObjMaterialFiles, FilesOutsideTheFolderAreReadWhereThatIsAllowed) {
    const std::filesystem::path outside = folder_ / "outside", inside = folder_ / "mesh";
    std::filesystem::create_directories(outside);
    std::filesystem::create_directories(inside);
    std::ofstream(outside / "picture.png") << "picture";
    std::ofstream(outside / "m.mtl") << "newmtl a\nmap_Kd picture.png\n";
    std::ofstream(inside / "n.mtl") << "newmtl b\nmap_Kd ../outside/picture.png\nnewmtl c\nmap_Kd "
                                    << (outside / "picture.png").string() << "\n";
    std::ofstream(inside / "mesh.obj") << "mtllib ../outside/m.mtl n.mtl\n" + kTexturedSquare +
                                              "usemtl a\nf 1/1 2/2 3/3\n";
    const auto materialsOf = [&](bool allowOutside) {
        const auto stream = openMesh(inside / "mesh.obj", {.format = "", .allowOutside = allowOutside});
        EXPECT_TRUE(stream.ok());
        MeshChunk chunk;
        while (*(*stream)->next(chunk)) continue;
        size_t images = 0;
        for (const Material& material : (*stream)->materials()) images += material.image.exists() ? 1 : 0;
        return std::pair((*stream)->warnings().size(), images);
    };
    EXPECT_EQ(materialsOf(true), std::pair(size_t{0}, size_t{3}));
    const auto [warnings, images] = materialsOf(false);
    EXPECT_EQ(images, 0u);
    EXPECT_EQ(warnings, 3u) << "the material file and both images";
}

TEST_F(ObjMaterialFiles, ALibraryBeyondTheStartIsAWarning) {
    write("m.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n");
    const std::string filler(300'000, '\n');
    const Painted mesh = read("mtllib m.mtl\n" + kTexturedSquare + filler + "mtllib m.mtl\nusemtl a\nf 1 2 3\n");
    ASSERT_EQ(mesh.warnings.size(), 1u);
    EXPECT_NE(mesh.warnings[0].find("too late"), std::string::npos);
    EXPECT_EQ(mesh.materials, std::vector<uint32_t>{0});
}

}  // namespace
}  // namespace vcp
