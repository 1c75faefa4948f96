// Triangles and their vertices joined in any memory, against a direct join.
#include "builder/vertex_join.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

// Fewer vertices than this are never spilled, whatever the memory.
constexpr uint32_t kLeastResident = 1 << 16;

struct Indexed {
    std::vector<glm::dvec3> positions;
    std::vector<uint32_t> colours, normals;
    std::vector<std::array<uint32_t, 3>> triangles, cornerNormals;
    std::vector<std::array<glm::vec2, 3>> uvs;
    std::vector<uint32_t> materials;
};

/// `reach`: how far apart a triangle's vertices may be.
Indexed randomMesh(uint32_t vertices, uint32_t triangles, uint32_t reach, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    Indexed mesh;
    for (uint32_t v = 0; v < vertices; ++v) {
        mesh.positions.emplace_back(unit(random), double(v), unit(random));
        mesh.colours.push_back(uint32_t(random()));
        mesh.normals.push_back(v % 5 == 0 ? kUnknownNormal : uint32_t(random()) | 4u);
    }
    for (uint32_t k = 0; k < triangles; ++k) {
        const uint64_t base = random() % vertices;
        std::array<uint32_t, 3> t{};
        for (uint32_t& v : t) v = uint32_t((base + random() % reach) % vertices);
        mesh.triangles.push_back(t);
        mesh.uvs.push_back({glm::vec2(float(k), 0), glm::vec2(0, float(k)), glm::vec2(0.5f)});
        mesh.materials.push_back(k % 7);
        mesh.cornerNormals.push_back({k % 3 == 0 ? kUnknownNormal : k | 4u, kUnknownNormal, k | 8u});
    }
    return mesh;
}

using World = WorldTriangle<double>;

bool less(const World& a, const World& b) { return std::memcmp(&a, &b, sizeof a) < 0; }

std::vector<World> directJoin(const Indexed& mesh, bool withColour, bool withUv, uint32_t materialBase) {
    std::vector<World> joined;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        World t{};
        for (int i = 0; i < 3; ++i) {
            const uint32_t v = mesh.triangles[k][i];
            t.corner[i] = mesh.positions[v];
            t.colour[i] = withColour ? mesh.colours[v] : 0xffffffffu;
            const uint32_t own = withUv ? mesh.cornerNormals[k][size_t(i)] : kUnknownNormal;
            t.normal[i] = own != kUnknownNormal || !withColour ? own : mesh.normals[v];
            if (withUv) t.uv[i] = mesh.uvs[k][i];
        }
        if (withUv) t.material = materialBase + mesh.materials[k] + 1;
        joined.push_back(t);
    }
    std::sort(joined.begin(), joined.end(), less);
    return joined;
}

class Join : public ::testing::Test {
protected:
    /// How a file brings its parts: vertices and triangles in chunks, the one before the other or in turns.
    enum class Order { VerticesFirst, TrianglesFirst, InTurns };

    Result<std::vector<World>> join(const Indexed& mesh, Order order, uint64_t vertexBytes, uint64_t seed,
                                    bool withColour = true, bool withUv = true) {
        std::filesystem::remove_all(folder_ / "temp");  // what one that failed left
        TempSpace space(folder_ / "temp", vertexBytes > 1 << 22 ? 1 << 30 : 0);
        std::vector<World> joined;
        VertexJoin join(space, vertexBytes, [&](const World& t) {
            joined.push_back(t);
            return Result<void>();
        });
        std::mt19937_64 random(seed);
        size_t v = 0, k = 0;
        while (v < mesh.positions.size() || k < mesh.triangles.size()) {
            MeshChunk chunk;
            const bool wantsVertices = order == Order::VerticesFirst ? v < mesh.positions.size()
                                       : order == Order::InTurns     ? true
                                                                     : k == mesh.triangles.size();
            const bool wantsTriangles = order == Order::TrianglesFirst ? k < mesh.triangles.size()
                                        : order == Order::InTurns      ? true
                                                                       : v == mesh.positions.size();
            if (wantsVertices)
                for (size_t end = std::min(mesh.positions.size(), v + 1 + random() % 60000); v < end; ++v) {
                    chunk.positions.push_back(mesh.positions[v]);
                    if (!withColour) continue;
                    chunk.colours.push_back(mesh.colours[v]);
                    chunk.normals.push_back(mesh.normals[v]);
                }
            if (wantsTriangles)
                for (size_t end = std::min(mesh.triangles.size(), k + 1 + random() % 60000); k < end; ++k) {
                    chunk.triangles.push_back({mesh.triangles[k][0], mesh.triangles[k][1], mesh.triangles[k][2]});
                    if (!withUv) continue;
                    chunk.uvs.push_back(mesh.uvs[k]);
                    chunk.materials.push_back(mesh.materials[k]);
                    chunk.cornerNormals.push_back(mesh.cornerNormals[k]);
                }
            VCP_TRY(join.add(chunk, 100));
        }
        VCP_TRY(join.finish("mesh.ply"));
        EXPECT_EQ(join.vertices(), mesh.positions.size());
        EXPECT_EQ(space.diskBytes(), 0u) << "what was joined is given back";
        space.folder().remove();
        std::sort(joined.begin(), joined.end(), less);
        return joined;
    }

    void expectJoined(const Indexed& mesh, Order order, uint64_t vertexBytes, uint64_t seed, bool withColour = true,
                      bool withUv = true) {
        const auto have = join(mesh, order, vertexBytes, seed, withColour, withUv);
        ASSERT_TRUE(have.ok()) << have.error().line();
        const std::vector<World> want = directJoin(mesh, withColour, withUv, 100);
        ASSERT_EQ(have->size(), want.size());
        ASSERT_EQ(std::memcmp(have->data(), want.data(), want.size() * sizeof(World)), 0) << "seed " << seed;
    }

    TestFolder folder_{"vcp_vertex_join_test"};
};

TEST_F(Join, FitsMemory) {
    const Indexed mesh = randomMesh(20000, 50000, 20000, 1);
    for (const Order order : {Order::VerticesFirst, Order::TrianglesFirst, Order::InTurns})
        expectJoined(mesh, order, uint64_t{1} << 30, 1);
}

TEST_F(Join, ManyChunks) {
    // Five and a half chunks; triangles that stay near, and triangles that span all of them.
    for (const uint32_t reach : {50u, 5 * kLeastResident})
        for (const Order order : {Order::VerticesFirst, Order::TrianglesFirst, Order::InTurns}) {
            const Indexed mesh = randomMesh(5 * kLeastResident + 30000, 200000, reach, reach);
            expectJoined(mesh, order, 0, reach);
        }
}

TEST_F(Join, ChunksThatEndExactly) {
    for (const uint32_t vertices : {kLeastResident, kLeastResident + 1, 2 * kLeastResident, 2 * kLeastResident - 1})
        expectJoined(randomMesh(vertices, 20000, vertices, vertices), Order::TrianglesFirst, 0, vertices);
}

TEST_F(Join, WithoutColourAndTexture) {
    const Indexed mesh = randomMesh(100000, 20000, 100000, 8);
    expectJoined(mesh, Order::TrianglesFirst, 0, 8, false, false);
    expectJoined(mesh, Order::VerticesFirst, 0, 8, false, true);
}

TEST_F(Join, VerticesThatNeverCame) {
    for (const uint32_t vertices : {10u, kLeastResident, 3 * kLeastResident + 5})
        for (const uint32_t wrong : {vertices, vertices + 1, vertices + 7 * kLeastResident, 0xffffffffu})
            for (const Order order : {Order::VerticesFirst, Order::TrianglesFirst}) {
                Indexed mesh = randomMesh(vertices, 1000, vertices, vertices);
                mesh.triangles[500][1] = wrong;
                const auto joined = join(mesh, order, 0, 1);
                ASSERT_FALSE(joined.ok()) << vertices << ' ' << wrong;
                EXPECT_EQ(joined.error().code, ErrorCode::InvalidInput);
                EXPECT_NE(joined.error().line().find("a vertex that the file does not have"), std::string::npos)
                    << joined.error().line();
                EXPECT_NE(joined.error().line().find("mesh.ply"), std::string::npos) << joined.error().line();
            }
}

TEST_F(Join, VerticesThatComeBackDamaged) {
    const Indexed mesh = randomMesh(3 * kLeastResident + 100, 10, kLeastResident, 1);
    for (const uint64_t vertex : {uint64_t{0}, uint64_t{kLeastResident}, uint64_t{2 * kLeastResident + 99}}) {
        TempSpace space(folder_ / "temp", 0);
        VertexJoin join(space, 0, [](const World&) { return Result<void>(); });
        MeshChunk chunk;
        chunk.positions = mesh.positions;
        chunk.triangles.push_back({0, 1, 3 * kLeastResident + 99});
        ASSERT_TRUE(join.add(chunk, 0).ok());
        std::fstream file(folder_ / "temp" / "vertices.spill", std::ios::in | std::ios::out | std::ios::binary);
        file.seekg(std::streamoff(vertex * 32 + 3));
        const int byte = file.get();
        file.seekp(std::streamoff(vertex * 32 + 3));
        file.put(char(byte ^ 4));
        file.close();
        const auto joined = join.finish("mesh.ply");
        ASSERT_FALSE(joined.ok()) << vertex;
        EXPECT_EQ(joined.error().code, ErrorCode::InvalidInput);
        EXPECT_NE(joined.error().line().find("vertices.spill: byte "), std::string::npos) << joined.error().line();
        EXPECT_NE(joined.error().line().find("came back damaged"), std::string::npos) << joined.error().line();
        space.folder().remove();
    }
}

TEST_F(Join, ErrorsOfTheSinkComeThrough) {
    TempSpace space(folder_ / "temp", 1 << 20);
    VertexJoin join(space, 0,
                    [&](const World&) { return Result<void>(Error{.code = ErrorCode::Io, .message = "full"}); });
    MeshChunk chunk;
    chunk.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    chunk.triangles = {{0, 1, 2}};
    const auto result = join.add(chunk, 0);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().message, "full");
}

}  // namespace
}  // namespace vcp
