#include "mesostructure/base/decimation.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"
#include "mesostructure/base/surface_edges.h"
#include "tests/mesostructure/base/surfaces.h"

namespace vcp::meso {
namespace {

using namespace test;
using glm::dvec2, glm::dvec3;

BaseSurface coarser(const BaseSurface& surface, size_t triangles) {
    auto made = decimated(surface, {.triangles = triangles});
    EXPECT_TRUE(made) << made.error().line();
    return made ? *std::move(made) : BaseSurface();
}

/// The largest distance from samples of `from` to `to`, by the benchmarks' oracle.
double distance(const BaseSurface& from, const BaseSurface& to) {
    const IndexedMesh mesh{to.positions, to.triangles, {}};
    const MeshBvh bvh(mesh);
    double most = 0;
    constexpr int kSteps = 6;
    for (const auto& t : from.triangles)
        for (int i = 0; i <= kSteps; ++i)
            for (int j = 0; i + j <= kSteps; ++j) {
                const dvec3 p = (double(i) * from.positions[t[0]] + double(j) * from.positions[t[1]] +
                                 double(kSteps - i - j) * from.positions[t[2]]) /
                                double(kSteps);
                most = std::max(most, bvh.nearestPoint(p)->distance);
            }
    return most;
}

dvec3 crossOf(const BaseSurface& s, size_t i) {
    const auto& t = s.triangles[i];
    return glm::cross(s.positions[t[1]] - s.positions[t[0]], s.positions[t[2]] - s.positions[t[0]]);
}

double areaOf(const BaseSurface& s) {
    double area = 0;
    for (size_t i = 0; i < s.triangles.size(); ++i) area += 0.5 * glm::length(crossOf(s, i));
    return area;
}

int64_t euler(const BaseSurface& s) {
    const SurfaceEdges edges = *edgesOf(s);
    return int64_t(s.positions.size()) - int64_t(edges.all) + int64_t(edges.triangles);
}

TEST(Decimation, WhatCountsMoreKeepsMoreTriangles) {
    BaseSurface sphere = shape("sphere");
    sphere.uvs.clear();
    const auto above = [](const BaseSurface& s) {
        return std::ranges::count_if(s.triangles, [&](const auto& t) {
            return s.positions[t[0]].z + s.positions[t[1]].z + s.positions[t[2]].z > 0;
        });
    };
    std::vector<float> weights;
    for (const auto& t : sphere.triangles)
        weights.push_back(sphere.positions[t[0]].z + sphere.positions[t[1]].z > 0 ? 64.0f : 1.0f);
    const auto even = decimated(sphere, {.triangles = 200});
    const auto above64 = decimated(sphere, {.triangles = 200, .weights = weights});
    ASSERT_TRUE(even && above64);
    EXPECT_NEAR(double(above(*even)), 100, 15);
    EXPECT_GT(above(*above64), 140);
    EXPECT_EQ(edgesOf(*above64)->border, 0u);
}

TEST(Decimation, AClosedSurfaceStaysClosedAndNear) {
    BaseSurface sphere = shape("sphere"), torus = shape("torus");
    sphere.uvs.clear(), torus.uvs.clear();
    for (const BaseSurface& surface : {sphere, torus}) {
        const BaseSurface made = coarser(surface, 600);
        const SurfaceEdges edges = *edgesOf(made);
        EXPECT_EQ(edges.triangles, 600u);
        EXPECT_EQ(edges.border, 0u);
        EXPECT_EQ(edges.parts, 1u);
        EXPECT_EQ(euler(made), euler(surface));
        // The edges are a fifth of the radius of the sphere, and nearly half of that of the torus' tube.
        EXPECT_LT(distance(made, surface), 0.05);
        EXPECT_LT(distance(surface, made), 0.05);
    }
}

TEST(Decimation, NormalsKeepTheirSide) {
    BaseSurface sphere = shape("sphere");
    sphere.uvs.clear();
    const BaseSurface made = coarser(sphere, 100);
    for (size_t i = 0; i < made.triangles.size(); ++i) {
        const auto& t = made.triangles[i];
        const dvec3 middle = (made.positions[t[0]] + made.positions[t[1]] + made.positions[t[2]]) / 3.0;
        EXPECT_GT(glm::dot(glm::normalize(crossOf(made, i)), glm::normalize(middle)), 0.5) << i;
    }
}

TEST(Decimation, WhatIsLeftArePositionsOfTheMesh) {
    const BaseSurface surface = both(square(12, 0.1), square(0 + 9, 0.2), {5e5 + 1.0 / 3, 4.5e6 + 1.0 / 7, 1});
    const BaseSurface made = coarser(surface, 100);
    for (const dvec3 p : made.positions) EXPECT_NE(std::ranges::find(surface.positions, p), surface.positions.end());
    EXPECT_EQ(edgesOf(made)->parts, 2u);
}

TEST(Decimation, IsTheSameFarFromTheOrigin) {
    BaseSurface near = shape("sphere"), far = near;
    near.uvs.clear(), far.uvs.clear();
    for (dvec3& p : near.positions) p = glm::round(p * 1024.0) / 1024.0;
    far.positions = near.positions;
    for (dvec3& p : far.positions) p += dvec3(0x1p19, 0x1p22, 0);
    EXPECT_EQ(coarser(far, 500).triangles, coarser(near, 500).triangles);
}

TEST(Decimation, AFlatSquareBecomesTwoTriangles) {
    BaseSurface surface = square(24);
    for (const bool isMapped : {false, true}) {
        if (!isMapped) surface.uvs.clear();
        const BaseSurface made = coarser(isMapped ? square(24) : surface, 2);
        EXPECT_EQ(made.triangles.size(), 2u);
        EXPECT_NEAR(areaOf(made), 1, 1e-12);
        for (size_t i = 0; i < made.uvs.size(); ++i)
            for (int k = 0; k < 3; ++k) EXPECT_EQ(made.uvs[i][k], dvec2(made.positions[made.triangles[i][k]]));
    }
}

TEST(Decimation, SeamsOfTheMapStay) {
    // Six charts, each a side: what is left of them maps each side to its square, to scale.
    const BaseSurface surface = shape("box"), made = coarser(surface, 12);
    EXPECT_EQ(made.triangles.size(), 12u);
    ASSERT_EQ(made.uvs.size(), made.triangles.size());
    EXPECT_EQ(edgesOf(made)->border, 0u);
    EXPECT_EQ(edgesOf(made)->seams, 12u);
    EXPECT_NEAR(areaOf(made), 24, 1e-12);
    for (size_t i = 0; i < made.triangles.size(); ++i) {
        const dvec2 a = made.uvs[i][1] - made.uvs[i][0], b = made.uvs[i][2] - made.uvs[i][0];
        EXPECT_NEAR(4 * (a.x * b.y - a.y * b.x), glm::length(crossOf(made, i)), 1e-12) << i;
    }
    // Part of the way each corner still has the coordinates that it has on that side.
    const BaseSurface half = coarser(surface, 700);
    std::map<std::array<double, 3>, std::vector<dvec2>> known;
    for (size_t i = 0; i < surface.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const dvec3 p = surface.positions[surface.triangles[i][k]];
            known[{p.x, p.y, p.z}].push_back(surface.uvs[i][k]);
        }
    for (size_t i = 0; i < half.triangles.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            const dvec3 p = half.positions[half.triangles[i][k]];
            EXPECT_NE(std::ranges::find(known[{p.x, p.y, p.z}], half.uvs[i][k]), (known[{p.x, p.y, p.z}].end()));
        }
        const dvec2 a = half.uvs[i][1] - half.uvs[i][0], b = half.uvs[i][2] - half.uvs[i][0];
        EXPECT_NEAR(4 * (a.x * b.y - a.y * b.x), glm::length(crossOf(half, i)), 1e-12) << i;
    }
}

TEST(Decimation, StopsWhereTheSurfaceWouldChangeHowItHangsTogether) {
    EXPECT_EQ(coarser(tetrahedron(), 1).triangles.size(), 4u);
    const BaseSurface two = coarser(both(shape("sphere"), shape("sphere"), {4, 0, 0}), 1);
    EXPECT_EQ(edgesOf(two)->parts, 2u);
    EXPECT_EQ(edgesOf(two)->border, 0u);
    BaseSurface torus = shape("torus");
    torus.uvs.clear();
    EXPECT_EQ(euler(coarser(torus, 1)), 0);
}

TEST(Decimation, SaysWhatItRefusesAndCanBeCancelled) {
    EXPECT_EQ(decimated({}, {}).error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(decimated({{{0, 0, 0}}, {{0, 0, 0}}, {}}, {}).error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(decimated(doubleCone(5000), {}).error().code, ErrorCode::Limit);
    BaseSurface fin = tetrahedron();
    fin.triangles.push_back({0, 1, 2});
    EXPECT_NE(decimated(fin, {}).error().line().find("triangles meet"), std::string::npos);
    int calls = 0;
    double last = 0;
    DecimationOptions options{.triangles = 100, .progress = [&](double fraction) {
                                  EXPECT_GE(fraction, last);
                                  EXPECT_LE(fraction, 1);
                                  last = fraction;
                                  return ++calls < 3;
                              }};
    EXPECT_EQ(decimated(shape("sphere"), options).error().code, ErrorCode::Cancelled);
    EXPECT_EQ(calls, 3);
}

TEST(Decimation, TrianglesWithoutAreaDoNotHoldItUp) {
    BaseSurface surface = square(8);
    surface.uvs.clear();
    for (dvec3& p : surface.positions)
        if (p.x > 0.4 && p.x < 0.7) p.x = 0.5;
    const BaseSurface made = coarser(surface, 2);
    EXPECT_LE(made.triangles.size(), 16u);
    EXPECT_NEAR(areaOf(made), 1, 1e-12);
}

}  // namespace
}  // namespace vcp::meso
