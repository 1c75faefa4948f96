#include "builder/mesh/gltf/draco.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <glm/geometric.hpp>

#include "tests/support/compression.h"
#include "tests/support/gltf_files.h"
#include "tests/support/mesh_reading.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

using test::readAll;
using test::ReadMesh;

constexpr uint64_t kMiB = 1 << 20;

// A wavy grid of 2 n^2 triangles with colours, as Draco writes it.
struct Encoded {
    std::string bytes;
    uint32_t position = 0, colour = 0;
};

Encoded encodedGrid(uint32_t n) {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(int(2 * n * n));
    const int positions = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int colours = builder.AddAttribute(draco::GeometryAttribute::COLOR, 3, draco::DT_UINT8, true);
    uint32_t face = 0;
    const auto put = [&](std::array<glm::ivec2, 3> corners) {
        std::array<std::array<float, 3>, 3> p{};
        std::array<std::array<uint8_t, 3>, 3> c{};
        for (size_t i = 0; i < 3; ++i) {
            p[i] = {float(corners[i].x), float(corners[i].y), float((corners[i].x * corners[i].y) % 5)};
            c[i] = {uint8_t(corners[i].x), uint8_t(corners[i].y), 128};
        }
        const draco::FaceIndex index(face++);
        builder.SetAttributeValuesForFace(positions, index, p[0].data(), p[1].data(), p[2].data());
        builder.SetAttributeValuesForFace(colours, index, c[0].data(), c[1].data(), c[2].data());
    };
    for (int y = 0; y < int(n); ++y)
        for (int x = 0; x < int(n); ++x) {
            put({glm::ivec2(x, y), {x + 1, y}, {x + 1, y + 1}});
            put({glm::ivec2(x, y), {x + 1, y + 1}, {x, y + 1}});
        }
    const auto mesh = builder.Finalize();
    draco::Encoder encoder;
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
    return {std::string(buffer.data(), buffer.size()), mesh->attribute(positions)->unique_id(),
            mesh->attribute(colours)->unique_id()};
}

ReadMesh readDraco(const std::string& bytes, uint64_t memory = 256 * kMiB) {
    return readAll(openDraco(ByteSource::fromMemory(bytes, "mesh"), memory));
}

TEST(Draco, ReadsWhatWasEncoded) {
    const std::string bytes = encodedGrid(20).bytes;
    const ReadMesh mesh = readDraco(bytes);
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.triangles.size(), 800u);
    EXPECT_EQ(mesh.positions.size(), 441u);
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const glm::dvec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        area += (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    }
    EXPECT_NEAR(area / 2, 400, 1e-3);
    for (size_t i = 0; i < mesh.positions.size(); ++i)
        EXPECT_EQ(mesh.colours[i], 0xFF800000u | uint32_t(std::lround(mesh.positions[i].y)) << 8 |
                                       uint32_t(std::lround(mesh.positions[i].x)));
}

TEST(Draco, ReadsCompressedAndPipedFiles) {
    TestFolder folder("vcp_draco");
    const std::string bytes = encodedGrid(20).bytes;
    const ReadMesh plain = readDraco(bytes);
    std::ofstream(folder / "a.drc.gz", std::ios::binary) << test::gzipped(bytes);
    std::ofstream(folder / "b.dat", std::ios::binary) << bytes;
    EXPECT_TRUE(readAll(openMesh(folder / "a.drc.gz")) == plain);
    EXPECT_TRUE(readAll(openMesh(folder / "b.dat")) == plain);
}

TEST(Draco, ReadsCompressedPrimitives) {
    const Encoded grid = encodedGrid(20);
    test::GltfFile file;
    file.view(grid.bytes);
    file.accessors = {R"({"componentType":5126,"type":"VEC3","count":441})",
                      R"({"componentType":5121,"type":"VEC3","count":441,"normalized":true})",
                      R"({"componentType":5125,"type":"SCALAR","count":2400})"};
    file.meshes = fmt::format(
        R"({{"primitives":[{{"attributes":{{"POSITION":0,"COLOR_0":1}},"indices":2,"extensions":{{"KHR_draco_mesh_compression":)"
        R"({{"bufferView":0,"attributes":{{"POSITION":{},"COLOR_0":{}}}}}}}}}]}})",
        grid.position, grid.colour);
    file.nodes = R"({"mesh":0},{"mesh":0,"translation":[100,0,0]})";
    file.scene = "0,1";
    TestFolder folder("vcp_draco");
    std::ofstream(folder / "a.glb", std::ios::binary) << file.glb();
    const ReadMesh mesh = readAll(openMesh(folder / "a.glb")), alone = readDraco(grid.bytes);
    ASSERT_FALSE(mesh.error) << mesh.line();
    ASSERT_EQ(mesh.triangles.size(), 1600u);
    EXPECT_EQ(mesh.positions[0], alone.positions[0]);
    EXPECT_EQ(mesh.positions[441], alone.positions[0] + glm::dvec3(100, 0, 0));
    EXPECT_EQ(mesh.colours[0] >> 16, 0xFFBCu) << "light of 128 is a colour of 188";
}

TEST(Draco, EveryTruncationAndFlippedBytesAreReadOrRefused) {
    const std::string bytes = encodedGrid(4).bytes;
    for (size_t kept = 0; kept < bytes.size(); kept += 3) {
        const ReadMesh mesh = readDraco(bytes.substr(0, kept));
        EXPECT_TRUE(mesh.error) << kept;
        EXPECT_EQ(mesh.line().find('\n'), std::string::npos);
    }
    std::mt19937 random(3);
    for (int i = 0; i < 60; ++i) {
        std::string broken = bytes;
        broken[random() % broken.size()] = char(random());
        const ReadMesh mesh = readDraco(broken, 64 * kMiB);
        EXPECT_EQ(mesh.line().find('\n'), std::string::npos) << mesh.line();
    }
}

// What the decoder might do happens in the child, and so does what gives it its bytes.
std::string lineOfDraco(const DracoBytes& bytes) {
    const auto stream = decodeDraco(bytes, 0, {}, 64 * kMiB, "mesh", "");
    EXPECT_FALSE(stream.ok());
    return stream.ok() ? "" : stream.error().line();
}

TEST(Draco, MemoryIsLimitedAndACrashIsOneLine) {
    // A sanitizer ends the process where there would be an exception.
    const std::string tooMuch = lineOfDraco([]() -> Result<std::string> { return std::string(512 * kMiB, 'x'); });
#ifdef VCP_LIMIT_MEMORY
    EXPECT_NE(tooMuch.find("memory"), std::string::npos) << tooMuch;
#endif
    EXPECT_NE(tooMuch, "");
    EXPECT_NE(lineOfDraco([]() -> Result<std::string> { std::abort(); }).find("crashed"), std::string::npos);
    EXPECT_NE(lineOfDraco([]() -> Result<std::string> { ::_exit(0); }).find("ended early"), std::string::npos);
    EXPECT_NE(lineOfDraco([]() -> Result<std::string> {
                  return Error{.code = ErrorCode::Io, .message = "told so"};
              }).find("told so"),
              std::string::npos);
    EXPECT_NE(lineOfDraco([]() -> Result<std::string> { return std::string("nothing"); }).find("not Draco"),
              std::string::npos);
}

TEST(Draco, AStreamThatIsNotReadToItsEndLeavesNoProcess) {
    const std::string bytes = encodedGrid(150).bytes;
    {
        auto stream = openDraco(ByteSource::fromMemory(bytes, "mesh"), 256 * kMiB);
        ASSERT_TRUE(stream.ok());
    }
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
}

TEST(Draco, KnownFiles) {
    const auto path = test::kSharedData / "draco/bunny.drc";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
    EXPECT_EQ(readAll(openMesh(path)).triangles.size(), 69451u);
    const ReadMesh draco = readAll(openMesh(test::kSharedData / "draco/testdata/Box/glTF_Binary/Box_Draco.glb"));
    const ReadMesh plain = readAll(openMesh(test::kSharedData / "suites/draco_testdata/Box/glTF_Binary/Box.glb"));
    const auto soup = [](const ReadMesh& mesh) {
        std::vector<std::array<double, 3>> centres;
        for (const auto& t : mesh.triangles) {
            const glm::dvec3 sum = mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]];
            centres.push_back({std::round(sum.x * 100), std::round(sum.y * 100), std::round(sum.z * 100)});
        }
        std::ranges::sort(centres);
        return centres;
    };
    EXPECT_EQ(soup(draco), soup(plain));
}

}  // namespace
}  // namespace vcp
