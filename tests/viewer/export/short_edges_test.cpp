// Triangles parted until their edges are short.
#include "viewer/export/short_edges.h"

#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace vcp {
namespace {

/// A closed box of twelve triangles, so long, so wide and so high.
IndexedMesh box(glm::dvec3 size) {
    IndexedMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.push_back(size * glm::dvec3(i & 1, i >> 1 & 1, i >> 2));
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

double longestEdge(const IndexedMesh& mesh) {
    double longest = 0;
    for (const auto& t : mesh.triangles)
        for (size_t i = 0; i < 3; ++i)
            longest = std::max(longest, glm::distance(mesh.positions[t[i]], mesh.positions[t[(i + 1) % 3]]));
    return longest;
}

/// The area, and the volume that the triangles enclose, which tells how they are turned.
std::pair<double, double> areaAndVolume(const IndexedMesh& mesh) {
    double area = 0, volume = 0;
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto c = mesh.corners(i);
        area += glm::length(glm::cross(c[1] - c[0], c[2] - c[0])) / 2;
        volume += glm::dot(c[0], glm::cross(c[1], c[2])) / 6;
    }
    return {area, volume};
}

/// Whether each edge runs once in each direction: the surface is closed, without a vertex within an edge.
bool isClosed(const IndexedMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    for (const auto& t : mesh.triangles)
        for (size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
        const auto back = edges.find({edge.second, edge.first});
        if (count != 1 || back == edges.end() || back->second != 1) return false;
    }
    return true;
}

TEST(ShortEdges, KeepTheSurface) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> length(0.5, 40);
    for (int seed = 0; seed < 20; ++seed) {
        const IndexedMesh before = box({length(random), length(random), length(random)});
        ASSERT_TRUE(isClosed(before));
        IndexedMesh after = before;
        shortenEdges(after, 1.5, 1'000'000);
        EXPECT_LE(longestEdge(after), 1.5);
        EXPECT_TRUE(isClosed(after)) << seed;
        const auto [area, volume] = areaAndVolume(before);
        const auto [areaAfter, volumeAfter] = areaAndVolume(after);
        EXPECT_NEAR(areaAfter, area, 1e-9 * area);
        EXPECT_NEAR(volumeAfter, volume, 1e-9 * std::abs(volume));
        EXPECT_TRUE(std::equal(before.positions.begin(), before.positions.end(), after.positions.begin()));
    }
}

TEST(ShortEdges, ThatAreShortStay) {
    const IndexedMesh before = box({1, 1, 1});
    IndexedMesh after = before;
    shortenEdges(after, 2, 1'000'000);
    EXPECT_EQ(after.triangles, before.triangles);
    EXPECT_EQ(after.positions, before.positions);
}

TEST(ShortEdges, AreNoMoreThanMayBe) {
    IndexedMesh mesh = box({1, 1, 1});
    shortenEdges(mesh, 1e-6, 5000);
    EXPECT_LE(mesh.triangles.size(), 5000u);
    EXPECT_GT(mesh.triangles.size(), 1000u);
    EXPECT_TRUE(isClosed(mesh));
}

}  // namespace
}  // namespace vcp
