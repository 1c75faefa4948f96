#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>

#include <glm/geometric.hpp>

#include "tests/support/compression.h"
#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

using test::readAll;
using test::ReadMesh;

class OpenMesh : public testing::Test {
protected:
    OpenMesh() { std::filesystem::create_directories(folder_); }
    ~OpenMesh() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path write(const std::string& name, std::string_view bytes) const {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return folder_ / name;
    }
    Error errorOf(const std::filesystem::path& path) const {
        const ReadMesh mesh = readAll(openMesh(path));
        EXPECT_TRUE(mesh.error) << path;
        if (!mesh.error) return {};
        EXPECT_EQ(mesh.error->file, path.string());
        return *mesh.error;
    }

    std::filesystem::path folder_ =
        std::filesystem::temp_directory_path() / ("vcp_open_mesh_" + std::to_string(::getpid()));
};

const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const std::string kStl =
    "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid s\n";
const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST_F(OpenMesh, TellsTheFormatByContentWhateverTheName) {
    const std::map<std::string, std::string> meshes{{"OBJ", kObj}, {"STL ASCII", kStl}, {"PLY ASCII", kPly}};
    for (const auto& [format, bytes] : meshes)
        for (const char* name : {"a.dat", "b", "c.XYZ"}) {
            const ReadMesh mesh = readAll(openMesh(write(name, bytes)));
            ASSERT_FALSE(mesh.error) << mesh.line();
            EXPECT_EQ(mesh.info.format, format);
            EXPECT_EQ(mesh.triangles.size(), 1u);
            EXPECT_EQ(mesh.info.fileBytes, bytes.size());
        }
    EXPECT_EQ(readAll(openMesh(write("really_ply.obj", kPly))).info.format, "PLY ASCII");
}

TEST_F(OpenMesh, TellsTheFormatByExtensionWhereContentDoesNot) {
    const ReadMesh mesh = readAll(openMesh(write("odd.OBJ", "cstype bezier\n" + kObj)));
    EXPECT_FALSE(mesh.error) << mesh.line();
    EXPECT_NE(errorOf(write("odd.ply", "cstype")).message.find("not a PLY file"), std::string::npos);
    EXPECT_EQ(errorOf(write("odd.stl", "cstype")).element, "header");
}

TEST_F(OpenMesh, ReadsCompressedFilesWhateverTheName) {
    for (const std::string& bytes : {kObj, kStl, kPly}) {
        const ReadMesh plain = readAll(openMesh(write("plain", bytes)));
        for (const std::string& packed : {test::gzipped(bytes), test::zstandard(bytes)})
            for (const char* name : {"a.dat", "a.ply.gz", "a.stl"}) {
                const ReadMesh mesh = readAll(openMesh(write(name, packed)));
                ASSERT_FALSE(mesh.error) << mesh.line();
                EXPECT_TRUE(mesh == plain);
                EXPECT_EQ(mesh.info.fileBytes, packed.size());
            }
    }
    EXPECT_EQ(errorOf(write("empty.ply.gz", test::gzipped(""))).code, ErrorCode::InvalidInput);
    EXPECT_NE(errorOf(write("b.ply.gz", test::gzipped("cstype"))).message.find("not a PLY file"), std::string::npos);
    EXPECT_NE(
        errorOf(write("b.ply", test::gzipped(kPly.substr(0, kPly.size() - 4)))).message.find("after decompression"),
        std::string::npos);
}

TEST_F(OpenMesh, TheFormatOfTheOptionsCountsWhereContentDoesNotTell) {
    const auto odd = write("odd", "cstype bezier\n" + kObj);
    EXPECT_EQ(errorOf(odd).code, ErrorCode::Unsupported);
    EXPECT_EQ(readAll(openMesh(odd, {.format = "OBJ"})).info.format, "OBJ");
    EXPECT_EQ(readAll(openMesh(write("sure", kPly), {.format = "obj"})).info.format, "PLY ASCII");
    const auto unknown = openMesh(odd, {.format = "3ds"});
    ASSERT_FALSE(unknown.ok());
    EXPECT_EQ(unknown.error().code, ErrorCode::Usage);
}

TEST_F(OpenMesh, ReadsStandardInput) {
    const auto path = write("input", kStl);
    const int before = ::dup(STDIN_FILENO);
    const int file = ::open(path.c_str(), O_RDONLY);
    ::dup2(file, STDIN_FILENO);
    const ReadMesh mesh = readAll(openMesh("-"));
    ::dup2(before, STDIN_FILENO);
    ::close(file);
    ::close(before);
    EXPECT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST_F(OpenMesh, BinaryStlIsToldFromAPipe) {
    std::string bytes(80, 'x');
    bytes += std::string("\x70\x17\0\0", 4);  // too many for one window
    for (int facet = 0; facet < 6000; ++facet) {
        const float v[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
        bytes.append(reinterpret_cast<const char*>(v), sizeof v).append(2, '\0');
    }
    EXPECT_EQ(readAll(openMesh(write("b.dat", test::gzipped(bytes)))).triangles.size(), 6000u);
    bytes[84] = 77;  // a normal of no length
    bytes[87] = 77;
    EXPECT_EQ(errorOf(write("b.dat", test::gzipped(bytes))).code, ErrorCode::Unsupported);
    EXPECT_EQ(readAll(openMesh(write("b.stl.gz", test::gzipped(bytes)))).triangles.size(), 6000u);
}

TEST_F(OpenMesh, AFolderStandsForItsMeshFilesInOrder) {
    for (const char* name : {"b.PLY", "a.stl.gz", "c.obj", "c.mtl", "readme.txt", "d.zst"}) write(name, kPly);
    std::filesystem::create_directories(folder_ / "inner.ply");
    const std::filesystem::path inputs[] = {"first.ply", folder_, "-"};
    const auto expanded = expandInputs(inputs);
    ASSERT_TRUE(expanded.ok()) << expanded.error().line();
    const std::vector<std::filesystem::path> expected{"first.ply", folder_ / "a.stl.gz", folder_ / "b.PLY",
                                                      folder_ / "c.obj", "-"};
    EXPECT_EQ(*expanded, expected);
    const std::filesystem::path empty[] = {folder_ / "inner.ply"};
    ASSERT_FALSE(expandInputs(empty).ok());
    EXPECT_EQ(expandInputs(empty).error().code, ErrorCode::InvalidInput);
}

TEST_F(OpenMesh, WhatCannotBeReadIsOneClearError) {
    EXPECT_EQ(errorOf(folder_ / "missing.ply").code, ErrorCode::Io);
    EXPECT_EQ(errorOf(folder_).code, ErrorCode::Io);
    EXPECT_NE(errorOf(folder_).message.find("folder"), std::string::npos);
    EXPECT_EQ(errorOf("/dev/null").code, ErrorCode::Io);
    EXPECT_EQ(errorOf(write("empty.ply", "")).code, ErrorCode::InvalidInput);
    EXPECT_EQ(errorOf(write("picture.png", "\x89PNG\r\n\x1a\n")).code, ErrorCode::Unsupported);
    EXPECT_EQ(errorOf(write("text.txt", "hello\n")).code, ErrorCode::Unsupported);
}

TEST_F(OpenMesh, AFileWithoutPermissionIsOneClearError) {
    if (::geteuid() == 0) GTEST_SKIP() << "permissions do not bind the superuser";
    const auto path = write("secret.ply", kPly);
    std::filesystem::permissions(path, std::filesystem::perms::none);
    EXPECT_EQ(errorOf(path).code, ErrorCode::Io);
}

uint64_t peakResidentBytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return uint64_t(usage.ru_maxrss) * 1024;
}

std::vector<std::filesystem::path> suiteMeshes() {
    std::vector<std::filesystem::path> meshes;
    std::error_code absent;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(test::kSharedData / "suites", absent)) {
        std::string extension = entry.path().extension().string();
        std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return char(std::tolower(c)); });
        if (extension == ".ply" || extension == ".obj" || extension == ".stl") meshes.push_back(entry.path());
    }
    std::ranges::sort(meshes);
    return meshes;
}

TEST(MeshSuites, EveryFileIsReadOrRefusedInOneLine) {
    const auto meshes = suiteMeshes();
    if (meshes.empty()) GTEST_SKIP() << "no mesh suites in " << test::kSharedData;
    const uint64_t before = peakResidentBytes();
    size_t read = 0;
    for (const auto& path : meshes) {
        const ReadMesh mesh = readAll(openMesh(path));
        if (!mesh.error) ++read;
        EXPECT_EQ(mesh.line().find('\n'), std::string::npos) << mesh.line();
        if (mesh.error) {
            EXPECT_NE(mesh.error->code, ErrorCode::Io) << mesh.line();
        }
    }
    EXPECT_GE(read, 220u) << "of " << meshes.size();
    // The largest of these files takes 4 MB.
    EXPECT_LT(peakResidentBytes() - before, 256u << 20);
}

struct Known {
    const char* path;
    uint64_t vertices;
    uint64_t triangles;
};

TEST(MeshSuites, KnownFilesHaveTheirTriangles) {
    const Known known[] = {
        {"scans/happy_buddha_1M.ply", 543628, 1087716},
        {"scans/bun_zipper_ascii.ply", 35947, 69451},
        {"scans/dragon_100k_rgba.ply", 50000, 100000},
        {"scans/lucy.ply", 49987, 99970},
        {"scans/armadillo.obj", 43243, 86482},
        {"suites/assimp/OBJ/box_longline.obj", 8, 944},
        {"suites/assimp/OBJ/spider.obj", 762, 1368},
        {"suites/assimp/PLY/cube_binary_header_with_RN_newline.ply", 8, 12},
        {"suites/assimp/PLY/cube_binary_starts_with_nl.ply", 8, 12},
        {"suites/assimp/STL/Spider_ascii.stl", 4104, 1368},
        {"suites/assimp/STL/Spider_binary.stl", 4104, 1368},
        {"suites/assimp/STL/triangle_with_two_solids.stl", 6, 2},
        {"suites/draco_testdata/STL/bunny.stl", 208353, 69451},
        {"suites/draco_testdata/delim_test.ply", 24, 12},
        {"suites/draco_testdata/test_extra_whitespace.ply", 3, 1},
        {"suites/geometry-central/dodecahedron_poly.obj", 20, 36},
        {"suites/geometry-central/spot.ply", 2930, 5856},
        {"suites/openmesh/cube1.stl", 45144, 15048},
        {"suites/openmesh/cube1Binary.stl", 45144, 15048},
        {"suites/trimesh/models/fuze_ascii.ply", 502, 1000},
        {"suites/trimesh/models/metadata.ply", 4, 2},
        {"suites/trimesh/models/negative_indices.obj", 8, 12},
        {"suites/trimesh/models/polygonfaces.obj", 5, 3},
    };
    if (!std::filesystem::exists(test::kSharedData / "suites"))
        GTEST_SKIP() << "no mesh suites in " << test::kSharedData;
    for (const Known& k : known) {
        const ReadMesh mesh = readAll(openMesh(test::kSharedData / k.path));
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.positions.size(), k.vertices) << k.path;
        EXPECT_EQ(mesh.triangles.size(), k.triangles) << k.path;
    }
}

TEST(MeshSuites, TextAndBinaryOfOneModelAgree) {
    if (!std::filesystem::exists(test::kSharedData / "suites"))
        GTEST_SKIP() << "no mesh suites in " << test::kSharedData;
    const ReadMesh text = readAll(openMesh(test::kSharedData / "suites/assimp/STL/Spider_ascii.stl"));
    const ReadMesh binary = readAll(openMesh(test::kSharedData / "suites/assimp/STL/Spider_binary.stl"));
    ASSERT_EQ(text.positions.size(), binary.positions.size());
    for (size_t i = 0; i < text.positions.size(); ++i)
        EXPECT_LT(glm::length(text.positions[i] - binary.positions[i]), 1e-3) << i;
}

}  // namespace
}  // namespace vcp
