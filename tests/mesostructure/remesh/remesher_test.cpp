// Remeshed surfaces: no cracks, no T-vertices, and each branch of the sweep.
#include "mesostructure/remesh/remesher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "mesostructure/remesh/remesh_frames.h"
#include "mesostructure/remesh/remesh_math.h"
#include "mesostructure/shell.h"
#include "mesostructure/solids.h"
#include "tests/support/remeshed_views.h"

namespace vcp::meso {
namespace {

using glm::dvec2, glm::dvec3;
using test::lookFrom, test::openEdges;

std::shared_ptr<const HeightLevels> levelsOf(std::string_view name, int texels = 64) {
    static std::map<std::string, std::shared_ptr<const HeightLevels>> known;
    auto& made = known[std::string(name) + std::to_string(texels)];
    if (!made) made = std::make_shared<HeightLevels>(*HeightLevels::build(*makeHeightField(name, texels, 1)));
    return made;
}

RemeshSurface surfaceOf(const BaseSurface& base, double height, std::string_view heights = "ridged") {
    auto made = buildRemeshSurface(base, levelsOf(heights), height);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

template <class Real>
RemeshMesh<Real> meshOf(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options = {}) {
    RemeshMesh<Real> mesh;
    const auto made = remesh(surface, camera, options, mesh);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return mesh;
}

/// Rasterizes without cracks of its own: whether a pixel's middle is left of an edge is asked in one order of its ends.
/// Each pixel gets the triangles that face the eye less those that face away: 0 everywhere for a closed surface.
class Raster {
public:
    Raster(int edge, const RemeshCamera& camera)
        : edge_(edge), camera_(camera), winding_(size_t(edge) * edge, 0), covers_(winding_) {}

    template <class Real>
    void draw(const RemeshMesh<Real>& mesh) {
        for (size_t i = 0; i < mesh.indices.size(); i += 3) {
            std::array<dvec2, 3> p;
            for (int k = 0; k < 3; ++k) {
                const dvec3 at(mesh.vertices[mesh.indices[i + k]].position);
                p[k] =
                    0.5 * edge_ + dvec2(at) / at.z * camera_.focal * (edge_ * 0.5 / (camera_.seen.z * camera_.focal));
            }
            drawTriangle(p);
        }
    }
    [[nodiscard]] uint64_t cracks() const {
        return uint64_t(std::ranges::count_if(winding_, [](int n) { return n != 0; }));
    }
    [[nodiscard]] uint64_t covered() const {
        return uint64_t(std::ranges::count_if(covers_, [](int n) { return n != 0; }));
    }

private:
    static bool isLeft(dvec2 a, dvec2 b, dvec2 p) {
        const bool isSwapped = a.x > b.x || (a.x == b.x && a.y > b.y);
        if (isSwapped) std::swap(a, b);
        return ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) >= 0) != isSwapped;
    }
    void drawTriangle(const std::array<dvec2, 3>& p) {
        const dvec2 low = glm::min(p[0], glm::min(p[1], p[2])), high = glm::max(p[0], glm::max(p[1], p[2]));
        for (int y = std::max(0, int(std::floor(low.y - 0.5))); y <= std::min(edge_ - 1, int(high.y)); ++y)
            for (int x = std::max(0, int(std::floor(low.x - 0.5))); x <= std::min(edge_ - 1, int(high.x)); ++x) {
                const dvec2 at(x + 0.5, y + 0.5);
                const int lefts = isLeft(p[0], p[1], at) + isLeft(p[1], p[2], at) + isLeft(p[2], p[0], at);
                if (lefts != 0 && lefts != 3) continue;
                winding_[size_t(y) * edge_ + x] += lefts == 3 ? 1 : -1;
                ++covers_[size_t(y) * edge_ + x];
            }
    }

    int edge_;
    const RemeshCamera& camera_;
    std::vector<int> winding_, covers_;
};

TEST(Remesher, ClosedSurfacesHaveNoTVertices) {
    for (const auto base : {"sphere", "torus", "box", "cylinder"})
        for (const double cell : {1.0, 5.0, 20.0})
            for (const auto access : {HeightAccess::Sample, HeightAccess::Most}) {
                SCOPED_TRACE(base);
                SCOPED_TRACE(cell);
                const RemeshSurface surface = surfaceOf(*makeBaseSurface(base, 2), 0.1);
                const RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 120);
                const RemeshOptions options{.cell = cell, .access = access};
                const auto single = meshOf<float>(surface, camera, options);
                EXPECT_EQ(single.counts.culled, 0u);
                EXPECT_EQ(openEdges(single), 0u);
                EXPECT_EQ(openEdges(meshOf<double>(surface, camera, options)), 0u);
                for (const auto& vertex : single.vertices) {
                    ASSERT_LT(vertex.triangle, surface.triangles.size());
                    ASSERT_GT(vertex.position.z, 0);
                }
            }
}

/// A slow dolly up to a closed object, past the nearest depth of some of its triangles' corners.
TEST(Remesher, NothingShowsThroughOverADolly) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("sphere", 2), 0.15);
    constexpr int kFrames = 256, kEdge = 64;
    uint64_t cracks = 0, covered = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
        const double part = double(frame) / kFrames;
        const RemeshCamera camera = lookFrom(dvec3(2.2, 1.4, 1.1) * (1.8 - part), {0.2 * part, 0, 0}, kEdge);
        Raster raster(kEdge, camera);
        raster.draw(meshOf<float>(surface, camera, {.cell = frame % 2 == 0 ? 2.0 : 5.0}));
        cracks += raster.cracks(), covered += raster.covered();
    }
    EXPECT_EQ(cracks, 0u);
    EXPECT_GT(covered, uint64_t{kFrames} * kEdge * kEdge / 10);
}

/// The seams of a box's and a torus' maps are where heights jump.
TEST(Remesher, NothingShowsThroughAtSeams) {
    for (const auto base : {"box", "torus"}) {
        const RemeshSurface surface = surfaceOf(*makeBaseSurface(base, 1.5), 0.2, "blocks");
        EXPECT_GT(surface.seamUvs.size(), 10u);
        for (int frame = 0; frame < 16; ++frame) {
            const RemeshCamera camera = lookFrom(glm::normalize(dvec3(1, 0.1 * frame, 0.7)) * 4.0, {0, 0, 0}, 96);
            Raster raster(96, camera);
            raster.draw(meshOf<float>(surface, camera, {.cell = 3}));
            EXPECT_EQ(raster.cracks(), 0u) << base << ' ' << frame;
            EXPECT_GT(raster.covered(), 500u);
        }
    }
}

BaseSurface triangle(std::array<dvec3, 3> corners) {
    return {{corners[0], corners[1], corners[2]}, {{0, 1, 2}}, {{dvec2(0.1, 0.2), dvec2(0.9, 0.3), dvec2(0.4, 0.8)}}};
}

/// Whatever its corners are rounded to, a triangle is parted into triangles that leave its edges open and nothing else,
/// in as many parts as the edges have cells.
TEST(Remesher, AnyTriangleIsPartedWhollyAndOnce) {
    RemeshCounts sum;
    for (uint32_t seed = 0; seed < 6000; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const double size = seed % 4 == 0 ? 0.02 : seed % 4 == 1 ? 0.1 : 1.0;
        std::uniform_real_distribution<double> off(-size, size);
        std::array<dvec3, 3> corners;
        for (dvec3& corner : corners) corner = dvec3(off(random), off(random), 3 + 2 * off(random));
        if (seed % 16 == 2) corners[1].x = corners[0].x, corners[2].y = corners[0].y;
        const RemeshSurface surface = surfaceOf(triangle(corners), 0.05);
        RemeshCamera camera = lookFrom({0, 0, 0}, {0, 0, 1}, 60);
        const auto mesh = meshOf<double>(surface, camera, {.cell = 1, .mostCells = 1024});
        if (mesh.counts.culled > 0) continue;
        ASSERT_EQ(mesh.counts.pieces, 1u);
        // The corners come first.
        std::array<glm::ivec3, 3> grid;
        const RemeshMath<double>::RemeshGrid in{camera.focal, camera.nearest, 1 / std::log1p(1 / camera.focal), 0};
        uint64_t cells = 0;
        for (int k = 0; k < 3; ++k) {
            const dvec3 p = dvec3(surface.positions[k]) + surface.origin;
            grid[k] = RemeshMath<double>::remeshGridPoint(
                in, {glm::dot(p, camera.right), glm::dot(p, camera.up), glm::dot(p, camera.forward)});
        }
        for (int k = 0; k < 3; ++k) cells += uint64_t(RemeshMath<double>::remeshEdge(grid[k], grid[(k + 1) % 3]).cells);
        ASSERT_EQ(openEdges(mesh), cells);
        // Euler: a disc with V vertices, of which B are on its border, has 2 V - B - 2 triangles.
        ASSERT_EQ(mesh.indices.size() / 3, 2 * mesh.vertices.size() - cells - 2);
        sum.whole += mesh.counts.whole, sum.threeAxes += mesh.counts.threeAxes, sum.quads += mesh.counts.quads;
    }
    EXPECT_GT(sum.whole, 100u);
    EXPECT_GT(sum.threeAxes, 50u);
    EXPECT_GT(sum.quads, 100'000u);
}

/// Over a plane, the parts have the plane's area: none lies on another.
TEST(Remesher, PartsOfATriangleDoNotOverlap) {
    for (uint32_t seed = 0; seed < 500; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> off(-1, 1);
        const RemeshSurface surface = surfaceOf(triangle({dvec3(off(random), off(random), 3 + off(random)),
                                                          dvec3(off(random), off(random), 3 + off(random)),
                                                          dvec3(off(random), off(random), 3 + off(random))}),
                                                0.05);
        const auto mesh = meshOf<double>(surface, lookFrom({0, 0, 0}, {0, 0, 1}, 80), {.mostCells = 1024});
        double area = 0, all = 0;
        for (size_t i = 0; i < mesh.indices.size(); i += 3) {
            const dvec2 a(mesh.vertices[mesh.indices[i]].uv), b(mesh.vertices[mesh.indices[i + 1]].uv),
                c(mesh.vertices[mesh.indices[i + 2]].uv);
            const double part = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
            area += part, all += std::abs(part);
        }
        if (mesh.counts.culled > 0) continue;
        const double whole = 0.8 * 0.6 - 0.1 * 0.3;
        EXPECT_NEAR(area, whole, 1e-6) << seed;
        // Points that were rounded onto an edge may turn slivers over.
        EXPECT_LT(all, 1.05 * whole) << seed;
    }
}

TEST(Remesher, SingleAndDoublePrecisionAgree) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("torus", 2), 0.1, "fbm");
    const RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 200);
    const auto single = meshOf<float>(surface, camera, {.cell = 4});
    const auto twice = meshOf<double>(surface, camera, {.cell = 4});
    ASSERT_EQ(single.vertices.size(), twice.vertices.size());
    ASSERT_EQ(single.indices, twice.indices);
    for (size_t i = 0; i < single.vertices.size(); ++i)
        ASSERT_LT(glm::distance(dvec3(single.vertices[i].position), twice.vertices[i].position), 1e-4) << i;
}

/// Where cells are smaller than texels, the vertices lie on the bilinear surface of the map.
TEST(Remesher, VerticesLieOnTheMapsSurface) {
    const HeightMap map = *makeHeightField("fbm", 64, 1);
    const auto shape = *heightShape(map);
    // The quad is two units wide and has one tile: tile units are doubled, and the slab is as high as the map is.
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("quad", 1), 2 * map.range, "fbm");
    RemeshCamera camera = lookFrom({0.6, 0.8, 1.4}, {0, 0, 0}, 400);
    const auto mesh = meshOf<double>(surface, camera, {.cell = 1});
    EXPECT_GT(mesh.vertices.size(), 50'000u);
    for (const auto& vertex : mesh.vertices) {
        const dvec3 p = camera.eye + vertex.position.x * camera.right + vertex.position.y * camera.up +
                        vertex.position.z * camera.forward;
        ASSERT_NEAR(0.5 * (p.x + 1), vertex.uv.x, 1e-5);
        ASSERT_LT(std::abs(shape->field({vertex.uv.x, vertex.uv.y, 0.5 * p.z})), 1e-5);
    }
}

/// Against differences of the displaced surface's own places; maps that are turned over are turned back.
TEST(Remesher, NormalsAreThoseOfTheDisplacedSurface) {
    for (const auto base : {"sphere", "box", "quad", "cylinder"})
        for (const bool isMirrored : {false, true}) {
            BaseSurface flipped = *makeBaseSurface(base, 2);
            if (isMirrored)
                for (auto& uvs : flipped.uvs)
                    for (auto& uv : uvs) uv.x = -uv.x;
            const RemeshSurface surface = surfaceOf(flipped, 0.1, "fbm");
            const HeightLevels& levels = *surface.heights;
            RemeshHeights<double> heights{{&levels}};
            for (size_t i = 0; i < surface.triangles.size(); i += 7) {
                SCOPED_TRACE(std::string(base) + " " + std::to_string(i));
                const RemeshFrame frame = remeshFrame(surface, i);
                const auto& uvs = surface.uvs[i];
                const dvec2 a(uvs[0]), b = dvec2(uvs[1]) - a, c = dvec2(uvs[2]) - a, middle = a + 0.3 * b + 0.4 * c;
                const double area = b.x * c.y - c.x * b.y;
                const auto at = [&](dvec2 uv) {
                    const dvec2 off = uv - a;
                    const double y = (off.x * c.y - c.x * off.y) / area, z = (b.x * off.y - off.x * b.y) / area;
                    dvec3 p(0), d(0);
                    for (int k = 0; k < 3; ++k) {
                        const uint32_t corner = surface.triangles[i][size_t(k)];
                        const double w = k == 0 ? 1 - y - z : k == 1 ? y : z;
                        p += w * dvec3(surface.positions[corner]), d += w * dvec3(surface.directions[corner]);
                    }
                    return p + levels.height(0, uv) * d;
                };
                const double reach = 0.5 / levels.texels().x;
                const dvec3 u = at(middle + dvec2(reach, 0)) - at(middle - dvec2(reach, 0)),
                            v = at(middle + dvec2(0, reach)) - at(middle - dvec2(0, reach));
                const dvec3 expected = (isMirrored ? -1.0 : 1.0) * glm::normalize(glm::cross(u, v));
                const dvec3 normal = heights.remeshNormal(frame, 1, middle);
                ASSERT_NEAR(glm::length(normal), 1, 1e-9);
                ASSERT_GT(glm::dot(normal, expected), 1 - 1e-3);
                ASSERT_GT(glm::dot(normal, frame.facet), 0);
            }
        }
}

/// Heights that bend along an edge of the base, as baked ones do where it bends the other way: up to the edge, normals
/// are those of its own side.
TEST(Remesher, NormalsDoNotLookOverEdgesOfTheBase) {
    const BaseSurface base{{{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {-1, 1, 0}, {0, 1, 0}, {1, 1, 0}},
                           {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}},
                           {{dvec2(0.25, 0.25), dvec2(0.5, 0.25), dvec2(0.5, 0.5)},
                            {dvec2(0.25, 0.25), dvec2(0.5, 0.5), dvec2(0.25, 0.5)},
                            {dvec2(0.5, 0.25), dvec2(0.75, 0.25), dvec2(0.75, 0.5)},
                            {dvec2(0.5, 0.25), dvec2(0.75, 0.5), dvec2(0.5, 0.5)}}};
    std::vector<uint16_t> heightsOfValley(64 * 64);
    for (int i = 0; i < 64 * 64; ++i) heightsOfValley[size_t(i)] = uint16_t(2000 * std::abs(i % 64 - 32));
    const HeightMap valley{{64, 64}, 1, std::move(heightsOfValley)};
    auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(valley, {.fit = LevelFit::Averaged}));
    const RemeshSurface surface = *buildRemeshSurface(base, levels, 0.5);
    RemeshHeights<double> heights{{levels.get()}};
    for (const auto& [triangle, side] : {std::pair<size_t, double>{0, -1}, {3, 1}}) {
        const RemeshFrame frame = remeshFrame(surface, triangle);
        const dvec3 far = heights.remeshNormal(frame, 1, dvec2(0.5 + side * 0.05, 0.4 + side * 0.05));
        EXPECT_GT(-side * far.x, 0.1);
        for (const double texels : {0.01, 0.2, 0.4, 0.7})
            EXPECT_GT(glm::dot(heights.remeshNormal(frame, 1, dvec2(0.5 + side * texels / 64, 0.4)), far), 1 - 1e-9)
                << side << ", " << texels;
    }
}

/// Against the pieces of the shell themselves, which say where a place of the map is.
TEST(Remesher, PointsOfTheShellAreWhereRaysMeetTheMap) {
    for (const auto base : {"sphere", "box", "cylinder", "torus"}) {
        const BaseSurface from = *makeBaseSurface(base, 2);
        const RemeshSurface surface = surfaceOf(from, 0.1, "fbm");
        RemeshHeights<double> heights{{surface.heights.get()}};
        Shell shell;
        const auto pieces = shellPieces(from, 0.1, {1, 1, 1}, 0, shell);
        ASSERT_EQ(pieces.size(), 3 * surface.triangles.size());
        double farthest = 0;
        for (size_t i = 0; i < surface.triangles.size(); i += 5) {
            SCOPED_TRACE(std::string(base) + " " + std::to_string(i));
            const auto& uvs = surface.uvs[i];
            for (const dvec2 w : {dvec2(0.3, 0.4), dvec2(0.7, 0.1), dvec2(0.05, 0.9), dvec2(0.1, 0.15)}) {
                const dvec2 at = (1 - w.x - w.y) * dvec2(uvs[0]) + w.x * dvec2(uvs[1]) + w.y * dvec2(uvs[2]);
                const dvec3 point =
                    heights.remeshShellPoint(remeshFrame(surface, i), at) + surface.origin - shell.origin;
                double nearest = 1e30;
                for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
                    const ShellPiece& piece = pieces[k];
                    const glm::dmat3 edges(piece.tile[1] - piece.tile[0], piece.tile[2] - piece.tile[0],
                                           piece.tile[3] - piece.tile[0]);
                    const dvec3 b = glm::inverse(edges) * (dvec3(at, surface.heights->height(0, at)) - piece.tile[0]);
                    if (std::min({b.x, b.y, b.z, 1 - b.x - b.y - b.z}) < -1e-6) continue;
                    const dvec3 expected = piece.corners[0] + b.x * (piece.corners[1] - piece.corners[0]) +
                                           b.y * (piece.corners[2] - piece.corners[0]) +
                                           b.z * (piece.corners[3] - piece.corners[0]);
                    nearest = std::min(nearest, glm::distance(point, expected));
                }
                farthest = std::max(farthest, nearest);
            }
        }
        EXPECT_LT(farthest, 1e-6);
    }
}

/// Eyes within the slab, beneath it and above: the nearest depth cuts nothing that is seen.
TEST(Remesher, TrianglesThroughTheEyesPlaneAreHalved) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("quad", 1), 0.2);
    RemeshCamera camera = lookFrom({-0.2, 0.1, 0.3}, {1, 0.1, 0.25}, 200);
    const auto mesh = meshOf<float>(surface, camera, {.cell = 2, .mostCells = 64});
    EXPECT_GT(mesh.counts.halvings, 20u);
    EXPECT_EQ(mesh.counts.tooDeep, 0u);
    EXPECT_LT(mesh.vertices.size(), 400'000u);
    // Straight ahead there is ground: a dense ray from the eye meets the mesh up to the quad's end.
    double nearest = 1e300, farthest = 0;
    for (const auto& vertex : mesh.vertices)
        if (std::abs(vertex.position.x) < 0.05f * vertex.position.z)
            nearest = std::min(nearest, double(vertex.position.z)),
            farthest = std::max(farthest, double(vertex.position.z));
    EXPECT_LT(nearest, 0.5);
    EXPECT_GT(farthest, 1.15);
}

TEST(Remesher, WhatIsOutsideTheViewIsCulled) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("sphere", 2), 0.1);
    RemeshCamera camera = lookFrom({5, 0, 0}, {10, 0, 0}, 100);
    EXPECT_EQ(meshOf<float>(surface, camera).vertices.size(), 0u);
    camera = lookFrom({5, 0, 0}, {0, 0, 0}, 100);
    const auto whole = meshOf<float>(surface, camera, {.cell = 4});
    camera.seen = {0, -1, 1, 1};
    const auto half = meshOf<float>(surface, camera, {.cell = 4});
    EXPECT_GT(half.counts.culled, whole.counts.baseTriangles / 4);
    EXPECT_LT(half.vertices.size(), whole.vertices.size() * 2 / 3);
    // What is just beside the view stays, where it may reach in.
    camera.seen = {1.05 / 5, -1, 1, 1};
    EXPECT_GT(meshOf<float>(surface, camera, {.cell = 4}).vertices.size(), 0u);
}

TEST(Remesher, ParallelRaysHaveGridsWithoutLogarithms) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("sphere", 2), 0.1);
    RemeshCamera camera = lookFrom({4, 3, 2}, {0, 0, 0}, 100);
    camera.isParallel = true, camera.focal = 30, camera.seen = {-2, -2, 2, 2};
    const auto mesh = meshOf<float>(surface, camera, {.cell = 2});
    EXPECT_EQ(mesh.counts.culled, 0u);
    EXPECT_GT(mesh.vertices.size(), 5000u);
    EXPECT_EQ(openEdges(mesh), 0u);
}

/// The bound holds: no point of the displaced base is further from the mesh's at the same place of the map.
TEST(Remesher, TheBoundOnTheErrorHolds) {
    const double height = 0.3;
    for (const double cell : {1.0, 4.0, 16.0}) {
        SCOPED_TRACE(cell);
        const RemeshSurface surface = surfaceOf(*makeBaseSurface("quad", 1), height);
        const RemeshCamera camera = lookFrom({0.6, 0.8, 1.6}, {0, 0, 0}, 300);
        const auto mesh = meshOf<double>(surface, camera, {.cell = cell, .bounds = true});
        ASSERT_GT(mesh.counts.boundPixels, 0);
        double most = 0;
        for (size_t i = 0; i < mesh.indices.size(); i += 3) {
            const auto &a = mesh.vertices[mesh.indices[i]], &b = mesh.vertices[mesh.indices[i + 1]],
                       &c = mesh.vertices[mesh.indices[i + 2]];
            for (const dvec3 w : {dvec3(1.0 / 3), dvec3(0.6, 0.2, 0.2), dvec3(0.2, 0.6, 0.2), dvec3(0.2, 0.2, 0.6)}) {
                const dvec3 on = w.x * a.position + w.y * b.position + w.z * c.position;
                const dvec2 uv = w.x * a.uv + w.y * b.uv + w.z * c.uv;
                const dvec3 world(2 * uv.x - 1, 2 * uv.y - 1, height * levelsOf("ridged")->height(0, uv));
                const dvec3 d = world - camera.eye,
                            truth(glm::dot(d, camera.right), glm::dot(d, camera.up), glm::dot(d, camera.forward));
                if (on.z < 0.1 || truth.z < 0.1) continue;
                most = std::max(most, camera.focal * glm::distance(dvec2(on) / on.z, dvec2(truth) / truth.z));
            }
        }
        EXPECT_LE(most, mesh.counts.boundPixels);
        EXPECT_GT(most, 0);
    }
}

TEST(Remesher, SeenFromBehindTheLeastIsTaken) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("quad", 4), 0.2);
    for (const double side : {1.0, -1.0}) {
        const RemeshCamera camera = lookFrom({0.3, 0.2, 6 * side}, {0, 0, 0}, 100);
        const auto heightOf = [&](HeightAccess access) {
            double sum = 0;
            const auto mesh = meshOf<double>(surface, camera, {.cell = 1, .access = access});
            for (const auto& vertex : mesh.vertices)
                sum += camera.eye.z + vertex.position.x * camera.right.z + vertex.position.y * camera.up.z +
                       vertex.position.z * camera.forward.z;
            return sum / double(mesh.vertices.size());
        };
        const double more = (heightOf(HeightAccess::Most) - heightOf(HeightAccess::Sample)) * side;
        EXPECT_GT(more, 1e-3) << side;
    }
}

TEST(Remesher, RefusesWhatCannotBeRemeshed) {
    const auto levels = levelsOf("ridged");
    const auto errorOf = [&](const BaseSurface& base, double height = 0.1) {
        const auto made = buildRemeshSurface(base, levels, height);
        EXPECT_FALSE(made.ok());
        return made ? std::string() : made.error().line();
    };
    BaseSurface base = *makeBaseSurface("quad", 1);
    EXPECT_NE(errorOf(base, 0).find("must be above 0"), std::string::npos);
    EXPECT_NE(errorOf(base, std::nan("")).find("must be above 0"), std::string::npos);
    base.uvs[1][2].x = std::nan("");
    EXPECT_NE(errorOf(base).find("triangle 1: a texture coordinate is not finite"), std::string::npos);
    base.uvs.clear();
    EXPECT_NE(errorOf(base).find("needs texture coordinates"), std::string::npos);
    base = *makeBaseSurface("quad", 1);
    base.positions[0].y = std::numeric_limits<double>::infinity();
    EXPECT_NE(errorOf(base).find("a position is not finite"), std::string::npos);
    base = *makeBaseSurface("quad", 1);
    base.triangles.push_back(base.triangles[0]), base.uvs.push_back(base.uvs[0]);
    EXPECT_NE(errorOf(base).find("triangle"), std::string::npos) << "an edge of two triangles in one direction";
    // Two faces on their own backs have no direction at their corners.
    base = *makeBaseSurface("quad", 1);
    for (size_t i = 0; i < 2; ++i) {
        const auto t = base.triangles[i];
        base.triangles.push_back({t[0], t[2], t[1]}), base.uvs.push_back(base.uvs[i]);
    }
    EXPECT_FALSE(buildRemeshSurface(base, levels, 0.1).ok());
    EXPECT_NE(errorOf({{dvec3(0)}, {{0, 0, 0}}, {{dvec2(0), dvec2(0), dvec2(0)}}}).find("three different corners"),
              std::string::npos);
}

TEST(Remesher, RefusesSizesThatAreNone) {
    const RemeshSurface surface = surfaceOf(*makeBaseSurface("quad", 1), 0.1);
    const RemeshCamera camera = lookFrom({0.6, 0.8, 1.6}, {0, 0, 0}, 300);
    RemeshMesh<float> mesh;
    EXPECT_EQ(remesh(surface, camera, {.cell = 0}, mesh).error().code, ErrorCode::Usage);
    EXPECT_EQ(remesh(surface, camera, {.cell = std::nan("")}, mesh).error().code, ErrorCode::Usage);
    EXPECT_EQ(remesh(surface, camera, {.mostCells = 1}, mesh).error().code, ErrorCode::Usage);
    const auto full = remesh(surface, camera, {.cell = 0.5}, mesh, 1000);
    ASSERT_FALSE(full.ok());
    EXPECT_EQ(full.error().code, ErrorCode::Limit);
}

}  // namespace
}  // namespace vcp::meso
