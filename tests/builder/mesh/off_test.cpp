#include "builder/mesh/off.h"

#include <bit>

#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

using test::readEveryWindow;
using test::ReadMesh;
using test::Triangle;

ReadMesh readOff(std::string_view bytes) { return readEveryWindow(openOff, bytes); }

std::string lineOfOff(std::string_view bytes) {
    const ReadMesh mesh = readOff(bytes);
    EXPECT_TRUE(mesh.error) << bytes;
    return mesh.line();
}

TEST(Off, ReadsPolygonsCommentsAndBlankLines) {
    const ReadMesh mesh = readOff(
        "# a comment\n\nOFF # another\n4 2 0\n0 0 0\n1 0 0\r\n\n# between\n1 1 0\n0 1 5.5e-1 # after\n4 0 1 2 3\n3 3 2 "
        "1\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.info.format, "OFF ASCII");
    EXPECT_EQ(mesh.positions[3], glm::dvec3(0, 1, 0.55));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {3, 2, 1}}));
}

TEST(Off, KeywordCountsAndTheirForms) {
    const std::string body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2";
    for (const char* start : {"OFF\n3 1 0\n", "OFF 3 1 3\n", "OFF3 1 3\n", "3 1 0\n", "OFF\n3 1\n",
                              " \tOFF\n3 1 0 # or nah\n", "\xEF\xBB\xBFOFF\n3 1 0\n"})
        EXPECT_EQ(readOff(start + body).triangles.size(), 1u) << start;
    EXPECT_EQ(openOff(ByteSource::fromMemory("4OFF\n3 1 0\n", "f")).error().code, ErrorCode::Unsupported);
    EXPECT_TRUE(looksLikeOff("# x\n\n STCNOFF BINARY\n"));
    EXPECT_FALSE(looksLikeOff("# OFF\nv 0 0 0\n"));
    EXPECT_FALSE(looksLikeOff("3 1 0\n"));
}

TEST(Off, VertexColoursAreFractionsOrBytes) {
    const ReadMesh bytes = readOff("COFF\n3 1 0\n0 0 0 255 1 0 255\n1 0 0 0 300 -5 7\n0 1 0 1 2 3\n3 0 1 2\n");
    EXPECT_EQ(bytes.colours, (std::vector<Rgba8>{0xFF0001FF, 0x0700FF00, 0xFF030201}));
    const ReadMesh reals = readOff("NCOFF\n3 1 0\n");
    EXPECT_TRUE(reals.error) << "the order is C, then N";
    const ReadMesh both =
        readOff("CNOFF\n3 1 0\n0 0 0 0 0 1 1.0 0 0 1\n1 0 0 0 0 1 0 0.5 0 1\n0 1 0 0 0 1 0 0 1 0.0\n3 0 1 2\n");
    ASSERT_FALSE(both.error) << both.line();
    EXPECT_EQ(both.colours, (std::vector<Rgba8>{0xFF0000FF, 0xFF008000, 0x00FF0000}));
    EXPECT_EQ(both.normals, std::vector<uint32_t>(3, packDirection({0, 0, 1})));
}

TEST(Off, NormalsAreDirectionsOfAnyLength) {
    const ReadMesh mesh = readOff("NOFF\n3 1 0\n0 0 0 0 3 0\n1 0 0 0 0 0\n0 1 0\n3 0 1 2\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.normals, (std::vector<uint32_t>{packDirection({0, 1, 0}), kUnknownNormal, kUnknownNormal}));
    EXPECT_TRUE(readOff("OFF\n3 1 0\n0 0 0 0 3 0\n1 0 0\n0 1 0\n3 0 1 2\n").normals.empty());
}

TEST(Off, FaceColoursAreAWarning) {
    auto stream = openOff(ByteSource::fromMemory("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 1 2 1\n", "f"));
    MeshChunk chunk;
    ASSERT_TRUE((*stream)->next(chunk).ok());
    EXPECT_EQ(chunk.triangles.size(), 2u);
    EXPECT_EQ((*stream)->warnings().size(), 1u);
}

TEST(Off, WhatIsWrongIsNamed) {
    EXPECT_NE(lineOfOff("OFF\n3 1 0\n0 0 0\n1 0 0\n0 x 0\n3 0 1 2\n").find("vertex 2: byte 24: 'x' is not a number"),
              std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n3 1 0\n0 0 0\n1 0\n0 0 0\n3 0 1 2\n").find("vertex 1"), std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n3 1 0\n0 0 0\n1 nan 0\n0 0 0\n3 0 1 2\n").find("not finite"), std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")
                  .find("face 0: byte 34: vertex number 3 is out of range"),
              std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n").find("only 2"), std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").find("truncated"), std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n353535235358 6 0\n0 0 0\n").find("353535235358"), std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n3 0 0\n0 0 0\n0 0 0\n0 0 0\n").find("no faces"), std::string::npos);
    EXPECT_NE(lineOfOff("OFF\n").find("ends inside the header"), std::string::npos);
}

// Geomview's layout, in either byte order.
std::string binaryOff(bool big, bool colours, bool normals = false) {
    std::string bytes = std::string(colours ? "C" : "") + (normals ? "N" : "") + "OFF BINARY\n";
    const auto put = [&](uint32_t value) {
        for (int i = 0; i < 4; ++i) bytes += char(value >> (big ? 24 - 8 * i : 8 * i));
    };
    const auto real = [&](float value) { put(std::bit_cast<uint32_t>(value)); };
    for (const uint32_t count : {4, 2, 0}) put(count);
    for (int v = 0; v < 4; ++v) {
        for (const float x : {float(v), float(v * v), -0.5f}) real(x);
        for (const float n : {0.0f, 2.0f, float(v)})
            if (normals) real(n);
        for (const float c : {1.0f, 0.0f, 0.5f, 2.0f})
            if (colours) real(c);
    }
    for (const uint32_t n : {4, 0, 1, 2, 3, 0}) put(n);
    for (const uint32_t n : {3, 3, 2, 1, 3}) put(n);
    for (const float c : {1.0f, 0.0f, 0.5f}) real(c);
    return bytes;
}

TEST(Off, ReadsBinaryOfEitherByteOrder) {
    for (const bool big : {false, true})
        for (const bool colours : {false, true}) {
            const ReadMesh mesh = readOff(binaryOff(big, colours, !colours));
            ASSERT_FALSE(mesh.error) << mesh.line();
            EXPECT_EQ(mesh.positions[3], glm::dvec3(3, 9, -0.5));
            EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {3, 2, 1}}));
            EXPECT_EQ(mesh.colours.size(), colours ? 4u : 0u);
            if (colours) {
                EXPECT_EQ(mesh.colours[0], 0xFF8000FFu);
            } else {
                EXPECT_EQ(mesh.normals[0], packDirection({0, 1, 0}));
                EXPECT_EQ(mesh.normals[3], packDirection({0, 2, 3}));
            }
        }
}

TEST(Off, EveryTruncationOfABinaryFileIsAnError) {
    const std::string bytes = binaryOff(true, true);
    for (size_t kept = 0; kept < bytes.size(); ++kept) EXPECT_NE(lineOfOff(bytes.substr(0, kept)), "") << kept;
}

}  // namespace
}  // namespace vcp
