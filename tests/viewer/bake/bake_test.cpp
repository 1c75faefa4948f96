// What is baked against truths in closed form.
#include "viewer/bake/bake.h"

#include <cmath>
#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/asset_file.h"
#include "mesostructure/base/surface_edges.h"
#include "mesostructure/shell.h"
#include "octree/io/byte_reader.h"
#include "tests/support/built_mesh.h"
#include "viewer/bake/coarsened_scan.h"
#include "viewer/bake/displaced_mesh.h"
#include "viewer/scene/base_mesh.h"

namespace vcp {
namespace {

using namespace meso;
using glm::dvec2, glm::dvec3;

double bumpyRadius(dvec3 p) {
    const dvec3 n = glm::normalize(p);
    return 1 + 0.02 * std::sin(5 * n.x) * std::sin(4 * n.y + 1) * std::cos(6 * n.z);
}

/// The most that this surface bends: 1 for the ball, and 0.02 times the squares of 5, 4 and 6 for the bumps.
constexpr double kMostCurvature = 2.6;

/// A sphere of radius 1 with bumps.
IndexedMesh bumpySphere(uint32_t rings) {
    IndexedMesh mesh = test::sphereMesh(dvec3(0), 1, rings);
    for (dvec3& p : mesh.positions) p *= bumpyRadius(p);
    return mesh;
}

double offFormula(dvec3 p) { return std::abs(glm::length(p) - bumpyRadius(p)); }

/// How far facets are from the formula.
double facetsOff(const IndexedMesh& mesh) {
    double most = 0;
    for (uint64_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto p = mesh.corners(i);
        for (int a = 0; a <= 6; ++a)
            for (int b = 0; a + b <= 6; ++b)
                most =
                    std::max(most, offFormula((double(a) * p[0] + double(b) * p[1] + double(6 - a - b) * p[2]) / 6.0));
    }
    return 1.05 * most;
}

/// The longest step of a texel along an edge of the atlas, in the world.
double longestStep(const BaseSurface& base, const TexelMap& map) {
    double most = 0;
    for (size_t i = 0; i < base.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k)
            most = std::max(most, glm::distance(base.positions[base.triangles[i][k]],
                                                base.positions[base.triangles[i][(k + 1) % 3]]) /
                                      map.steps[i]);
    return most;
}

/// An octahedron, each triangle of which is halved along its edges `times` times, on the unit sphere.
BaseSurface roundOctahedron(int times) {
    BaseSurface made{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                     {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}},
                     {}};
    for (int i = 0; i < times; ++i) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [at, isNew] = middles.try_emplace(std::minmax(a, b), uint32_t(made.positions.size()));
            if (isNew) made.positions.push_back(glm::normalize(made.positions[a] + made.positions[b]));
            return at->second;
        };
        std::vector<std::array<uint32_t, 3>> finer;
        for (const auto& t : made.triangles) {
            const uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
            finer.insert(finer.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
        }
        made.triangles = finer;
    }
    return made;
}

/// The open unit square, two triangles with their coordinates.
BaseSurface unitSquare() {
    const std::array<dvec2, 3> a{dvec2(0, 0), {1, 0}, {1, 1}}, b{dvec2(0, 0), {1, 1}, {0, 1}};
    return {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {a, b}};
}

/// A grid z(x, y) over [low, high]^2.
template <class Height>
IndexedMesh sheet(double low, double high, uint32_t n, const Height& height) {
    IndexedMesh mesh;
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
            const double x = low + (high - low) * i / n, y = low + (high - low) * j / n;
            mesh.positions.push_back({x, y, height(x, y)});
        }
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = i + (n + 1) * j, b = a + 1, c = b + n + 1, d = a + n + 1;
            mesh.triangles.push_back({a, b, c}), mesh.triangles.push_back({a, c, d});
        }
    return mesh;
}

struct Baked {
    BaseSurface base;
    TexelMap map;
    BaseFrames frames;
    std::vector<dvec3> directions;
    Result<BakedMaps> maps = BakedMaps();
};

Baked bakeOver(const test::BuiltMesh& scan, const BaseSurface& base, int size, double reach, bool given) {
    Baked made;
    made.base = base;
    made.map = given ? *givenMap(base, size) : *makeAtlas(base, size);
    made.directions = shellDirections(base);
    made.frames = framesOf(base, made.map, made.directions);
    const std::shared_ptr<const ByteReader> reader = *openFile(scan.file());
    made.maps =
        bakeMaps(reader, scan.cache().dataset(), base, made.map, made.frames, made.directions, {.reach = reach});
    return made;
}

/// Calls visit(texel, triangle, weights, point on the base, direction) for each texel of a triangle.
template <class Visit>
size_t forEachTexel(const Baked& of, const Visit& visit) {
    const std::vector<uint32_t> owners = *ownersOf(of.map, 0);
    size_t count = 0;
    for (size_t texel = 0; texel < owners.size(); ++texel) {
        if (owners[texel] == kNoTriangle) continue;
        const dvec2 at(double(texel % size_t(of.map.size)), double(texel / size_t(of.map.size)));
        const dvec3 w = weightsAt(of.map.places[owners[texel]], at);
        dvec3 point(0), direction(0);
        for (int k = 0; k < 3; ++k) {
            const uint32_t corner = of.base.triangles[owners[texel]][k];
            point += w[k] * of.base.positions[corner], direction += w[k] * of.directions[corner];
        }
        visit(texel, owners[texel], w, point, direction);
        ++count;
    }
    return count;
}

double valueOf(const BakedHeights& heights, size_t texel) {
    return heights.offset + heights.range * heights.values[texel] / 65535;
}

TEST(Bake, ABumpySphereOverACoarseOne) {
    const IndexedMesh sphere = bumpySphere(150);
    const test::BuiltMesh scan(sphere, 1.0 / 32);
    ASSERT_TRUE(scan.ok());
    const Baked baked = bakeOver(scan, roundOctahedron(2), 256, 0.2, false);
    ASSERT_TRUE(baked.maps) << baked.maps.error().line();
    const BakedMaps& maps = *baked.maps;
    EXPECT_EQ(maps.shares.height, 1);
    EXPECT_LT(maps.heights.range, 0.2);
    const double bound = facetsOff(sphere) + 0.5 * maps.heights.range / 65535;
    // Along an edge the values of the side with fewer steps hold, and are linear between them.
    const double step = 1.1 * longestStep(baked.base, baked.map), onEdge = bound + kMostCurvature / 8 * step * step;
    EXPECT_LT(onEdge, 2e-3);
    double worst = 0, worstOnEdge = 0, worstNormal = 1;
    const size_t texels = forEachTexel(baked, [&](size_t texel, uint32_t t, dvec3 w, dvec3 point, dvec3 direction) {
        const dvec3 q = point + valueOf(maps.heights, texel) * direction;
        const dvec3 other = point + valueOf(maps.displacement, texel) * glm::normalize(direction);
        double& most = std::min({w.x, w.y, w.z}) > 1e-6 ? worst : worstOnEdge;
        most = std::max({most, offFormula(q), offFormula(other)});
        // The normal of |p| - r(p), by differences.
        dvec3 gradient;
        for (int axis = 0; axis < 3; ++axis) {
            dvec3 little(0);
            little[axis] = 1e-5;
            const auto value = [](dvec3 p) { return glm::length(p) - bumpyRadius(p); };
            gradient[axis] = value(q + little) - value(q - little);
        }
        const dvec3 n = baked.frames.at(t, w) * dvec3(maps.normals[texel]);
        worstNormal = std::min(worstNormal, glm::dot(glm::normalize(n), glm::normalize(gradient)));
    });
    EXPECT_GT(texels, 20'000u);
    EXPECT_LT(worst, bound);
    EXPECT_LT(worstOnEdge, onEdge);
    // Facets are flat: the normal turns along their edges of up to 0.03.
    EXPECT_GT(worstNormal, std::cos(kMostCurvature * 0.03));
    // Nothing depends on the memory that pages have.
    BakeMapsOptions tight{.reach = 0.2, .memoryBytes = kBakeBytesPerTexel * 65536 + (16u << 20)};
    const std::shared_ptr<const ByteReader> reader = *openFile(scan.file());
    const auto again =
        bakeMaps(reader, scan.cache().dataset(), baked.base, baked.map, baked.frames, baked.directions, tight);
    ASSERT_TRUE(again) << again.error().line();
    EXPECT_EQ(again->heights.values, maps.heights.values);
    tight.memoryBytes -= 1;
    const auto less =
        bakeMaps(reader, scan.cache().dataset(), baked.base, baked.map, baked.frames, baked.directions, tight);
    ASSERT_FALSE(less);
    EXPECT_EQ(less.error().code, ErrorCode::Limit);
    tight.memoryBytes += 1;
    tight.progress = [](double) { return false; };
    EXPECT_EQ(bakeMaps(reader, scan.cache().dataset(), baked.base, baked.map, baked.frames, baked.directions, tight)
                  .error()
                  .code,
              ErrorCode::Cancelled);
}

TEST(Bake, BumpsOverTwoTrianglesToTheStep) {
    // All places are whole parts of 2^-14, which the lattice keeps.
    const auto height = [](double x, double y) { return std::round(256 * std::sin(7 * x) * std::cos(5 * y)) / 4096; };
    const test::BuiltMesh scan(sheet(-0.25, 1.25, 96, height), 1.0 / 16);
    ASSERT_TRUE(scan.ok());
    const Baked baked = bakeOver(scan, unitSquare(), 64, 0.25, true);
    ASSERT_TRUE(baked.maps) << baked.maps.error().line();
    const BakedMaps& maps = *baked.maps;
    EXPECT_EQ(maps.shares.height, 1);
    const double step = maps.heights.range / 65535;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            // The outermost texels lie on the border.
            const dvec3 above(x / 63.0, y / 63.0, 1);
            const auto hit = scan.bvh().nearestHit(above, {0, 0, -1});
            ASSERT_TRUE(hit);
            ASSERT_NEAR(valueOf(maps.heights, size_t(x) + 64 * size_t(y)), 1 - hit->t, 0.5 * step + 1e-7)
                << x << ", " << y;
        }
}

TEST(Bake, WhatIsNoHeightFieldIsCounted) {
    const auto mapsOf = [](const IndexedMesh& mesh, double reach) {
        const test::BuiltMesh scan(mesh, 1.0 / 16);
        EXPECT_TRUE(scan.ok());
        const Baked baked = bakeOver(scan, unitSquare(), 64, reach, true);
        EXPECT_TRUE(baked.maps) << baked.maps.error().line();
        return baked.maps ? *baked.maps : BakedMaps();
    };
    const auto flat = [](double, double) { return 0.03; };
    // The two triangles have 2080 and 2016 texels, which stand for a half each.
    constexpr double kColumn = 1.0 / 64;
    // A sheet that ends at x = 0.75.
    IndexedMesh part = sheet(-0.25, 1.25, 96, flat);
    std::erase_if(part.triangles, [&](const auto& t) {
        return std::ranges::all_of(t, [&](uint32_t v) { return part.positions[v].x >= 0.75; });
    });
    const BakedMaps missing = mapsOf(part, 0.2);
    for (size_t i = 0; i < missing.states.size(); ++i)
        ASSERT_EQ(missing.states[i], i % 64 < 48 ? TexelState::Height : TexelState::NoHit) << i % 64 << ", " << i / 64;
    EXPECT_NEAR(missing.shares.noHit, 0.25, kColumn);
    EXPECT_NEAR(missing.shares.height, 0.75, kColumn);
    // A second sheet from x = 0.5 on, less than twice as far; the nearer is taken.
    IndexedMesh two = sheet(-0.25, 1.25, 96, [](double x, double) { return x < 0.125 ? 0.1 : 0.03; });
    IndexedMesh above = sheet(-0.25, 1.25, 96, [](double, double) { return 0.05; });
    std::erase_if(above.triangles, [&](const auto& t) {
        return std::ranges::all_of(t, [&](uint32_t v) { return above.positions[v].x <= 0.5; });
    });
    test::append(two, above);
    const BakedMaps sheets = mapsOf(two, 0.2);
    for (size_t i = 0; i < sheets.states.size(); ++i) {
        if (i % 64 < 32) {
            // At x = 0.125 the sheet falls steeply.
            const bool isStep = i % 64 >= 6 && i % 64 < 10;
            ASSERT_TRUE(isStep || sheets.states[i] == TexelState::Height) << i % 64 << ", " << i / 64;
            continue;
        }
        ASSERT_EQ(sheets.states[i], TexelState::Sheets) << i % 64 << ", " << i / 64;
        ASSERT_NEAR(valueOf(sheets.heights, i), 0.03, 2e-6);
    }
    EXPECT_NEAR(sheets.shares.sheets, 0.5, kColumn);
    // A slope of 80.5 degrees.
    const BakedShares steep = mapsOf(sheet(-0.25, 1.25, 96, [](double x, double) { return 6 * (x - 0.5); }), 4).shares;
    EXPECT_NEAR(steep.steep, 1, 1e-12);
    // Where nothing is met, that is said.
    const test::BuiltMesh far(sheet(-0.25, 1.25, 96, [](double, double) { return 3; }), 1.0 / 16);
    const Baked nothing = bakeOver(far, unitSquare(), 64, 0.5, true);
    ASSERT_FALSE(nothing.maps);
    EXPECT_NE(nothing.maps.error().message.find("not one line"), std::string::npos);
}

/// A ball with a small one on a stalk.
IndexedMesh mushroom() {
    std::vector<dvec2> profile;  // radius and height, from the bottom
    for (int i = 1; i <= 60; ++i) {
        const double turn = M_PI - i * (M_PI - 0.1) / 60;
        profile.emplace_back(std::sin(turn), std::cos(turn));
    }
    for (int i = 1; i <= 4; ++i) profile.emplace_back(0.06, 1 + 0.03 * i);
    for (int i = 1; i < 40; ++i) {
        const double turn = M_PI - 0.3 - i * (M_PI - 0.3) / 40;
        profile.emplace_back(0.2 * std::sin(turn), 1.31 + 0.2 * std::cos(turn));
    }
    constexpr uint32_t kAround = 64;
    IndexedMesh mesh;
    for (const dvec2 p : profile)
        for (uint32_t i = 0; i < kAround; ++i) {
            const double turn = 2 * M_PI * i / kAround;
            mesh.positions.emplace_back(p.x * std::cos(turn), p.x * std::sin(turn), p.y);
        }
    const auto bottom = uint32_t(mesh.positions.size()), top = bottom + 1;
    mesh.positions.emplace_back(0, 0, -1), mesh.positions.emplace_back(0, 0, 1.51);
    const auto rings = uint32_t(profile.size());
    for (uint32_t i = 0; i < kAround; ++i) {
        const uint32_t next = (i + 1) % kAround, last = kAround * (rings - 1);
        mesh.triangles.push_back({bottom, next, i}), mesh.triangles.push_back({top, last + i, last + next});
        for (uint32_t j = 0; j + 1 < rings; ++j) {
            const uint32_t a = kAround * j + i, b = kAround * j + next;
            mesh.triangles.push_back({a, b, b + kAround}), mesh.triangles.push_back({a, b + kAround, a + kAround});
        }
    }
    return mesh;
}

TEST(Bake, ABaseFollowsWhatWouldBeNoHeightField) {
    const test::BuiltMesh scan(mushroom(), 1.0 / 16);
    ASSERT_TRUE(scan.ok());
    const TestFolder folder("vcp_bake_test");
    const std::shared_ptr<const ByteReader> reader = *openFile(scan.file());
    std::vector<double> told;
    const auto figures = bake(reader, scan.cache().dataset(), folder.path(),
                              {.triangles = 120, .texels = 256, .progress = [&](std::string_view, double fraction) {
                                   told.push_back(fraction);
                                   return true;
                               }});
    ASSERT_TRUE(figures) << figures.error().line();
    EXPECT_LE(figures->baseTriangles, 120u);
    EXPECT_GT(figures->unlikeAtFirst, 0.002);
    EXPECT_LT(figures->unlike, 0.5 * figures->unlikeAtFirst);
    EXPECT_LT(1 - figures->shares.height, 0.5 * figures->unlikeAtFirst);
    EXPECT_TRUE(std::ranges::is_sorted(told));
    EXPECT_EQ(figures->scanVertices, mushroom().positions.size());
}

TEST(Bake, ALargeScanIsMadeCoarserFirst) {
    const IndexedMesh sphere = bumpySphere(70);
    const test::BuiltMesh scan(sphere, 1.0 / 16);
    ASSERT_TRUE(scan.ok());
    const std::shared_ptr<const ByteReader> reader = *openFile(scan.file());
    const Dataset& dataset = scan.cache().dataset();
    const SurfaceCut cut = *SurfaceCut::create(dataset, reader->name(), UINT32_MAX);
    BaseSurface joined{sphere.positions, sphere.triangles, {}};
    joinPositions(joined);
    // Half a step of the lattice along each axis, of 2048 a cell.
    const double rounded = 1.05 * std::sqrt(3) / 2 / 16 / 2048;
    // There are several runs; then one is the whole.
    for (const uint64_t memory : {uint64_t{16} << 20, uint64_t{1} << 32}) {
        std::vector<double> told;
        CoarseningOptions options{.triangles = 3000, .memoryBytes = memory, .progress = [&](double part) {
                                      told.push_back(part);
                                      return true;
                                  }};
        const auto coarse = coarsenScan(*reader, cut, options);
        ASSERT_TRUE(coarse) << coarse.error().line();
        EXPECT_NEAR(double(coarse->mesh.triangles.size()), 3000, 1000);
        EXPECT_EQ(coarse->vertices, joined.positions.size());
        EXPECT_EQ(coarse->leftOut, 0u);
        const BaseSurface surface{coarse->mesh.positions, coarse->mesh.triangles, {}};
        const auto edges = edgesOf(surface);
        ASSERT_TRUE(edges) << edges.error().line();
        EXPECT_EQ(edges->border, 0u) << "it was closed";
        EXPECT_EQ(edges->parts, 1u);
        // Corners are the scan's, and what lies between them is as near as is said, but for samples.
        for (const dvec3& p : surface.positions) EXPECT_LT(offFormula(p), rounded);
        EXPECT_GT(coarse->away, 0);
        EXPECT_LT(coarse->away, 1e-2);
        EXPECT_LT(facetsOff(coarse->mesh), facetsOff(sphere) + 2 * coarse->away);
        EXPECT_TRUE(std::ranges::is_sorted(told));
        EXPECT_FALSE(told.empty());
        options.progress = [](double) { return false; };
        EXPECT_EQ(coarsenScan(*reader, cut, options).error().code, ErrorCode::Cancelled);
    }
    const auto refused = coarsenScan(*reader, cut, {.triangles = 3000, .memoryBytes = 1 << 16});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Limit);

    const TestFolder folder("vcp_bake_test");
    BakeOptions options{.triangles = 300, .texels = 384, .measured = true, .mostDecimated = 3000};
    const auto figures = bake(reader, dataset, folder.path(), options);
    ASSERT_TRUE(figures) << figures.error().line();
    EXPECT_NEAR(double(figures->coarseTriangles), 3000, 1000);
    EXPECT_EQ(figures->scanVertices, joined.positions.size());
    EXPECT_LE(figures->baseTriangles, 300u);
    EXPECT_EQ(figures->shares.height, 1);
    EXPECT_LT(figures->scanToBase->max, 8e-3);
    options.mostDecimated = 500;
    const auto few = bake(reader, dataset, folder.path(), options);
    ASSERT_FALSE(few);
    EXPECT_EQ(few.error().code, ErrorCode::Limit);
    EXPECT_NE(few.error().message.find("a base of 300 of them"), std::string::npos) << few.error().line();
}

TEST(Bake, WhatIsWrittenIsTheScan) {
    const IndexedMesh sphere = bumpySphere(70);
    const test::BuiltMesh scan(sphere, 1.0 / 16);
    ASSERT_TRUE(scan.ok());
    const TestFolder folder("vcp_bake_test");
    const std::filesystem::path to = folder / "asset";
    std::filesystem::create_directory(to);
    const std::shared_ptr<const ByteReader> reader = *openFile(scan.file());
    const auto figures = bake(reader, scan.cache().dataset(), to, {.triangles = 300, .texels = 384, .measured = true});
    ASSERT_TRUE(figures) << figures.error().line();
    EXPECT_LE(figures->baseTriangles, 300u);
    EXPECT_EQ(figures->shares.height, 1);
    // The surface that a scene draws, from its files: near the formula everywhere, and everywhere there.
    const auto base = readBaseMesh(to / "base.obj", 1);
    const auto asset = readAsset(to / "heights.meso");
    ASSERT_TRUE(base && asset);
    const auto displaced = displacedMesh(*base, *asset->heights, figures->offset);
    ASSERT_TRUE(displaced);
    // Between its texels it is straight, along two axes.
    const double step = 1.1 * longestStep(*base, *makeAtlas(*base, 384));
    const double bound = facetsOff(sphere) + 2 * kMostCurvature / 8 * step * step;
    EXPECT_LT(bound, 4e-3);
    double worst = 0;
    for (const dvec3& p : displaced->positions) worst = std::max(worst, offFormula(p));
    EXPECT_LT(worst, bound);
    ASSERT_TRUE(figures->scanToBase && figures->baseToScan);
    EXPECT_LT(figures->scanToBase->max, 2 * bound);
    EXPECT_LT(figures->baseToScan->max, 2 * bound);
    EXPECT_GT(figures->baseToScan->max, 0);
}

}  // namespace
}  // namespace vcp
