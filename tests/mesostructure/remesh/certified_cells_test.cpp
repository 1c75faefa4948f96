// Cells with a certified error: nothing in the picture is farther off than is allowed, nothing gapes, and the choice is
// the view's alone.
#include "mesostructure/remesh/certified_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/solids.h"
#include "tests/support/remesh_errors.h"
#include "tests/support/remeshed_views.h"

namespace vcp::meso {
namespace {

using glm::dvec2, glm::dvec3;
using test::lookFrom, test::openEdges;

RemeshSurface surfaceOf(std::string_view base, double tiles, double height, std::string_view heights, int texels = 64) {
    auto levels = std::make_shared<HeightLevels>(
        *HeightLevels::build(*makeHeightField(heights, texels, 1), {.fit = LevelFit::Averaged}));
    return *buildRemeshSurface(*makeBaseSurface(base, tiles), std::move(levels), height);
}

CertifiedCells cellsOf(const RemeshSurface& surface) {
    auto made = CertifiedCells::create(surface);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

template <class Real>
RemeshMesh<Real> meshOf(CertifiedCells& cells, const RemeshCamera& camera, const RemeshOptions& options) {
    RemeshMesh<Real> mesh;
    const auto made = remesh(cells, camera, options, mesh);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return mesh;
}

/// Returns by how many pixels the mesh is off, at most.
double measured(const RemeshMesh<double>& mesh, const RemeshSurface& surface, const RemeshCamera& camera,
                double allowed, double nearest = 0) {
    std::vector<float> errors{0};
    test::RemeshErrors(surface, camera, mesh, allowed).measure(errors, nearest);
    return double(*std::ranges::max_element(errors));
}

struct Case {
    const char* base;
    double tiles, height;
    const char* heights;
};
// Their maps jump nowhere.
constexpr Case kCases[] = {{"quad", 1, 0.3, "ridged"}, {"quad", 2, 0.02, "blocks"}, {"torus", 3, 0.1, "fbm"}};

TEST(CertifiedCells, NothingIsFartherOffThanCertified) {
    double tightest = 0;
    for (const Case& c : kCases) {
        const RemeshSurface surface = surfaceOf(c.base, c.tiles, c.height, c.heights);
        CertifiedCells cells = cellsOf(surface);
        for (const double allowed : {0.5, 3.0})
            for (const double distance : {1.2, 30.0})
                for (const bool isParallel : {false, true}) {
                    SCOPED_TRACE(std::string(c.base) + " " + c.heights + " from " + std::to_string(distance) +
                                 (isParallel ? ", parallel, " : ", ") + std::to_string(allowed));
                    RemeshCamera camera = lookFrom(glm::normalize(dvec3(0.6, 0.8, 0.9)) * (1 + distance), {}, 500);
                    if (isParallel) camera.isParallel = true, camera.focal = 250 / distance, camera.seen *= distance;
                    const auto mesh = meshOf<double>(cells, camera, {.cell = 1000, .errorPixels = allowed});
                    EXPECT_EQ(mesh.counts.uncertified, 0u);
                    EXPECT_LE(mesh.counts.boundPixels, allowed);
                    const double most = measured(mesh, surface, camera, mesh.counts.boundPixels);
                    EXPECT_LE(most, mesh.counts.boundPixels + 1e-4);
                    tightest = std::max(tightest, most / mesh.counts.boundPixels);
                }
    }
    // The bound is no idle one.
    EXPECT_GT(tightest, 0.8);
}

/// Eyes over the ground, close to it: patches through the eye's plane, and some too near to be certified.
TEST(CertifiedCells, WhatIsCertifiedHoldsFromWithin) {
    const RemeshSurface surface = surfaceOf("quad", 1, 0.2, "ridged");
    CertifiedCells cells = cellsOf(surface);
    for (const double above : {0.02, 0.1, 0.3}) {
        SCOPED_TRACE(above);
        const double ground = 0.2 * surface.heights->height(0, dvec2(0.4, 0.55));
        RemeshCamera camera = lookFrom({-0.2, 0.1, ground + above}, {1, 0.1, 0.1}, 300);
        const auto mesh = meshOf<double>(cells, camera, {.errorPixels = 0.5});
        EXPECT_LE(mesh.counts.boundPixels, 0.5);
        EXPECT_LT(mesh.counts.uncertified, 12u);
        // A patch is 1/2 wide and may be uncertified where the eye is within the box about it.
        EXPECT_LE(measured(mesh, surface, camera, 0.5, 0.75), 0.5);
        EXPECT_LT(mesh.vertices.size(), 400'000u);
    }
}

TEST(CertifiedCells, ClosedSurfacesStayClosed) {
    uint64_t mixed = 0;
    for (const Case& c : {Case{"sphere", 1.5, 0.2, "blocks"}, Case{"torus", 2.7, 0.1, "ridged"},
                          Case{"box", 2, 0.3, "fbm"}, Case{"torus", 12, 0.02, "fbm"}}) {
        const RemeshSurface surface = surfaceOf(c.base, c.tiles, c.height, c.heights);
        CertifiedCells cells = cellsOf(surface);
        for (int frame = 0; frame < 6; ++frame) {
            SCOPED_TRACE(std::string(c.base) + " " + std::to_string(frame));
            RemeshCamera camera = lookFrom(glm::normalize(dvec3(1, 0.1 * frame, 0.7)) * (1.9 + 0.7 * frame), {}, 120);
            // All of it is seen, so that none of it is culled; but of one half of it more is known.
            camera.seen = frame % 2 == 0 ? glm::dvec4(-1e9, -1e9, 1e9, 1e9) : glm::dvec4(-9, -9, 9, 9);
            camera.picture = glm::dvec4(-0.5, -0.5, 0, 0.5);
            const auto mesh = meshOf<float>(cells, camera, {.cell = 1000, .errorPixels = 0.7});
            if (mesh.counts.culled > 0) continue;
            EXPECT_EQ(openEdges(mesh), 0u);
            EXPECT_GT(mesh.vertices.size(), 100u);
            for (size_t i = 0; i < cells.patches().triangles.size(); ++i) {
                const glm::ivec3 parts = cells.cells(i).parts;
                mixed += std::max({parts.x, parts.y, parts.z}) >= 4 * std::min({parts.x, parts.y, parts.z});
            }
        }
    }
    EXPECT_GT(mixed, 100u);
}

TEST(CertifiedCells, LargerErrorsMakeFewerTriangles) {
    const RemeshSurface surface = surfaceOf("quad", 2, 0.2, "fbm", 256);
    CertifiedCells cells = cellsOf(surface);
    const RemeshCamera camera = lookFrom({1.2, 1.6, 1.4}, {0, 0, 0}, 600);
    size_t before = ~size_t{0};
    for (const double allowed : {0.25, 0.5, 1.0, 2.0}) {
        const auto mesh = meshOf<float>(cells, camera, {.cell = 1000, .errorPixels = allowed});
        EXPECT_LT(mesh.indices.size(), before * 3 / 4) << allowed;
        before = mesh.indices.size();
    }
}

/// A map that is flat but for one corner needs cells there alone.
TEST(CertifiedCells, CellsAreFineWhereTheMapIsSteep) {
    std::vector<uint16_t> heights(256 * 256, 1000);
    for (int j = 100; j < 120; ++j)
        for (int i = 40; i < 60; ++i) heights[size_t(i + 256 * j)] = uint16_t((i * 7919 + j * 104729) % 65536);
    const HeightMap map{{256, 256}, 1, std::move(heights)};
    auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(map, {.fit = LevelFit::Averaged}));
    const RemeshSurface surface = *buildRemeshSurface(*makeBaseSurface("quad", 1), std::move(levels), 0.1);
    CertifiedCells cells = cellsOf(surface);
    const RemeshCamera camera = lookFrom({0.5, 0.6, 2}, {0, 0, 0}, 600);
    const auto mesh = meshOf<double>(cells, camera, {.cell = 1000, .errorPixels = 0.5});
    size_t inside = 0;
    for (const auto& vertex : mesh.vertices)
        inside += vertex.uv.x > 0.1 && vertex.uv.x < 0.3 && vertex.uv.y > 0.35 && vertex.uv.y < 0.5;
    EXPECT_GT(inside, 500u);
    // Patches around it are smaller, too.
    EXPECT_GT(inside, mesh.vertices.size() * 3 / 4);
    EXPECT_LE(measured(mesh, surface, camera, 0.5), 0.5);
}

TEST(CertifiedCells, TheChoiceIsTheViewsAlone) {
    const RemeshSurface surface = surfaceOf("torus", 4, 0.05, "fbm", 32);
    CertifiedCells cells = cellsOf(surface), fresh = cellsOf(surface);
    const RemeshOptions options{.cell = 3, .errorPixels = 0.5};
    const RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 300);
    for (int i = 0; i < 70; ++i)
        static_cast<void>(meshOf<float>(cells, lookFrom({3 - 0.05 * i, 2, 2.5}, {0, 0.01 * i, 0}, 150), options));
    const auto a = meshOf<float>(cells, camera, options), b = meshOf<float>(fresh, camera, options);
    EXPECT_EQ(a.indices, b.indices);
    EXPECT_EQ(a.counts.boundPixels, b.counts.boundPixels);
}

/// Triangles of tiles are the picture's.
TEST(CertifiedCells, TilesOfAPictureAgree) {
    const RemeshSurface surface = surfaceOf("sphere", 3, 0.1, "ridged");
    CertifiedCells cells = cellsOf(surface);
    RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 300);
    const RemeshOptions options{.cell = 4, .errorPixels = 0.5};
    const auto triangles = [&] {
        std::set<std::array<std::array<float, 3>, 3>> all;
        const auto mesh = meshOf<float>(cells, camera, options);
        for (size_t i = 0; i < mesh.indices.size(); i += 3) {
            std::array<std::array<float, 3>, 3> corners;
            for (size_t k = 0; k < 3; ++k) {
                const auto& p = mesh.vertices[mesh.indices[i + k]].position;
                corners[k] = {p.x, p.y, p.z};
            }
            all.insert(corners);
        }
        return all;
    };
    const auto whole = triangles();
    camera.picture = camera.seen;
    size_t sum = 0;
    for (const double left : {-0.6, 0.0}) {
        camera.seen.x = left, camera.seen.z = left + 0.6;
        const auto tile = triangles();
        sum += tile.size();
        EXPECT_TRUE(std::ranges::includes(whole, tile));
        EXPECT_LT(tile.size(), whole.size());
    }
    EXPECT_GE(sum, whole.size());
}

/// Along the rims of a cylinder, and where 1.3 tiles go round it, the map jumps: no cells take that away.
TEST(CertifiedCells, JumpsOfTheMapAreNotRefinedForever) {
    const RemeshSurface surface = surfaceOf("cylinder", 1.3, 0.3, "fbm");
    CertifiedCells cells = cellsOf(surface);
    const RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 1000);
    const auto mesh = meshOf<float>(cells, camera, {.cell = 8, .errorPixels = 0.5});
    EXPECT_GT(mesh.counts.uncertified, 10u);
    EXPECT_LT(mesh.counts.uncertified, cells.patches().triangles.size() / 2);
    EXPECT_LE(mesh.counts.boundPixels, 0.5);
    EXPECT_LT(mesh.vertices.size(), 600'000u);
    EXPECT_EQ(openEdges(mesh), 0u);
}

/// From so far that cells may be narrower than what is allowed, jumps are walls, which are certified as well.
TEST(CertifiedCells, DistantJumpsAreWalls) {
    const RemeshSurface surface = surfaceOf("cylinder", 1.3, 0.3, "fbm");
    CertifiedCells cells = cellsOf(surface);
    const RemeshCamera camera = lookFrom(dvec3(3, 2, 2.5) * 8.0, {0, 0, 0}, 500);
    const auto mesh = meshOf<double>(cells, camera, {.cell = 4, .errorPixels = 0.5});
    // A patch as narrow as a finest cell is all wall, of which the lower part is its neighbours'.
    EXPECT_LE(mesh.counts.uncertified, 2u);
    EXPECT_LE(mesh.counts.boundPixels, 0.5);
    EXPECT_LE(measured(mesh, surface, camera, 0.5), 0.5);
    EXPECT_EQ(openEdges(mesh), 0u);
}

/// A cliff of the whole range between two texels, on triangles that are long and narrow in the map, whose corners lie
/// between texels: no cells keep half a pixel at the same place of the base.
TEST(CertifiedCells, CliffsAreCertified) {
    std::vector<uint16_t> heights(64 * 64, 0);
    for (int j = 0; j < 64; ++j)
        for (int i = 0; i < 64; ++i)
            if (i + 2 * j > 40 && 3 * i + j < 70) heights[size_t(i + 64 * j)] = uint16_t(60000 + 300 * (i % 7));
    const HeightMap map{{64, 64}, 1, std::move(heights)};
    auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(map, {.fit = LevelFit::Averaged}));
    const dvec2 low(0.03, 0.02), high(0.13, 0.91);
    BaseSurface base{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
    base.uvs = {{low, dvec2(high.x, low.y), high}, {low, high, dvec2(low.x, high.y)}};
    for (const bool isWide : {false, true}) {
        SCOPED_TRACE(isWide);
        if (isWide)
            for (auto& uvs : base.uvs)
                for (dvec2& uv : uvs) uv.x *= 6;
        const RemeshSurface surface = *buildRemeshSurface(base, levels, 0.8);
        CertifiedCells cells = cellsOf(surface);
        const RemeshCamera camera = lookFrom({4, -1.4, 2.4}, {0.5, 0.5, 0.2}, 300);
        const auto mesh = meshOf<double>(cells, camera, {.cell = 1, .errorPixels = 0.5});
        EXPECT_EQ(mesh.counts.uncertified, 0u);
        EXPECT_LE(mesh.counts.boundPixels, 0.5);
        EXPECT_LE(measured(mesh, surface, camera, 0.5), 0.5);
        EXPECT_LT(mesh.vertices.size(), 150'000u);
        EXPECT_GT(mesh.vertices.size(), 1'000u);
    }
}

/// A tetrahedron of which each face has a map of its own, with other texels along the edges than its neighbours.
TEST(CertifiedCells, SeamsOfOtherTexelsStayClosed) {
    const BaseSurface base{{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}},
                           {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
                           {{dvec2(0, 0), dvec2(0.5, 0), dvec2(0, 0.5)},
                            {dvec2(0.6, 0.6), dvec2(0.7, 0.6), dvec2(0.6, 0.63)},
                            {dvec2(0.1, 0.9), dvec2(0.9, 0.93), dvec2(0.4, 0.1)},
                            {dvec2(0.31, 0.2), dvec2(0.3, 0.9), dvec2(0.9, 0.3)}}};
    auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(*makeHeightField("fbm", 128, 1)));
    const RemeshSurface surface = *buildRemeshSurface(base, std::move(levels), 0.3);
    EXPECT_EQ(surface.seamUvs.size(), 12u);
    CertifiedCells cells = cellsOf(surface);
    for (const double distance : {3.0, 6.0, 60.0}) {
        const auto mesh = meshOf<float>(cells, lookFrom(glm::normalize(dvec3(0.3, 0.8, 0.5)) * distance, {}, 400),
                                        {.errorPixels = 0.5});
        ASSERT_EQ(mesh.counts.culled, 0u);
        EXPECT_EQ(openEdges(mesh), 0u) << distance;
    }
}

TEST(CertifiedCells, MeasuringThatIsSharedOutOrCancelledChangesNothing) {
    const RemeshSurface surface = surfaceOf("torus", 2, 0.2, "ridged");
    const RemeshCamera camera = lookFrom({2, 1, 1.5}, {}, 400);
    CertifiedCells alone = cellsOf(surface), shared = cellsOf(surface), cancelled = cellsOf(surface);
    const auto expected = meshOf<float>(alone, camera, {.errorPixels = 0.5});
    const auto isExpected = [&](const RemeshMesh<float>& mesh) {
        return mesh.indices == expected.indices && mesh.counts.boundPixels == expected.counts.boundPixels &&
               mesh.counts.uncertified == expected.counts.uncertified &&
               std::ranges::equal(mesh.vertices, expected.vertices, [](const auto& a, const auto& b) {
                   return a.position == b.position && a.triangle == b.triangle && a.uv == b.uv;
               });
    };
    size_t ranges = 0;
    const auto inThreads = [&](size_t count, const std::function<void(size_t first, size_t last)>& fill) {
        std::vector<std::thread> threads;
        for (size_t first = 0; first < count; first += count / 5 + 1, ++ranges)
            threads.emplace_back([&fill, first, count] { fill(first, std::min(count, first + count / 5 + 1)); });
        for (std::thread& thread : threads) thread.join();
        return true;
    };
    EXPECT_TRUE(isExpected(meshOf<float>(shared, camera, {.errorPixels = 0.5, .shareOut = inThreads})));
    EXPECT_EQ(ranges, 5u);
    // What was measured until then stays known, and nothing was chosen.
    const auto halfway = [](size_t count, const std::function<void(size_t first, size_t last)>& fill) {
        fill(count / 4, count / 2);
        return false;
    };
    RemeshMesh<float> none;
    const auto refused = remesh(cancelled, camera, {.errorPixels = 0.5, .shareOut = halfway}, none);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::Cancelled);
    EXPECT_TRUE(none.vertices.empty());
    EXPECT_TRUE(isExpected(meshOf<float>(cancelled, camera, {.errorPixels = 0.5})));
}

/// A distant view of a repeated tile: patches that repeat are measured once.
TEST(CertifiedCells, DistantViewsLookAtFewTexels) {
    const auto viewed = [](double tiles, int texels, std::string_view heights) {
        const RemeshSurface surface = surfaceOf("quad", tiles, 0.1, heights, texels);
        CertifiedCells cells = cellsOf(surface);
        const auto first = meshOf<double>(cells, lookFrom({0.2, 0.3, 4}, {}, 300), {.errorPixels = 0.5});
        EXPECT_LE(first.counts.boundPixels, 0.5);
        EXPECT_GT(first.counts.looked, 0u);
        // What is known is not looked at again.
        const auto again = meshOf<double>(cells, lookFrom({0.2, 0.3, 4}, {}, 300), {.errorPixels = 0.5});
        EXPECT_EQ(again.counts.looked, 0u);
        EXPECT_EQ(again.indices, first.indices);
        return first.counts;
    };
    const RemeshCounts four = viewed(4, 512, "fbm");
    // Sixteen tiles of 512^2 texels; patches of a tile are seen from different depths.
    EXPECT_LT(four.looked, uint64_t{16} * 512 * 512 / 4);
}

/// `blocks` with many tiles has too many small patches, so that it is cut a second time.
TEST(CertifiedCells, CuttingTellsHowFarItIsAndIsCancelled) {
    for (const double tiles : {1.0, 6.0}) {
        const RemeshSurface surface = surfaceOf("quad", tiles, 0.2, "blocks", 256);
        std::vector<double> told;
        const auto all = CertifiedCells::create(surface, [&](double part) {
            told.push_back(part);
            return true;
        });
        ASSERT_TRUE(all);
        EXPECT_GE(told.size(), 8u);
        EXPECT_TRUE(std::ranges::is_sorted(told));
        EXPECT_GE(told.front(), 0);
        EXPECT_EQ(told.back(), 1);
        EXPECT_TRUE(std::ranges::any_of(told, [](double part) { return part > 0.2 && part < 0.5; }));
        for (const size_t most : {size_t{1}, told.size() / 2, told.size()}) {
            size_t calls = 0;
            const auto cancelled = CertifiedCells::create(surface, [&](double) { return ++calls < most; });
            ASSERT_FALSE(cancelled);
            EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
            EXPECT_EQ(calls, most);
        }
    }
}

TEST(CertifiedCells, RefuseWhatTheyCannotCut) {
    BaseSurface base{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {{dvec2(0), dvec2(1e12, 0), dvec2(0, 1e12)}}};
    auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(*makeHeightField("fbm", 16, 1)));
    const auto refused = CertifiedCells::create(*buildRemeshSurface(base, std::move(levels), 0.2));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::Limit);
    const RemeshSurface surface = surfaceOf("quad", 1, 0.2, "fbm");
    CertifiedCells cells = cellsOf(surface);
    RemeshMesh<float> mesh;
    for (const double wrong : {-1.0, std::nan(""), HUGE_VAL})
        EXPECT_EQ(remesh(cells, lookFrom({1, 1, 1}, {}, 100), {.errorPixels = wrong}, mesh).error().code,
                  ErrorCode::Usage);
    EXPECT_EQ(remesh(cells, lookFrom({1, 1, 1}, {}, 100), {.cell = 0, .errorPixels = 1}, mesh).error().code,
              ErrorCode::Usage);
    EXPECT_EQ(remesh(cells, lookFrom({1, 1, 1}, {}, 400), {.errorPixels = 0.01}, mesh, 1000).error().code,
              ErrorCode::Limit);
}

}  // namespace
}  // namespace vcp::meso
