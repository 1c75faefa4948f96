// The host's caster against the reference, ray by ray, on every instruction set that this processor has.
#include "render/host/host_caster.h"

#include <cmath>

#include <gtest/gtest.h>

#include "render/camera.h"
#include "render/host/hit_surface.h"
#include "render/host/layer_tiles.h"
#include "tests/support/built_mesh.h"
#include "tests/support/instruction_sets.h"
#include "tests/support/reference_comparison.h"
#include "tests/support/test_scene.h"

namespace vcp {
namespace {

constexpr uint32_t kWidth = 250, kHeight = 187;  // no whole number of tiles

struct HostPixel {
    float depth = std::numeric_limits<float>::infinity();
    uint64_t page = 0;
    glm::dvec3 normal{0};
};

std::vector<HostPixel> castHost(const HostScene& scene, const PictureRays& rays) {
    std::vector<HostPixel> pixels(size_t(rays.size.x) * rays.size.y);
    const auto take = [&](const TileHits& hits) {
        for (int i = 0; hits.any && i < kTilePixels; ++i) {
            const glm::ivec2 in(i % kTileWidth, i / kTileWidth), at = hits.corner + in;
            if (in.x >= hits.size.x || in.y >= hits.size.y || std::isinf(hits.depth[i])) continue;
            const glm::dvec3 direction = glm::normalize(rays.directionAt(at.x + 0.5, at.y + 0.5));
            const glm::vec3 alone = glm::normalize(surfaceAt(scene, hits, i, direction).normal);
            glm::dvec3 normal = glm::normalize(glm::dvec3(hits.normalX[i], hits.normalY[i], hits.normalZ[i]));
            EXPECT_LT(glm::distance(glm::vec3(normal), alone), 1e-3f);
            // The reference bends normals back that lean away from the ray.
            normal = glm::normalize(normal - std::max(glm::dot(normal, direction), 0.0) * direction);
            pixels[size_t(at.y) * rays.size.x + at.x] = {hits.depth[i],
                                                         scene.page(hits.leaves[hits.leaf[i]].page).number, normal};
        }
    };
    EXPECT_TRUE(castPicture(scene, rays, {.threads = 2}, take));
    return pixels;
}

struct Comparison {
    uint64_t hit = 0, miss = 0;
    uint64_t silhouette =
        0;  ///< rays that hit or miss, or hit another sheet, depending on a ten-thousandth of a cell or on precision
    uint64_t wrong = 0;
    double depthMax = 0, normalMax = 0;  ///< cells, over all other hits; radians
};

class Comparer {
public:
    Comparer(const PageCache& cache, const std::vector<uint64_t>& cut, std::vector<SectionCut> sections)
        : cache_(cache),
          sections_(std::move(sections)),
          scene_(*HostScene::create(cache, cut)),
          reference_(*ReferenceCaster::create(cache, cut)),
          single_(*ReferenceCaster::create(cache, cut, {.singlePrecision = true})) {}

    [[nodiscard]] bool isCut() const { return !sections_.empty(); }
    Comparison compare(const Camera& camera) const {
        PictureRays rays = pictureRays(camera, kWidth, kHeight);
        rays.sections = sections_;
        const std::vector<HostPixel> pixels = castHost(scene_, rays);
        const PixelBox seen = pixelsOf(scene_, rays, rays.size);
        Comparison c;
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const CameraRay ray = cameraRay(camera, kWidth, kHeight, x + 0.5, y + 0.5);
                const HostPixel& pixel = pixels[size_t(y) * kWidth + x];
                const bool isInside =
                    int(x) >= seen.first.x && int(x) < seen.end.x && int(y) >= seen.first.y && int(y) < seen.end.y;
                EXPECT_TRUE(isInside || std::isinf(pixel.depth))
                    << "outside of where it may be seen: " << x << " " << y;
                add(ray, pixel, c);
            }
        return c;
    }

private:
    /// Returns what a caster finds in what the sections leave of a ray.
    [[nodiscard]] std::optional<RayHit> castKept(const ReferenceCaster& caster, glm::dvec3 origin,
                                                 glm::dvec3 direction) const {
        Ray ray{origin, direction};
        for (const SectionCut& plane : sections_) {
            const glm::dvec3 normal(plane);
            const double t = (plane.w - glm::dot(normal, origin)) / glm::dot(normal, direction);
            if (glm::dot(normal, direction) > 0)
                ray.tMin = std::max(ray.tMin, t);
            else
                ray.tMax = std::min(ray.tMax, t);
        }
        return ray.tMin <= ray.tMax ? caster.cast(ray) : std::nullopt;
    }

    void add(const CameraRay& ray, const HostPixel& pixel, Comparison& c) const {
        const auto expected = castKept(reference_, ray.origin, ray.direction);
        const bool found = std::isfinite(pixel.depth);
        if (!expected && !found) {
            ++c.miss;
            return;
        }
        const double cell = cache_.dataset().cellOf(expected ? expected->level : cache_.dataset().header.levels - 1);
        const double error = expected && found ? std::abs(double(pixel.depth) - expected->t) / cell : 1e30;
        const double rounding = 4e-7 * double(pixel.depth) / cell;
        // At a slant the depth follows the place: by the tangent of the angle.
        const double cosine = expected ? std::max(1e-3, -glm::dot(expected->normal, ray.direction)) : 1;
        if (error <= rounding + 4e-4 / cosine) {
            ++c.hit;
            c.depthMax = std::max(c.depthMax, error);
            c.normalMax = std::max(c.normalMax, std::acos(std::min(1.0, glm::dot(pixel.normal, expected->normal))));
            return;
        }
        ++(isSilhouette(ray, pixel, cell) ? c.silhouette : c.wrong);
    }

    /// Whether rays next to this one find in the reference what the host found here, or this one does in single
    /// precision: where it only just dips into the surface, that may miss the dip.
    [[nodiscard]] bool isSilhouette(const CameraRay& ray, const HostPixel& pixel, double cell) const {
        const auto agrees = [&](const std::optional<RayHit>& hit) {
            return hit.has_value() == std::isfinite(pixel.depth) &&
                   (!hit || std::abs(hit->t - double(pixel.depth)) < 0.1 * cell);
        };
        if (agrees(castKept(single_, ray.origin, ray.direction))) return true;
        const glm::dvec3 aside = glm::normalize(glm::cross(ray.direction, glm::dvec3(0.31, 0.57, 0.83)));
        const glm::dvec3 up = glm::cross(ray.direction, aside);
        for (int i = 0; i < 16; ++i) {
            const double angle = i * 0.3927, reach = 3e-4 * cell;
            const glm::dvec3 beside = (std::cos(angle) * aside + std::sin(angle) * up) * reach;
            if (agrees(castKept(reference_, ray.origin + beside, ray.direction))) return true;
        }
        return false;
    }

    const PageCache& cache_;
    const std::vector<SectionCut> sections_;
    HostScene scene_;
    ReferenceCaster reference_, single_;
};

std::vector<test::NamedCamera> camerasOf(glm::dvec3 lo, glm::dvec3 hi) {
    std::vector<test::NamedCamera> list = test::cameras(lo, hi);
    Camera wide = list.front().camera;
    wide.eye = (lo + hi) * 0.5 + (wide.eye - (lo + hi) * 0.5) * 0.45;
    wide.verticalFov = 2;
    list.push_back({"wide", wide});
    return list;
}

void expectSame(const PageCache& cache, const std::vector<uint64_t>& cut, glm::dvec3 lo, glm::dvec3 hi,
                std::vector<SectionCut> sections = {}) {
    const Comparer comparer(cache, cut, std::move(sections));
    uint64_t hits = 0;
    for (const test::NamedCamera& named : camerasOf(lo, hi)) {
        SCOPED_TRACE(named.name);
        const Comparison c = comparer.compare(named.camera);
        EXPECT_EQ(c.wrong, 0u);
        // Sections leave nothing of some views.
        EXPECT_GE(c.hit, comparer.isCut() ? 0u : 1000u);
        hits += c.hit;
        EXPECT_LE(c.silhouette * 500, c.hit);
    }
    EXPECT_GT(hits, 10000u);
}

void expectSame(const test::Scene& scene, uint32_t level) {
    expectSame(*scene.cache, cutAtLevel(scene.cache->dataset(), level), scene.boxMin, scene.boxMax);
}

/// A slanted plane, a slice along the walls of the grid, and three planes about a corner, through a box's middle.
std::vector<std::vector<SectionCut>> cutsThrough(glm::dvec3 lo, glm::dvec3 hi) {
    const auto cut = [&](glm::dvec3 part, glm::dvec3 normal) {
        normal = glm::normalize(normal);
        return SectionCut(normal, glm::dot(normal, lo + part * (hi - lo)));
    };
    const glm::dvec3 middle(0.503, 0.497, 0.501);
    return {{cut(middle, {0.2, 0.3, -1})},
            {cut({0.5, 0.5, 0.4}, {0, 0, 1}), cut({0.5, 0.5, 0.6}, {0, 0, -1})},
            {cut(middle, {-1, 0.1, 0.2}), cut(middle, {0.1, 1, 0.1}), cut(middle, {0, 0.3, 1})}};
}

TEST(HostCaster, SoftLeavesOnEveryAxisAndLevel) {
    for (uint32_t i = 0; i < 3; ++i) {
        SCOPED_TRACE(i);
        expectSame(test::sphereScene(3, glm::dvec3(0), 1, i), i);
    }
}

TEST(HostCaster, EveryInstructionSet) {
    test::onEveryInstructionSet([] {
        expectSame(test::torusScene(), 2);
        expectSame(test::wavesScene(12, 3), 0);
    });
}

TEST(HostCaster, OriginFarAway) {
    const double cell = 1.0 / 1024;
    expectSame(test::sphereScene(3, {483920.0, 3792000.0, 1200.0}, cell), 2);
}

TEST(HostCaster, TrianglesInWallsOfTheGrid) {
    for (uint32_t split = 0; split < 3; ++split) {
        SCOPED_TRACE(split);
        expectSame(test::cubeScene(split), 0);
    }
}

TEST(HostCaster, BuiltMeshOnEveryLevelAndInAMixedCut) {
    IndexedMesh mesh = test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 90, 45);
    test::append(mesh, test::boxMesh({-0.3, -0.3, -0.3}, {0.35, 0.25, 0.3}, 4));
    const test::BuiltMesh built(mesh, 0.03);
    ASSERT_TRUE(built.ok());
    const Dataset& dataset = built.cache().dataset();
    ASSERT_GE(built.levels(), 2u);
    for (uint32_t level = 0; level < built.levels(); ++level) {
        SCOPED_TRACE(level);
        expectSame(built.cache(), cutAtLevel(dataset, level), {-1.4, -1.3, -1.2}, {1.6, 1.7, 1.8});
    }
    expectSame(built.cache(), test::mixedCut(dataset), {-1.4, -1.3, -1.2}, {1.6, 1.7, 1.8});
}

TEST(HostCaster, SectionsOfEveryKindOfLeaf) {
    const glm::dvec3 kLow(-1.4, -1.3, -1.2), kHigh(1.6, 1.7, 1.8);
    const auto scene = test::torusScene();
    const test::BuiltMesh built(test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 90, 45), 0.03);
    ASSERT_TRUE(built.ok());
    const auto castTorus = [&](const std::vector<SectionCut>& sections) {
        expectSame(*scene.cache, cutAtLevel(*scene.dataset, 2), scene.boxMin, scene.boxMax, sections);
    };
    const auto castBuilt = [&](const std::vector<SectionCut>& sections, uint32_t level) {
        expectSame(built.cache(), cutAtLevel(built.cache().dataset(), level), kLow, kHigh, sections);
    };
    for (const auto& sections : cutsThrough(scene.boxMin, scene.boxMax)) castTorus(sections);
    for (const auto& sections : cutsThrough(kLow, kHigh))
        for (const uint32_t level : {0u, 99u}) castBuilt(sections, level);
    test::onEveryInstructionSet([&] {
        castTorus(cutsThrough(scene.boxMin, scene.boxMax)[2]);
        castBuilt(cutsThrough(kLow, kHigh)[2], 0);
        castBuilt(cutsThrough(kLow, kHigh)[2], 99);
    });
}

TEST(HostCaster, NarrowTrianglesAndPoints) {
    const test::BuiltMesh built(test::randomTriangles(3000, 11, true), 0.05);
    ASSERT_TRUE(built.ok());
    expectSame(built.cache(), cutAtLevel(built.cache().dataset(), 99), glm::dvec3(0), glm::dvec3(1));
}

// Along -z upon the root's cube, whose near side spans the most pixels; and from inside of it, where all may be seen.
TEST(HostCaster, WhereASceneMayBeSeen) {
    const auto scene = test::torusScene();
    const auto host = HostScene::create(*scene.cache, std::vector<uint64_t>{0});
    ASSERT_TRUE(host);
    const Dataset& dataset = *scene.dataset;
    const glm::dvec3 origin = dataset.originOf(dataset.pages[0]);
    const double edge = dataset.edgeOf(dataset.pages[0]);
    const glm::ivec2 size(400, 400);
    Camera camera;
    camera.eye = origin + edge * glm::dvec3(0.5, 0.5, 5);
    camera.forward = {0, 0, -1};
    camera.up = {0, 1, 0};
    camera.verticalFov = 2 * std::atan(0.5);
    const PixelBox far = pixelsOf(*host, pictureRays(camera, 400, 400), size);
    // Half an edge, four edges away, of a picture that is as high as the distance.
    const double half = 200 * (0.5 / 4) / 0.5;
    EXPECT_NEAR(far.first.x, 200 - half, 3);
    EXPECT_NEAR(far.first.y, 200 - half, 3);
    EXPECT_NEAR(far.end.x, 200 + half, 3);
    EXPECT_NEAR(far.end.y, 200 + half, 3);
    EXPECT_TRUE(far.meets({200, 200}));
    EXPECT_FALSE(far.meets({0, 200}));
    EXPECT_FALSE(far.meets({200, 384}));
    camera.eye = origin + edge * glm::dvec3(0.5);
    const PixelBox inside = pixelsOf(*host, pictureRays(camera, 400, 400), size);
    EXPECT_EQ(inside.first, glm::ivec2(0));
    EXPECT_EQ(inside.end, size);
}

TEST(HostCaster, StopsBetweenTiles) {
    const auto scene = test::torusScene();
    const auto host = HostScene::create(*scene.cache, cutAtLevel(*scene.dataset, 2));
    ASSERT_TRUE(host);
    const PictureRays rays =
        pictureRays(fitCamera(scene.boxMin, scene.boxMax, {0, 0, -1}, {0, 1, 0}, 0.6, 1), 640, 640);
    int tiles = 0;
    const auto cast = castPicture(*host, rays, {.threads = 1, .cancel = [&] { return tiles == 3; }},
                                  [&](const TileHits&) { ++tiles; });
    ASSERT_FALSE(cast);
    EXPECT_EQ(cast.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(tiles, 3);
}

TEST(HostScene, RefusesWhatIsNoCut) {
    const auto scene = test::torusScene();
    std::vector<uint64_t> cut = cutAtLevel(*scene.dataset, 2);
    cut.push_back(0);
    EXPECT_FALSE(HostScene::create(*scene.cache, cut));
    EXPECT_FALSE(HostScene::create(*scene.cache, std::vector<uint64_t>{0, 1}));
    EXPECT_FALSE(HostScene::create(*scene.cache, std::vector<uint64_t>{1, 1}));
    const auto view = scene.cache->view(1);
    const HostGrid grid{.levels = 3, .log2Cells = view->header.log2Cells};
    EXPECT_TRUE(HostScene::create(grid, std::vector<HostPage>{{.view = view, .place = {1, 0, 1}, .level = 1}}));
    EXPECT_FALSE(HostScene::create(grid, std::vector<HostPage>{{.view = view, .place = {2, 0, 0}, .level = 1}}));
    EXPECT_FALSE(HostScene::create(grid, std::vector<HostPage>{{.view = view, .level = 3}}));
}

}  // namespace
}  // namespace vcp
