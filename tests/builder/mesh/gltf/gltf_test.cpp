#include "builder/mesh/gltf/gltf.h"

#include <fstream>

#include <glm/geometric.hpp>

#include "octree/surface/leaf_math.h"
#include "tests/support/gltf_files.h"
#include "tests/support/mesh_reading.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

using test::bytesOf;
using test::GltfFile;
using test::oneTriangle;
using test::readAll;
using test::ReadMesh;
using test::Triangle;

Result<std::unique_ptr<MeshStream>> openGltfBytes(ByteSource source) { return openGltf(std::move(source), {}, {}); }

ReadMesh readGltf(const std::string& bytes) { return test::readEveryWindow(openGltfBytes, bytes); }

std::string lineOfGltf(const std::string& bytes) {
    const ReadMesh mesh = readGltf(bytes);
    EXPECT_TRUE(mesh.error) << bytes;
    return mesh.line();
}

TEST(Gltf, EmbeddedAndBinaryFilesReadTheSame) {
    const GltfFile file = oneTriangle();
    const ReadMesh text = readGltf(file.embedded()), binary = readGltf(file.glb());
    ASSERT_FALSE(text.error) << text.line();
    ASSERT_FALSE(binary.error) << binary.line();
    EXPECT_TRUE(text == binary);
    EXPECT_EQ(text.info.format, "glTF");
    EXPECT_EQ(binary.info.format, "GLB");
    EXPECT_EQ(text.positions, (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(text.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST(Gltf, NodesMoveInDoubles) {
    GltfFile file = oneTriangle();
    // A parent far away, a child turned by 90 degrees about z and scaled, shown twice.
    file.nodes = R"({"translation":[376000.25,3790000.5,0],"children":[1,2]},)"
                 R"({"rotation":[0,0,0.70710678118654752,0.70710678118654752],"scale":[2,3,4],"mesh":0},)"
                 R"({"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0.125,1],"mesh":0})";
    const ReadMesh mesh = readGltf(file.embedded());
    ASSERT_FALSE(mesh.error) << mesh.line();
    ASSERT_EQ(mesh.positions.size(), 6u);
    const glm::dvec3 expected[] = {{376000.25, 3790000.5, 0},     {376000.25, 3790002.5, 0},
                                   {375997.25, 3790000.5, 0},     {376000.25, 3790000.5, 0.125},
                                   {375999.25, 3790000.5, 0.125}, {376000.25, 3790001.5, 0.125}};
    for (size_t i = 0; i < 6; ++i) EXPECT_LT(glm::length(mesh.positions[i] - expected[i]), 1e-9) << i;
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 5, 4}})) << "a mirror turns the triangle over";
}

TEST(Gltf, NormalsTurnWithTheirNodes) {
    GltfFile file = oneTriangle();
    const glm::dvec3 own[] = {{0, 0, 1}, {1, 1, 0}, {0, 0, 0}};
    file.floats({0, 0, 1, 0.6f, 0.6f, 0, 0, 0, 0}, "VEC3", 3);
    file.meshes = fmt::format(R"({{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":{}}}{}}}]}})",
                              file.accessors.size() - 1, file.accessors.size() > 2 ? R"(,"indices":1)" : "");
    // As it is; scaled unevenly; turned by 90 degrees about x, and mirrored.
    file.nodes = R"({"mesh":0},{"mesh":0,"scale":[4,1,2]},)"
                 R"({"matrix":[-1,0,0,0, 0,0,1,0, 0,-1,0,0, 0,0,0,1],"mesh":0})";
    file.scene = "0,1,2";
    const ReadMesh mesh = readGltf(file.embedded());
    ASSERT_FALSE(mesh.error) << mesh.line();
    ASSERT_EQ(mesh.normals.size(), 9u);
    const glm::dvec3 wanted[] = {own[0],    own[1],     {0, 0, 1},  {0, 0, 1}, {0.25, 1, 0},
                                 {0, 0, 1}, {0, -1, 0}, {-1, 0, 1}, {0, 0, 1}};
    for (size_t i = 0; i < 9; ++i) {
        if (i % 3 == 2) {
            EXPECT_EQ(mesh.normals[i], kUnknownNormal);
            continue;
        }
        const glm::dvec3 n = f64::decodeNormal(mesh.normals[i]);
        EXPECT_GT(std::abs(glm::dot(n, glm::normalize(wanted[i]))), std::cos(0.003)) << i;
    }
}

TEST(Gltf, NormalsThatDoNotFitAreLeftOut) {
    GltfFile file = oneTriangle();
    file.floats({0, 0, 1, 0, 0, 1}, "VEC3", 2);
    file.meshes =
        fmt::format(R"({{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":{}}}}}]}})", file.accessors.size() - 1);
    const ReadMesh mesh = readGltf(file.embedded());
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_TRUE(mesh.normals.empty());
    const auto stream = openGltfBytes(ByteSource::fromMemory(file.embedded(), "mesh"));
    ASSERT_EQ((*stream)->warnings().size(), 1u);
    EXPECT_NE((*stream)->warnings()[0].find("NORMAL does not fit"), std::string::npos);
}

TEST(Gltf, StripsFansAndSequencesWithAnyIndexType) {
    const std::vector<Triangle> strip{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}, fan{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}},
        list{{0, 1, 2}};
    const std::string bytes[] = {bytesOf<uint8_t>({0, 1, 2, 3, 4}), bytesOf<uint16_t>({0, 1, 2, 3, 4}),
                                 bytesOf<uint32_t>({0, 1, 2, 3, 4}), ""};
    const int types[] = {5121, 5123, 5125, 0};
    for (int kind = 0; kind < 4; ++kind)
        for (int mode = 4; mode <= 6; ++mode) {
            GltfFile file;
            file.floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 2, 0}, "VEC3", 5);
            if (kind < 3) file.accessor(bytes[kind], types[kind], "SCALAR", 5);
            file.meshes = fmt::format(R"({{"primitives":[{{"attributes":{{"POSITION":0}},"mode":{}{}}}]}})", mode,
                                      kind < 3 ? R"(,"indices":1)" : "");
            const ReadMesh mesh = readGltf(file.embedded());
            ASSERT_FALSE(mesh.error) << mesh.line();
            EXPECT_EQ(mesh.triangles, mode == 4 ? list : mode == 5 ? strip : fan) << kind << ' ' << mode;
        }
}

TEST(Gltf, PointsAndLinesAloneAreRefused) {
    GltfFile file = oneTriangle();
    file.meshes = R"({"primitives":[{"attributes":{"POSITION":0},"mode":0},{"attributes":{"POSITION":0},"mode":3}]})";
    EXPECT_NE(lineOfGltf(file.embedded()).find("no triangles"), std::string::npos);
}

TEST(Gltf, SparseValuesReplaceOthersOrZeros) {
    for (const bool dense : {false, true}) {
        GltfFile file = oneTriangle();
        const size_t indices = file.view(bytesOf<uint8_t>({1, 2}));
        const size_t values = file.view(bytesOf<float>({5, 6, 7, 8, 9, 10}));
        file.accessors[0] = fmt::format(
            R"({{{}"componentType":5126,"type":"VEC3","count":3,"sparse":{{"count":2,"indices":{{"bufferView":{},"componentType":5121}},"values":{{"bufferView":{}}}}}}})",
            dense ? R"("bufferView":0,)" : "", indices, values);
        const ReadMesh mesh = readGltf(file.embedded());
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.positions, (std::vector<glm::dvec3>{{0, 0, 0}, {5, 6, 7}, {8, 9, 10}}));
    }
}

TEST(Gltf, QuantizedInterleavedPositions) {
    GltfFile file;
    // int16 positions with two bytes of padding, a stride of 8; normalized.
    file.view(bytesOf<int16_t>({0, 0, 0, 99, 32767, 0, 0, 99, 0, -32768, 0, 99}), R"(,"byteStride":8)");
    file.accessors.push_back(R"({"bufferView":0,"componentType":5122,"type":"VEC3","count":3,"normalized":true})");
    file.meshes = R"({"primitives":[{"attributes":{"POSITION":0}}]})";
    file.more = R"(,"extensionsRequired":["KHR_mesh_quantization"])";
    const ReadMesh mesh = readGltf(file.embedded());
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.positions, (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}}));
}

TEST(Gltf, AnAccessorSharedByManyPrimitivesIsReadByRange) {
    GltfFile file;
    file.floats({9, 9, 9, 9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 9, 9, 9}, "VEC3", 6);
    file.accessor(bytesOf<uint16_t>({4, 3, 2}), 5123, "SCALAR", 3);
    file.meshes = R"({"primitives":[{"attributes":{"POSITION":0},"indices":1}]})";
    const ReadMesh mesh = readGltf(file.embedded());
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.positions, (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 1, 0}}));
}

TEST(Gltf, ColoursOfAnyTypeAreEncodedAsSrgb) {
    // 0.5 as light is 188 as a colour.
    const std::string bytes[] = {bytesOf<uint8_t>({255, 0, 128, 255, 0, 128, 255, 0, 128}),
                                 bytesOf<uint16_t>({65535, 0, 32896, 0, 65535, 0, 32896, 0, 65535, 0, 32896, 0}),
                                 bytesOf<float>({1, 0, 0.50196f, 1, 0, 0.50196f, 1, 0, 0.50196f})};
    const int types[] = {5121, 5123, 5126};
    for (int kind = 0; kind < 3; ++kind) {
        GltfFile file = oneTriangle();
        const bool four = kind == 1;
        file.accessor(bytes[kind], types[kind], four ? "VEC4" : "VEC3", 3, kind < 2 ? R"(,"normalized":true)" : "");
        file.meshes = R"({"primitives":[{"attributes":{"POSITION":0,"COLOR_0":2},"indices":1}]})";
        const ReadMesh mesh = readGltf(file.embedded());
        ASSERT_FALSE(mesh.error) << mesh.line();
        ASSERT_EQ(mesh.colours.size(), 3u);
        EXPECT_EQ(mesh.colours[0], four ? 0x00BC00FFu : 0xFFBC00FFu) << kind;
    }
}

TEST(Gltf, BaseColoursCountWhereTheyDiffer) {
    GltfFile file = oneTriangle();
    const std::string red = R"({"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1]}})";
    file.more = R"(,"materials":[)" + red + "]";
    file.meshes = R"({"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]})";
    EXPECT_TRUE(readGltf(file.embedded()).colours.empty());
    file.meshes =
        R"({"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0},{"attributes":{"POSITION":0},"indices":1}]})";
    EXPECT_EQ(readGltf(file.embedded()).colours,
              (std::vector<Rgba8>{0xFF0000FF, 0xFF0000FF, 0xFF0000FF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF}));
}

TEST(Gltf, InstancesAreShownOneByOne) {
    GltfFile file = oneTriangle();
    file.floats({10, 0, 0, 20, 0, 0}, "VEC3", 2);
    file.floats({1, 1, 1, 2, 2, 2}, "VEC3", 2);
    file.nodes = R"({"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2,"SCALE":3}}}})";
    const ReadMesh mesh = readGltf(file.embedded());
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.positions,
              (std::vector<glm::dvec3>{{10, 0, 0}, {11, 0, 0}, {10, 1, 0}, {20, 0, 0}, {22, 0, 0}, {20, 2, 0}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}));
}

// A picture of one red texel.
const std::string kRedPng =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/"
    "pLvAAAAAElFTkSuQmCC";

TEST(Gltf, TexturesComeWithCoordinatesMaterialsAndWarnings) {
    GltfFile file = oneTriangle();
    file.floats({0.25f, 0, 1, 0, 0, 1}, "VEC2", 3);
    file.meshes =
        R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_1":2},"indices":1,"material":0},{"attributes":{"POSITION":0},"indices":1,"material":1}]})";
    file.more =
        R"(,"images":[{"uri":")" + kRedPng +
        R"("},{"uri":"missing.png"}],"samplers":[{"wrapS":33071,"wrapT":33648}],)"
        R"("textures":[{"source":0,"sampler":0},{"source":1}],"materials":[)"
        R"({"name":"red","pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":)"
        R"({"offset":[0.5,0.25],"scale":[2,4],"rotation":1.5707963267948966,"texCoord":1}}}}},)"
        R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}}])";
    auto stream = openGltfBytes(ByteSource::fromMemory(file.embedded(), "mesh"));
    const std::string bytes = file.embedded();
    stream = openGltfBytes(ByteSource::fromMemory(bytes, "mesh"));
    ASSERT_TRUE(stream.ok()) << stream.error().line();
    ASSERT_EQ((*stream)->materials().size(), 2u);
    const Material& material = (*stream)->materials()[0];
    EXPECT_TRUE(material.image.bytes && material.wrapU == Wrap::Clamp && material.wrapV == Wrap::Mirror &&
                material.name == "red");
    EXPECT_FALSE((*stream)->materials()[1].image.exists());
    EXPECT_EQ((*stream)->warnings().size(), 1u);
    MeshChunk chunk;
    ASSERT_TRUE(*(*stream)->next(chunk));
    ASSERT_EQ(chunk.uvs.size(), 1u);
    EXPECT_EQ(chunk.materials, std::vector<uint32_t>{0});
    // Counter-clockwise by 90 degrees as one sees it: what points right points up, to smaller v.
    const glm::vec2 expected[] = {{0.5f, 0.25f - 0.5f}, {0.5f, 0.25f - 2}, {0.5f + 4, 0.25f}};
    for (size_t i = 0; i < 3; ++i) EXPECT_LT(glm::length(chunk.uvs[0][i] - expected[i]), 1e-5f) << i;
    ASSERT_TRUE(*(*stream)->next(chunk));
    EXPECT_EQ(chunk.materials, std::vector<uint32_t>{kNoMaterial});
}

TEST(Gltf, MasksComeFromAlphaMode) {
    const auto materialOf = [](const std::string& fields) {
        GltfFile file = oneTriangle();
        file.floats({0, 0, 1, 0, 0, 1}, "VEC2", 3);
        file.meshes = R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":0}]})";
        file.more = R"(,"images":[{"uri":")" + kRedPng + R"("}],"textures":[{"source":0}],"materials":[{)" + fields +
                    R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5],"baseColorTexture":{"index":0}}}])";
        const std::string bytes = file.embedded();
        const auto stream = openGltfBytes(ByteSource::fromMemory(bytes, "mesh"));
        EXPECT_TRUE(stream.ok());
        return stream ? (*stream)->materials()[0] : Material();
    };
    for (const char* opaque : {"", R"("alphaMode":"OPAQUE",)", R"("alphaMode":"else",)", R"("alphaMode":3,)"}) {
        const Material material = materialOf(opaque);
        EXPECT_TRUE(material.ignoresAlpha && !material.mask.exists()) << opaque;
    }
    const Material blend = materialOf(R"("alphaMode":"BLEND","alphaCutoff":0.1,)");
    EXPECT_TRUE(!blend.ignoresAlpha && blend.mask.exists() && blend.mask.sparesGlass);
    EXPECT_EQ(blend.mask.cutoff, 0.5);
    // The factor's alpha is a half.
    const Material mask = materialOf(R"("alphaMode":"MASK","alphaCutoff":0.2,)");
    EXPECT_TRUE(!mask.ignoresAlpha && mask.mask.exists() && !mask.mask.sparesGlass);
    EXPECT_NEAR(mask.mask.cutoff, 0.4, 1e-9);
    EXPECT_EQ(materialOf(R"("alphaMode":"MASK",)").mask.cutoff, 1.0);
    EXPECT_GT(materialOf(R"("alphaMode":"MASK","alphaCutoff":0.6,)").mask.cutoff, 1.0);
    EXPECT_FALSE(materialOf(R"("alphaMode":"MASK","alphaCutoff":0,)").mask.exists());
}

TEST(Gltf, NothingOutsideTheFolderIsOpened) {
    TestFolder folder("vcp_gltf");
    const GltfFile file = oneTriangle();
    std::filesystem::create_directories(folder / "inner/data");
    std::ofstream(folder / "outside.bin", std::ios::binary) << file.buffer;
    std::ofstream(folder / "inner/data/in side.bin", std::ios::binary) << file.buffer;
    const auto readUri = [&](const std::string& uri) {
        const auto path = folder / "inner/mesh.gltf";
        std::ofstream(path) << file.json(uri);
        return readAll(openMesh(path));
    };
    EXPECT_FALSE(readUri("data/in%20side.bin").error) << readUri("data/in%20side.bin").line();
    const std::string absolute = (folder / "outside.bin").string();
    for (const std::string& uri :
         {std::string("../outside.bin"), std::string("%2E%2e/outside.bin"), std::string("data/../../outside.bin"),
          absolute, "file://" + absolute, std::string("..\\\\outside.bin"), std::string("https://example.org/a.bin"),
          std::string("%00")}) {
        const ReadMesh mesh = readUri(uri);
        ASSERT_TRUE(mesh.error) << uri;
        EXPECT_NE(mesh.line().find("names no file in the folder"), std::string::npos) << mesh.line();
    }
    const auto readAllowed = [&](const std::string& uri) {
        const auto path = folder / "inner/mesh.gltf";
        std::ofstream(path) << file.json(uri);
        return readAll(openMesh(path, {.format = "", .allowOutside = true}));
    };
    EXPECT_FALSE(readAllowed("../outside.bin").error) << readAllowed("../outside.bin").line();
    EXPECT_FALSE(readAllowed(absolute).error);
    EXPECT_TRUE(readAllowed("file://" + absolute).error) << "that is no path";
    EXPECT_NE(readUri("absent.bin").line().find("no such file"), std::string::npos);
    EXPECT_NE(readUri("data").line().find("not a regular file"), std::string::npos);
    std::ofstream(folder / "inner/short.bin", std::ios::binary) << file.buffer.substr(0, 20);
    EXPECT_NE(readUri("short.bin").line().find("truncated"), std::string::npos);
    EXPECT_NE(lineOfGltf(file.json("outside.bin")).find("has no folder"), std::string::npos);
}

TEST(Gltf, WhatIsWrongIsNamed) {
    const auto with = [](auto change) {
        GltfFile file = oneTriangle();
        change(file);
        return lineOfGltf(file.embedded());
    };
    const auto has = [](const std::string& line, const char* part) {
        return line.find(part) != std::string::npos ? "" : line;
    };
    EXPECT_EQ(has(with([](GltfFile& f) {
                      f.accessors[0] = R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":4})";
                  }),
                  "accessor 0: 4 elements"),
              "");
    EXPECT_EQ(has(with([](GltfFile& f) {
                      f.accessors[0] =
                          R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":9007199254740992})";
                  }),
                  "accessor 0"),
              "");
    EXPECT_EQ(has(with([](GltfFile& f) {
                      f.accessors[0] = R"({"componentType":5126,"type":"VEC3","count":9007199254740992})";
                  }),
                  "without data"),
              "");
    EXPECT_EQ(
        has(with([](GltfFile& f) { f.views[0] = R"({"buffer":0,"byteOffset":9007199254740992,"byteLength":4})"; }),
            "bufferView 0"),
        "");
    EXPECT_EQ(has(with([](GltfFile& f) {
                      f.accessors[1] =
                          R"({"bufferView":0,"byteOffset":12,"componentType":5125,"type":"SCALAR","count":3})";
                  }),
                  "accessor 1: index 0 names vertex 1065353216"),
              "");
    EXPECT_EQ(has(with([](GltfFile& f) { f.meshes = R"({"primitives":[{"attributes":{"POSITION":7}}]})"; }),
                  "mesh 0: 'POSITION' is 7"),
              "");
    EXPECT_EQ(has(with([](GltfFile& f) { f.nodes = R"({"children":[1]},{"children":[0],"mesh":0})"; }), "own ancestor"),
              "");
    EXPECT_EQ(
        has(with([](GltfFile& f) {
                f.nodes =
                    R"({"mesh":0,"translation":[1e308,1e308,0],"scale":[1e300,1,1],"children":[1]},{"mesh":0,"scale":[1e300,1,1]})";
            }),
            "infinity"),
        "");
    EXPECT_EQ(has(with([](GltfFile& f) { f.more = R"(,"extensionsRequired":["EXT_of_another_kind"])"; }),
                  "EXT_of_another_kind"),
              "");
    EXPECT_EQ(has(with([](GltfFile& f) {
                      f = GltfFile();
                      f.floats({0, 0, 0, 1, 0, std::numeric_limits<float>::quiet_NaN(), 0, 1, 0}, "VEC3", 3);
                      f.meshes = R"({"primitives":[{"attributes":{"POSITION":0}}]})";
                  }),
                  "vertex 1 is not finite"),
              "");
    EXPECT_EQ(has(lineOfGltf(R"({"asset":{"version":"1.0"}})"), "not glTF 2.0"), "");
    EXPECT_EQ(has(lineOfGltf(R"({"name":"no asset"})"), "not glTF 2.0"), "");
    EXPECT_EQ(has(lineOfGltf(R"({"asset":{"version":"2.0"},)"), "JSON: byte 27: ends too early"), "");
    EXPECT_EQ(has(lineOfGltf(R"({"a":)" + std::string(100'000, '[')), "256 levels"), "");
}

TEST(Gltf, NodesThatMultiplyWithoutEndAreRefused) {
    GltfFile file = oneTriangle();
    file.nodes = R"({"mesh":0})";
    for (int i = 1; i < 64; ++i) file.nodes += fmt::format(R"(,{{"children":[{},{}]}})", i - 1, i - 1);
    file.scene = "63";
    const std::string bytes = file.embedded();
    const auto stream = openGltfBytes(ByteSource::fromMemory(bytes, "mesh"));
    ASSERT_FALSE(stream.ok());
    EXPECT_EQ(stream.error().code, ErrorCode::Limit);
}

TEST(Gltf, EveryTruncationOfAGlbIsAnError) {
    const std::string glb = oneTriangle().glb();
    // The last two bytes pad the buffer.
    for (size_t kept = 4; kept + 2 < glb.size(); ++kept) {
        const std::string cut = glb.substr(0, kept);
        EXPECT_TRUE(readAll(openGltfBytes(ByteSource::fromMemory(cut, "mesh"))).error) << kept;
    }
}

TEST(Gltf, TheSameSceneAsPly) {
    const auto gltf = test::kSharedData / "scenes/sanmiguel_arch/sanmiguel_arch.gltf";
    if (!std::filesystem::exists(gltf)) GTEST_SKIP() << "no " << gltf;
    const ReadMesh scene = readAll(openMesh(gltf)),
                   flat = readAll(openMesh(test::kSharedData / "scenes/sanmiguel_arch/sanmiguel_arch_rgb.ply"));
    ASSERT_FALSE(scene.error) << scene.line();
    ASSERT_EQ(scene.triangles.size(), flat.triangles.size());
    const auto bounds = [](const ReadMesh& mesh) {
        glm::dvec3 lower(1e300), upper(-1e300);
        for (const glm::dvec3& p : mesh.positions) lower = glm::min(lower, p), upper = glm::max(upper, p);
        return upper - lower;
    };
    glm::dvec3 a = bounds(scene), b = bounds(flat);
    for (glm::dvec3* v : {&a, &b}) std::sort(&v->x, &v->x + 3);  // one of them is turned
    EXPECT_LT(glm::length(a - b), 1e-3 * glm::length(b));
}

}  // namespace
}  // namespace vcp
