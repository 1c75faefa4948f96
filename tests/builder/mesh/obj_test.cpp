#include "builder/mesh/obj.h"

#include "builder/measure/indexed_mesh.h"
#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

using test::ReadMesh;
using test::Triangle;

ReadMesh readObj(std::string_view bytes) { return test::readEveryWindow(openObj, bytes); }

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, ReadsEveryFormOfACorner) {
    for (const char* face :
         {"f 1 2 3", "f 1/7 2/8 3/9", "f 1//7 2//8 3//9", "f 1/1/1 2/2/2 3/3/3", "f -4 -3 -2", "f\t1\t2\t3  ",
          "  f 1 2 3 # comment", "f 1 2/ 3//", "f +1 +2 +3", "f 1 \\\n 2 \\\r\n3", "f 1 2\\\n 3", "f 1 2 3\r"}) {
        const ReadMesh mesh = readObj(kSquare + face);
        ASSERT_FALSE(mesh.error) << face << ": " << mesh.line();
        EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}})) << face;
        EXPECT_EQ(mesh.positions.size(), 4u);
    }
}

TEST(Obj, CutsPolygonsIntoFansAndSkipsThoseWithoutArea) {
    const ReadMesh mesh = readObj(kSquare + "f 2 3 4 1\nf 1 2\nf 3\nf \n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}}));
}

TEST(Obj, IgnoresEveryOtherStatement) {
    const ReadMesh mesh = readObj(
        "\xEF\xBB\xBF# C:\\models\\\nmtllib a b.mtl\no name\ng f v\ns off\nvt 0 nan\nvn nan nan nan\n"
        "vp 1\nusemtl x\nfoo\n\n\n" +
        kSquare + "l 1 2 \\\n 3 4\np 1\nf 1 2 3\ncurv 0 1\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.positions.size(), 4u);
    EXPECT_EQ(mesh.triangles.size(), 1u);
    EXPECT_FALSE(mesh.info.hasColour);
    EXPECT_EQ(mesh.info.format, "OBJ");
}

TEST(Obj, ReadsNumbersInEveryNotation) {
    const ReadMesh mesh = readObj("v +1 -2. .5\nv 1e2 2.E-1 -3.5e+1 1.0\nv 1 \\\n2 \\\n3\nf 1 2 3\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.positions, (std::vector<glm::dvec3>{{1, -2, .5}, {100, .2, -35}, {1, 2, 3}}));
}

TEST(Obj, ReadsColoursAsFractionsOrBytes) {
    EXPECT_EQ(readObj("v 0 0 0 0 0.5 1\nv 0 0 0\nf 1 2 1").colours, (std::vector<Rgba8>{0xFFFF8000, 0xFFFFFFFF}));
    EXPECT_EQ(readObj("v 0 0 0 1 0 1\nv 0 0 0 255 128 2\nf 1 2 1").colours,
              (std::vector<Rgba8>{0xFF010001, 0xFF0280FF}));
    EXPECT_EQ(readObj("v 0 0 0 1.0 1 0 0\nf 1 1 1").colours, (std::vector<Rgba8>{0xFF0000FF}));
    EXPECT_EQ(readObj("v 0 0 0 nan 1 -7\nf 1 1 1").colours, (std::vector<Rgba8>{0xFF00FF00}));
    const ReadMesh late = readObj("v 0 0 0\nv 0 0 0 1 1 1\nf 1 2 1");
    EXPECT_FALSE(late.info.hasColour);
    EXPECT_TRUE(late.colours.empty());
}

TEST(Obj, FacesMayComeBeforeTheirVertices) {
    const ReadMesh mesh = readObj("f 1 2 3\n" + kSquare + "f -1 -2 -3\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 2, 1}}));
}

TEST(Obj, NormalsBelongToCorners) {
    const uint32_t x = packDirection({1, 0, 0}), y = packDirection({0, 1, 0}), z = packDirection({0, 0, 1}),
                   none = kUnknownNormal;
    const ReadMesh mesh = readObj(kSquare +
                                  "f 1 2 3\nvn 9 0 0\nvn 0 -1e-300 0\nvn 0 0 1e300\nvn 0 0 0\nvn nan 1 1\nvn 1 a 2\n"
                                  "f 1//1 2/7/2 3//3\nf 1//-6 2//-5 3//4\nf 1//5 2//6 3//7\nf 1 2/1 3//\n"
                                  "f 1//1 2//2 3//3 4//1\nf 1//0 2//-7 3//9999999999999999999\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    const std::vector<std::array<uint32_t, 3>> expected{{none, none, none}, {x, y, z},          {x, y, none},
                                                        {none, none, none}, {none, none, none}, {x, y, z},
                                                        {x, z, x},          {none, none, none}};
    EXPECT_EQ(mesh.cornerNormals, expected);
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_TRUE(readObj("vn 0 0 1\n" + kSquare + "f 1 2 3\n").cornerNormals[0][0] == none);
}

struct BadCase {
    std::string text;
    std::string element;
    uint64_t byte;
};

TEST(Obj, ErrorsNameLineAndByte) {
    const BadCase cases[] = {
        {kSquare + "f 1 2 5\nf 1 2 3\n", "line 5", 38},
        {kSquare + "f 1 2 0\n", "line 5", 38},
        {kSquare + "f 1 -5 2\n", "line 5", 36},
        {kSquare + "f 1 2 999999999\n", "line 5", 38},
        {kSquare + "f 1 2 99999999999999999999\n", "line 5", 38},
        {kSquare + "f 1 2.5 3\n", "line 5", 36},
        {kSquare + "f 1 b 3\n", "line 5", 36},
        {kSquare + "f 1 \\\n 0 3\n", "line 6", 39},
        {"v 0 0 0\nv 0 x 0\n", "line 2", 12},
        {"v 0 0 0\nv 0 1.5y 0\n", "line 2", 12},
        {"v 0 0 0\nv 0 0\n", "line 2", 13},
        {"v 0 0 0\nv 0 nan 0\n", "line 2, vertex 2", 8},
        {"v 0 0 0\n\nv 0 1e999 0\n", "line 3, vertex 2", 9},
    };
    for (const BadCase& c : cases) {
        const ReadMesh mesh = readObj(c.text);
        ASSERT_TRUE(mesh.error) << c.text;
        EXPECT_EQ(mesh.error->code, ErrorCode::InvalidInput);
        EXPECT_EQ(mesh.error->element, c.element) << mesh.line();
        EXPECT_EQ(mesh.error->byte, c.byte) << mesh.line();
    }
}

TEST(Obj, AMeshWithoutFacesIsAnError) {
    EXPECT_NE(readObj(kSquare + "l 1 2\n").line().find("has no faces"), std::string::npos);
    EXPECT_NE(readObj("# nothing\n").line().find("neither vertices nor faces"), std::string::npos);
}

/// Reads with coordinates; an error becomes its line.
std::string coordinatesOf(std::string_view text, Coordinates wanted, uint64_t most,
                          std::vector<std::array<glm::dvec2, 3>>& found) {
    MeshOpenOptions options;
    options.coordinates = wanted, options.mostCoordinates = most;
    auto stream = openObj(ByteSource::fromMemory(text, "a.obj", 37), {}, options);
    if (!stream) return stream.error().line();
    for (MeshChunk chunk;;) {
        const auto more = (*stream)->next(chunk);
        if (!more) return more.error().line();
        if (!*more) return "";
        found.insert(found.end(), chunk.coordinates.begin(), chunk.coordinates.end());
    }
}

TEST(Obj, HandsOnAllCoordinatesWhereTheyAreWanted) {
    const std::string text = kSquare + "vt 0.1 0.2\nvt 3 4 5\nvt -1e-9 .5\nf 1/1 2/2 3/3 4/-1\nf 1 2 3\n";
    std::vector<std::array<glm::dvec2, 3>> found;
    EXPECT_EQ(coordinatesOf(text, Coordinates::IfAny, 3, found), "");
    const glm::dvec2 a(0.1, 0.2), b(3, 4), c(-1e-9, 0.5);
    EXPECT_EQ(found, (std::vector<std::array<glm::dvec2, 3>>{{a, b, c}, {a, c, c}}));
    EXPECT_EQ(coordinatesOf(text, Coordinates::Required, 3, found).substr(0, 43),
              "a.obj: line 9: has no texture coordinates b");
    EXPECT_EQ(coordinatesOf(text, Coordinates::IfAny, 2, found),
              "a.obj: line 7: byte 54: has more than 2 texture coordinates");
    found.clear();
    EXPECT_EQ(coordinatesOf(text, Coordinates::OfMaterials, 0, found), "");
    EXPECT_TRUE(found.empty());
}

TEST(Obj, IsLoadedWholeWithinLimits) {
    const auto load = [](const std::string& text, const LoadOptions& options) {
        auto stream = openObj(ByteSource::fromMemory(text, "a.obj", 4096));
        return loadMesh(**stream, "a.obj", options);
    };
    const std::string text = kSquare + "f 1 2 3 4\n";
    LoadOptions options{.mostTriangles = 2, .mostPositions = 4};
    EXPECT_EQ(load(text, options)->triangles.size(), 2u);
    options.mostTriangles = 1;
    EXPECT_EQ(load(text, options).error().line(),
              "a.obj: has more than 1 triangles or 4 vertices, the most that are held in memory here");
    options = {.mostPositions = 3};
    EXPECT_EQ(load(text, options).error().code, ErrorCode::Limit);
    options = {.progress = [](double) { return false; }};
    EXPECT_EQ(load(text, options).error().code, ErrorCode::Cancelled);
    options = {.coordinates = Coordinates::Required};
    EXPECT_NE(load(text, options).error().line().find("no texture coordinates"), std::string::npos);
    options = {.coordinates = Coordinates::IfAny};
    EXPECT_TRUE(load(text, options)->coordinates.empty());
}

TEST(Obj, Utf16IsNamed) {
    const ReadMesh mesh = readObj(std::string_view("\xFE\xFF\0v", 4));
    ASSERT_TRUE(mesh.error);
    EXPECT_EQ(mesh.error->code, ErrorCode::Unsupported);
}

TEST(Obj, AStatementWithoutEndIsLimited) {
    const std::string text = kSquare + "f" + std::string(5'000'000, ' ') + "1 2 3\n";
    const ReadMesh mesh = test::readAll(openObj(ByteSource::fromMemory(text, "mesh")));
    ASSERT_TRUE(mesh.error);
    EXPECT_EQ(mesh.error->code, ErrorCode::Limit);
}

TEST(Obj, ReadsMoreThanAChunk) {
    constexpr uint64_t kMany = 150'000;
    std::string text;
    for (uint64_t i = 0; i < kMany; ++i) text += "v " + std::to_string(i) + " 0 0\n";
    for (uint64_t i = 0; i < kMany; ++i) text += "f " + std::to_string(i + 1) + " 1 -1\n";
    const ReadMesh mesh = test::readAll(openObj(ByteSource::fromMemory(text, "mesh")));
    ASSERT_FALSE(mesh.error) << mesh.line();
    ASSERT_EQ(mesh.triangles.size(), kMany);
    for (uint64_t i = 0; i < kMany; ++i) {
        ASSERT_EQ(mesh.positions[i].x, double(i));
        ASSERT_EQ(mesh.triangles[i], (Triangle{i, 0, kMany - 1}));
    }
}

TEST(Obj, EveryTruncationIsShorterOrAnError) {
    const std::string text = "# c\n" + kSquare + "f 1/1/1 \\\n2/2/2 -1\nf 1 2 3 4\n";
    const ReadMesh whole = readObj(text);
    ASSERT_FALSE(whole.error) << whole.line();
    for (size_t length = 0; length < text.size(); ++length) {
        const ReadMesh mesh = readObj(std::string_view(text).substr(0, length));
        if (!mesh.error) {
            EXPECT_LE(mesh.triangles.size(), whole.triangles.size());
        }
    }
}

TEST(Obj, EverySingleBitFlipIsReadOrRefused) {
    const std::string text = "# c\n" + kSquare + "f 1/1/1 \\\n2/2/2 -1\nf 1 2 3 4\n";
    for (size_t bit = 0; bit < 8 * text.size(); ++bit) {
        std::string flipped = text;
        flipped[bit / 8] = char(flipped[bit / 8] ^ (1 << bit % 8));
        const ReadMesh mesh = test::readAll(openObj(ByteSource::fromMemory(flipped, "mesh", 16)));
        EXPECT_EQ(mesh.line().find('\n'), std::string::npos) << mesh.line();
    }
}

}  // namespace
}  // namespace vcp
