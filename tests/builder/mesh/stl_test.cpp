#include "builder/mesh/stl.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

using test::ReadMesh;
using test::Triangle;

ReadMesh readStl(std::string_view bytes) { return test::readEveryWindow(openStl, bytes); }

std::string binary(uint32_t count, uint32_t declared, std::string_view title = "binary") {
    std::string bytes(80, '\0');
    bytes.replace(0, title.size(), title);
    bytes.append(reinterpret_cast<const char*>(&declared), 4);
    for (uint32_t i = 0; i < count; ++i) {
        // A normal that is not a number must not matter.
        float facet[12] = {std::numeric_limits<float>::quiet_NaN(), 0, 0};
        for (int k = 3; k < 12; ++k) facet[k] = float(i * 16) + float(k);
        bytes.append(reinterpret_cast<const char*>(facet), sizeof facet);
        bytes.append(2, '\x7F');
    }
    return bytes;
}

const std::string kText =
    "solid a name with solid and facet\n"
    "  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n      vertex 1 0 0\n      vertex 0 1.5e0 -2\n"
    "    endloop\n  endfacet\n"
    "facet normal nan nan nan outer loop vertex 1 2 3 vertex 4 5 6 vertex 7 8 9 endloop endfacet\n"
    "endsolid a name with facet\n";

TEST(Stl, ReadsBinary) {
    const ReadMesh mesh = readStl(binary(3, 3));
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.info.format, "STL binary");
    EXPECT_EQ(mesh.info.faces, 3u);
    EXPECT_EQ(mesh.positions[5], glm::dvec3(16 + 9, 16 + 10, 16 + 11));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}, {6, 7, 8}}));
}

TEST(Stl, ABinaryFileMayBeginWithSolid) {
    for (const char* title : {"solid", "solid model facet normal", "SOLID x\nfacet "}) {
        const ReadMesh mesh = readStl(binary(2, 2, title));
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.info.format, "STL binary");
        // Even when bytes follow, the zeros tell it from text.
        EXPECT_EQ(readStl(binary(2, 2, title) + "more").triangles.size(), 2u);
    }
}

TEST(Stl, ReadsText) {
    const ReadMesh mesh = readStl(kText);
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.info.format, "STL ASCII");
    EXPECT_EQ(mesh.positions,
              (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {0, 1.5, -2}, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}));
}

TEST(Stl, ReadsTextInAnyCaseWithAnyLineEndAndManySolids) {
    std::string upper;
    for (const char c : kText) upper += c == '\n' ? std::string("\r\n") : std::string(1, char(std::toupper(c)));
    for (size_t at; (at = upper.find("NAN")) != std::string::npos;) upper.replace(at, 3, "nan");
    const ReadMesh mesh = readStl("\n  " + upper + "solid empty\nendsolid\n" + kText);
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.triangles.size(), 4u);
}

TEST(Stl, TheLastEndsolidMayBeMissing) {
    const ReadMesh mesh = readStl(kText.substr(0, kText.rfind("endsolid")));
    EXPECT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.triangles.size(), 2u);
}

TEST(Stl, EveryTruncationOfABinaryFileNamesFacetAndByte) {
    const std::string bytes = binary(3, 3);
    for (size_t length = 0; length < bytes.size(); ++length) {
        const ReadMesh mesh = readStl(std::string_view(bytes).substr(0, length));
        ASSERT_TRUE(mesh.error) << length;
        EXPECT_EQ(mesh.error->element, length < 84 ? "header" : "facet " + std::to_string((length - 84) / 50));
        EXPECT_EQ(mesh.error->byte, length < 84 ? length : 84 + (length - 84) / 50 * 50);
    }
}

TEST(Stl, EveryTruncationOfATextInsideAFacetIsAnError) {
    const size_t secondFacet = kText.find("facet normal nan");
    const size_t end = kText.rfind("endfacet") + 8;
    for (size_t length = 0; length < kText.size(); ++length) {
        const ReadMesh mesh = readStl(std::string_view(kText).substr(0, length));
        if (length > secondFacet && length < end) {
            EXPECT_TRUE(mesh.error) << length;
        }
        if (!mesh.error) {
            EXPECT_LE(mesh.triangles.size(), 2u);
        }
    }
}

TEST(Stl, CountsThatLieAreFoundBeforeAnythingIsRead) {
    for (const uint32_t declared : {3u, 1000u, 0xFFFFFFFFu}) {
        const auto opened = openStl(ByteSource::fromMemory(binary(2, declared), "mesh"));
        ASSERT_FALSE(opened.ok());
        EXPECT_EQ(opened.error().element, "facet 2");
        EXPECT_EQ(opened.error().byte, 184u);
    }
    EXPECT_NE(readStl(binary(2, 0)).line().find("has no facets"), std::string::npos);
    EXPECT_NE(readStl("solid x\nendsolid x\n").line().find("has no facets"), std::string::npos);
}

TEST(Stl, AFileLongerThanItsCountCanSayIsRefused) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "longer_than_its_count.stl";
    const std::string bytes = binary(2, 2);
    std::ofstream(path, std::ios::binary) << bytes;
    const auto openAt = [&](uint64_t length) {
        std::filesystem::resize_file(path, length);  // what is added takes no room on the disk
        auto source = ByteSource::open(path);
        return openStl(std::move(*source));
    };
    const uint64_t most = 84 + 50 * uint64_t{0xffffffff};
    EXPECT_TRUE(openAt(most).ok());
    const auto longer = openAt(most + 50);
    std::filesystem::remove(path);
    ASSERT_FALSE(longer.ok());
    EXPECT_EQ(longer.error().code, ErrorCode::Limit);
    EXPECT_NE(longer.error().line().find("room for 4294967296 facets"), std::string::npos) << longer.error().line();
}

TEST(Stl, APositionThatIsNotFiniteNamesFacetVertexAndByte) {
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
        std::string bytes = binary(3, 3);
        const size_t vertex = 84 + 50 + 12 + 24;  // the last of facet 1
        std::memcpy(bytes.data() + vertex + 4, &bad, 4);
        const ReadMesh mesh = readStl(bytes);
        ASSERT_TRUE(mesh.error);
        EXPECT_EQ(mesh.error->element, "facet 1, vertex 2");
        EXPECT_EQ(mesh.error->byte, vertex);
    }
    std::string text = kText;
    const size_t at = text.find("8 9 endloop");
    const ReadMesh mesh = readStl(text.replace(at, 1, "inf"));
    ASSERT_TRUE(mesh.error);
    EXPECT_EQ(mesh.error->element, "facet 1, vertex 2");
    EXPECT_EQ(mesh.error->byte, at);
}

TEST(Stl, WordsThatDoNotBelongAreNamed) {
    for (const auto& [word, other] : {std::pair{"vertex 4", "vertices 4"},
                                      {"outer loop vertex 1", "vertex 1"},
                                      {"4 5 6", "4 5"},
                                      {"4 5 6", "4 5 6 7"},
                                      {"4 5 6", "4 5 b"},
                                      {"endloop endfacet", "endfacet"},
                                      {"endsolid", "end"},
                                      {"solid a", "sold a"}}) {
        std::string text = kText;
        text.replace(text.find(word), std::strlen(word), other);
        const ReadMesh mesh = readStl(text);
        ASSERT_TRUE(mesh.error) << other;
        EXPECT_TRUE(mesh.error->byte) << mesh.line();
    }
}

TEST(Stl, ReadsMoreThanAChunk) {
    const ReadMesh mesh = test::readAll(openStl(ByteSource::fromMemory(binary(100'000, 100'000), "mesh")));
    ASSERT_FALSE(mesh.error) << mesh.line();
    ASSERT_EQ(mesh.triangles.size(), 100'000u);
    EXPECT_EQ(mesh.triangles.back(), (Triangle{299'997, 299'998, 299'999}));
}

TEST(Stl, EverySingleBitFlipIsReadOrRefused) {
    for (const std::string& text : {kText, binary(2, 2)})
        for (size_t bit = 0; bit < 8 * text.size(); ++bit) {
            std::string flipped = text;
            flipped[bit / 8] = char(flipped[bit / 8] ^ (1 << bit % 8));
            const ReadMesh mesh = test::readAll(openStl(ByteSource::fromMemory(flipped, "mesh", 16)));
            EXPECT_EQ(mesh.line().find('\n'), std::string::npos) << mesh.line();
        }
}

}  // namespace
}  // namespace vcp
