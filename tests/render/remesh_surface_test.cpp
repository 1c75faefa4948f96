// Remeshed surfaces in pictures: where they are, what is nearer, tiles, and beside marched ones.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "mesostructure/method.h"
#include "mesostructure/remesh/height_tiles.h"
#include "mesostructure/solids.h"
#include "render/meso_surface.h"
#include "tests/support/meso_surfaces.h"
#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

using namespace meso;

constexpr uint32_t kEdge = 96;

class RemeshedSurfaces : public vcp::test::RendererFixture {
protected:
    void SetUp() override { start(); }

    static MesoSurface surfaceOf(const HeightMap& map, std::string_view base, double height, double cell = 1,
                                 glm::dvec3 place = glm::dvec3(0)) {
        BaseSurface surface = *makeBaseSurface(base, 2);
        for (glm::dvec3& p : surface.positions) p += place;
        auto levels = std::make_shared<const HeightLevels>(*HeightLevels::build(map));
        MesoSurface made;
        made.remeshed = {std::make_shared<const RemeshSurface>(*buildRemeshSurface(surface, levels, height)),
                         {.cell = cell}};
        return made;
    }
    static void certify(MesoSurface& made, double errorPixels) {
        made.remeshed.options.errorPixels = errorPixels;
        made.remeshed.cells.reset();
        if (errorPixels > 0)
            made.remeshed.cells = std::make_shared<CertifiedCells>(*CertifiedCells::create(*made.remeshed.surface));
    }
    static MesoSurface marchedOf(const Asset& asset, std::string_view base, double height) {
        const auto shape = shapeOf(asset);
        const auto method = buildMethod(asset, **shape, {.name = "pyramid"});
        MesoSurface made;
        made.arrays = std::make_shared<const MarchArrays>(*method->arrays());
        const BaseSurface surface = *makeBaseSurface(base, 2);
        made.shell = *buildShell(surface, height, asset.extent);
        made.lift = shadowLift(*made.arrays, tileEdge(surface));
        return made;
    }
    /// Remeshed, with what rays of light march.
    static MesoSurface castingOf(const Asset& asset, std::string_view base, double height, double errorPixels) {
        MesoSurface made = marchedOf(asset, base, height);
        made.remeshed = surfaceOf(*asset.heights, base, height).remeshed;
        certify(made, errorPixels);
        return made;
    }
    static Asset assetOf(HeightMap map) {
        Asset asset;
        asset.extent = map.extent();
        asset.heights = std::move(map);
        return asset;
    }
    static FrameRequest inLowLight(FrameRequest request) {
        request.shading.lightFollowsCamera = false;
        request.shading.lightDirection = {0.8f, 0.3f, 0.3f};
        return request;
    }
    /// Pixels that shadows darken, and those that face the light, whether it reaches them or not.
    struct Shadows {
        std::vector<bool> dark, facing;
        [[nodiscard]] size_t count() const { return size_t(std::ranges::count(dark, true)); }
        /// Pixels that face the light in both and are unlike all pixels about them in the other: the same surface may
        /// be half a pixel aside.
        [[nodiscard]] size_t differing(const Shadows& other) const {
            size_t sum = 0;
            for (int i = 0; i < int(dark.size()); ++i)
                if (facing[size_t(i)] && other.facing[size_t(i)] && !other.hasAbout(i, dark[size_t(i)])) ++sum;
            return sum;
        }
        [[nodiscard]] bool hasAbout(int pixel, bool isDark) const {
            const int edge = int(kEdge);
            for (int y = std::max(pixel / edge - 1, 0); y <= std::min(pixel / edge + 1, edge - 1); ++y)
                for (int x = std::max(pixel % edge - 1, 0); x <= std::min(pixel % edge + 1, edge - 1); ++x)
                    if (dark[size_t(y * edge + x)] == isDark) return true;
            return false;
        }
    };
    Shadows shadowsOf(const std::vector<MesoSurface>& surfaces, FrameRequest request) {
        Shadows found;
        depthsOf(surfaces, request);
        const Picture open = *renderer_->readPicture();
        const glm::vec3 light = glm::normalize(request.shading.lightDirection);
        const auto normals = *renderer_->readNormals();
        for (const glm::vec3 n : normals) found.facing.push_back(glm::dot(n, light) > 0.05f);
        request.shading.shadows = true;
        RendererFixture::draw(request);
        const Picture shaded = *renderer_->readPicture();
        for (size_t i = 0; i < found.facing.size(); ++i)
            found.dark.push_back(shaded.rgba[4 * i] + 4 < open.rgba[4 * i]);
        return found;
    }
    static HeightMap plateau() { return {{8, 8}, 0.25, std::vector<uint16_t>(64, 39321)}; }
    static FrameRequest lookFrom(glm::dvec3 eye, bool isOrthographic = false) {
        FrameRequest request;
        request.width = request.height = kEdge;
        request.camera = {.eye = eye, .forward = glm::normalize(-eye), .up = {0, 1, 0.3}};
        if (isOrthographic) request.camera.projection = Projection::Orthographic, request.camera.orthographicHeight = 3;
        return request;
    }
    std::vector<float> depthsOf(const std::vector<MesoSurface>& surfaces, const FrameRequest& request) {
        EXPECT_TRUE(renderer_->setSurfaces(surfaces).ok());
        RendererFixture::draw(request);
        return *renderer_->readDepth();
    }
};

TEST_F(RemeshedSurfaces, TheCertificateIsInTheStatistics) {
    MesoSurface surface = surfaceOf(*makeHeightField("fbm", 64, 1), "quad", 0.3);
    const auto statsAt = [&](double errorPixels, glm::dvec3 eye) {
        certify(surface, errorPixels);
        EXPECT_TRUE(renderer_->setSurfaces(std::span(&surface, 1)).ok());
        return RendererFixture::draw(lookFrom(eye));
    };
    const FrameStats kept = statsAt(0.5, {0, 0, 5});
    EXPECT_GT(kept.remeshedPixels, 0.1);
    EXPECT_LE(kept.remeshedPixels, 0.5);
    EXPECT_EQ(kept.uncertifiedPatches, 0u);
    // From within the slab nothing is known of the nearest patches.
    EXPECT_GT(statsAt(0.5, {0.3, 0.2, 0.2}).uncertifiedPatches, 0u);
    const FrameStats none = statsAt(0, {0, 0, 5});
    EXPECT_EQ(none.remeshedPixels, 0);
    EXPECT_EQ(none.uncertifiedPatches, 0u);
}

/// A map of 2,048 texels an edge takes 348 tiles, 11.6 MB; a part of them is always there.
class StreamedHeights : public RemeshedSurfaces {
protected:
    static constexpr uint64_t kTile = uint64_t{16} * HeightTiles::kQuads;

    static const MesoSurface& surface() {
        static const MesoSurface made = [] {
            auto levels = std::make_shared<const HeightLevels>(
                *HeightLevels::build(*makeHeightField("fbm", 2048, 1), {.fit = LevelFit::Averaged}));
            MesoSurface it;
            it.remeshed = {std::make_shared<const RemeshSurface>(
                               *buildRemeshSurface(*makeBaseSurface("quad", 1), std::move(levels), 0.1)),
                           {.errorPixels = 0.5}};
            it.remeshed.cells = std::make_shared<CertifiedCells>(*CertifiedCells::create(*it.remeshed.surface));
            return it;
        }();
        return made;
    }
    void startWith(uint64_t budgetBytes) {
        RendererOptions options;
        options.budgetBytes = budgetBytes;
        start(options);
    }
    static FrameRequest near(double x, double y) {
        FrameRequest request = lookFrom({0, 0, 0.25});
        request.camera.eye += glm::dvec3(x, y, 0);
        return request;
    }
};

TEST_F(StreamedHeights, SmallMapsAreThereWhole) {
    startWith(uint64_t{1} << 30);
    // The bytes of all tiles of such square maps end anywhere within a unit of the pool.
    for (const int texels : {256, 384, 640, 896, 1024}) {
        SCOPED_TRACE(texels);
        auto levels = std::make_shared<const HeightLevels>(
            *HeightLevels::build(*makeHeightField("fbm", texels, 1), {.fit = LevelFit::Averaged}));
        MesoSurface whole;
        whole.remeshed = {
            std::make_shared<const RemeshSurface>(*buildRemeshSurface(*makeBaseSurface("quad", 1), levels, 0.1)),
            {.errorPixels = 0.5}};
        whole.remeshed.cells = std::make_shared<CertifiedCells>(*CertifiedCells::create(*whole.remeshed.surface));
        ASSERT_TRUE(renderer_->setSurfaces(std::span(&whole, 1)));
        for (const double distance : {3.0, 0.5}) {
            const FrameStats drawn = draw(lookFrom({0, 0, distance}));
            EXPECT_EQ(drawn.missingHeights, 0u);
            EXPECT_GT(drawn.remeshedPixels, 0);
            EXPECT_EQ(drawn.heightBytes, HeightTiles(levels).count() * kTile);
        }
    }
}

TEST_F(StreamedHeights, AViewLoadsWhatItReads) {
    startWith(uint64_t{1} << 30);
    ASSERT_TRUE(renderer_->setSurfaces(std::span(&surface(), 1)));
    const FrameStats far = draw(lookFrom({0, 0, 3}));
    EXPECT_EQ(far.missingHeights, 0u);
    EXPECT_GT(far.remeshedPixels, 0);
    EXPECT_LT(far.heightBytes, 60 * kTile);
    const FrameStats close = draw(near(0.3, 0.2));
    EXPECT_EQ(close.missingHeights, 0u);
    EXPECT_GT(close.heightBytes, far.heightBytes);
    EXPECT_LT(close.heightBytes, 100 * kTile);
}

TEST_F(StreamedHeights, PicturesDoNotDependOnTheRoom) {
    startWith(uint64_t{1} << 30);
    ASSERT_TRUE(renderer_->setSurfaces(std::span(&surface(), 1)));
    draw(near(0.5, 0.5));
    const Picture expected = *renderer_->readPicture();
    const auto depths = *renderer_->readDepth();
    // Room for little more than the least: each view drives out what the one before had.
    startWith(uint64_t{4} << 20);
    ASSERT_TRUE(renderer_->setSurfaces(std::span(&surface(), 1)));
    for (const double x : {-0.6, -0.2, 0.2, 0.5}) {
        const FrameStats drawn = draw(near(x, 0.5));
        EXPECT_EQ(drawn.missingHeights, 0u);
        EXPECT_LE(drawn.heightBytes, uint64_t{2} << 20);
    }
    EXPECT_EQ(renderer_->readPicture()->rgba, expected.rgba);
    EXPECT_EQ(*renderer_->readDepth(), depths);
}

TEST_F(StreamedHeights, WhereThereIsNoRoomCoarserHeightsAreDrawnAndItIsSaid) {
    startWith(uint64_t{3} << 20);
    MesoSurface fine = surface();
    fine.remeshed.options.errorPixels = 0.05;
    ASSERT_TRUE(renderer_->setSurfaces(std::span(&fine, 1)));
    FrameRequest request = lookFrom({0, 0, 0.9});
    request.width = request.height = 512;
    const auto update = renderer_->settle(request);
    ASSERT_TRUE(update) << update.error().line();
    EXPECT_TRUE(update->relaxed);
    EXPECT_EQ(detailOf(*update, 0.05), Detail::Budget);
    const FrameStats drawn = *renderer_->render(request);
    EXPECT_GT(drawn.missingHeights, 0u);
    EXPECT_EQ(drawn.remeshedPixels, 0) << "nothing is certified";
    EXPECT_EQ(drawn.hitPixels, uint64_t{512} * 512) << "and nothing gapes";
    // They are as near as the coarser levels are: half of this surface's height of 0.2 would be seen as a cliff.
    const auto coarse = *renderer_->readDepth();
    startWith(uint64_t{1} << 30);
    ASSERT_TRUE(renderer_->setSurfaces(std::span(&fine, 1)));
    EXPECT_EQ(draw(request).missingHeights, 0u);
    const auto exact = *renderer_->readDepth();
    float most = 0;
    for (size_t i = 0; i < exact.size(); ++i) most = std::max(most, std::abs(exact[i] - coarse[i]));
    EXPECT_GT(most, 0);
    EXPECT_LT(most, 0.02f);
}

TEST_F(StreamedHeights, TheLeastRoomIsSaid) {
    startWith(uint64_t{1} << 20);
    const auto set = renderer_->setSurfaces(std::span(&surface(), 1));
    ASSERT_FALSE(set);
    EXPECT_EQ(set.error().code, ErrorCode::Limit);
    EXPECT_NE(set.error().message.find("the heights of a remeshed surface take"), std::string::npos);
}

TEST_F(RemeshedSurfaces, PlateauOnAQuadIsAPlane) {
    for (const bool isOrthographic : {true, false}) {
        SCOPED_TRACE(isOrthographic);
        const FrameRequest request = lookFrom({0, 0, 5}, isOrthographic);
        const auto depths = depthsOf({surfaceOf(plateau(), "quad", 0.5)}, request);
        const auto normals = *renderer_->readNormals();
        uint32_t hits = 0;
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const CameraRay ray = cameraRay(request.camera, kEdge, kEdge, x + 0.5, y + 0.5);
                const double t = (0.3 - ray.origin.z) / ray.direction.z;
                const glm::dvec3 p = ray.origin + t * ray.direction;
                const float depth = depths[y * kEdge + x];
                const double inside = 1 - std::max(std::abs(p.x), std::abs(p.y));
                if (std::abs(inside) < 1e-3) continue;
                ASSERT_EQ(std::isfinite(depth), inside > 0) << x << ", " << y;
                if (!std::isfinite(depth)) continue;
                ++hits;
                ASSERT_NEAR(depth, t, 1e-4) << x << ", " << y;
                ASSERT_GT(normals[y * kEdge + x].z, 0.99f) << x << ", " << y;
            }
        EXPECT_GT(hits, 500u);
    }
}

/// As on marched surfaces: a flat texture changes nothing, and normals are bent along the tile.
TEST_F(RemeshedSurfaces, TakeNormalTextures) {
    const double bend = 0.4;
    const auto texture = [](glm::dvec3 n) {
        return std::make_shared<const MesoTexture>(
            makeMesoTexture({4, 4}, std::vector<glm::vec4>(16, glm::vec4(glm::vec3(n), 1))));
    };
    const auto normalsOf = [&](const std::shared_ptr<const MesoTexture>& normals) {
        MesoSurface surface = surfaceOf(plateau(), "quad", 0.5);
        surface.normals = normals;
        EXPECT_TRUE(renderer_->setSurfaces(std::span(&surface, 1)).ok());
        RendererFixture::draw(lookFrom({0, 0, 5}));
        return (*renderer_->readNormals())[kEdge / 2 * kEdge + kEdge / 2];
    };
    EXPECT_GT(normalsOf(texture({0, 0, 1})).z, 0.999f);
    EXPECT_NEAR(normalsOf(texture({std::sin(bend), 0, std::cos(bend)})).x, std::sin(bend), 5e-3);
    EXPECT_NEAR(normalsOf(texture({0, std::sin(bend), std::cos(bend)})).y, std::sin(bend), 5e-3);
}

/// Marched and remeshed surfaces are the same surface; what is nearer is seen, whichever is drawn first.
TEST_F(RemeshedSurfaces, LookLikeMarchedOnes) {
    Asset asset;
    asset.name = "fbm";
    asset.heights = *makeHeightField("fbm", 64, 1);
    asset.extent = asset.heights->extent();
    for (const auto base : {"sphere", "torus"}) {
        SCOPED_TRACE(base);
        const FrameRequest request = lookFrom({2.4, 1.8, 3});
        const MesoSurface marched = marchedOf(asset, base, 0.15), remeshed = surfaceOf(*asset.heights, base, 0.15, 0.5);
        const auto truth = depthsOf({marched}, request), depths = depthsOf({remeshed}, request);
        double sum = 0;
        uint32_t both = 0, one = 0;
        for (size_t i = 0; i < depths.size(); ++i) {
            one += std::isfinite(depths[i]) != std::isfinite(truth[i]);
            if (!std::isfinite(depths[i]) || !std::isfinite(truth[i])) continue;
            ++both, sum += std::abs(depths[i] - truth[i]);
        }
        EXPECT_GT(both, 1000u);
        EXPECT_LT(one, both / 50);
        EXPECT_LT(sum / both, 0.01);
        const auto either = depthsOf({marched, remeshed}, request), other = depthsOf({remeshed, marched}, request);
        for (size_t i = 0; i < depths.size(); ++i) {
            ASSERT_EQ(either[i], std::min(depths[i], truth[i])) << i;
            ASSERT_EQ(other[i], std::min(depths[i], truth[i])) << i;
        }
    }
}

/// Rays of light march the map from where it is in a pixel, however far off the triangle is that is drawn there: seen
/// from straight above, no height moves a pixel, and triangles are as large as they may be.
TEST_F(RemeshedSurfaces, CastTheShadowsOfMarchedOnes) {
    const Asset asset = assetOf(*makeHeightField("fbm", 64, 1));
    for (const auto base : {"quad", "torus"})
        for (const bool isFromAbove : {false, true}) {
            SCOPED_TRACE(std::string(base) + (isFromAbove ? " from above" : ""));
            const FrameRequest request = inLowLight(isFromAbove ? lookFrom({0, 0, 5}, true) : lookFrom({2.4, 1.8, 3}));
            const Shadows marched = shadowsOf({marchedOf(asset, base, 0.3)}, request),
                          remeshed = shadowsOf({castingOf(asset, base, 0.3, 0.5)}, request);
            EXPECT_GT(marched.count(), 300u);
            EXPECT_LT(marched.differing(remeshed) + remeshed.differing(marched), marched.count() / 50);
        }
}

TEST_F(RemeshedSurfaces, FlatOnesAreNotInTheirOwnShadow) {
    const MesoSurface flat = castingOf(assetOf(plateau()), "quad", 0.5, 0.5);
    for (const double distance : {2.0, 5.0, 200.0})
        EXPECT_EQ(shadowsOf({flat}, inLowLight(lookFrom({0, 0, distance}))).count(), 0u) << distance;
}

TEST_F(RemeshedSurfaces, CastNothingWithoutWhatRaysMarch) {
    MesoSurface surface = castingOf(assetOf(*makeHeightField("maze", 64, 1)), "quad", 0.3, 0.5);
    const FrameRequest request = inLowLight(lookFrom({0, 0, 5}));
    EXPECT_GT(shadowsOf({surface}, request).count(), 300u);
    surface.arrays = nullptr, surface.shell = {};
    EXPECT_EQ(shadowsOf({surface}, request).count(), 0u);
}

/// On a marched floor, by rays to the light alone and where all is lit at once, as with occlusion.
TEST_F(RemeshedSurfaces, ShadeWhatIsBelowThem) {
    const Asset asset = assetOf(*makeHeightField("fbm", 64, 1));
    MesoSurface floor = marchedOf(assetOf(plateau()), "quad", 0.2);
    BaseSurface wide = *makeBaseSurface("quad", 2);
    for (glm::dvec3& p : wide.positions) p = 3.0 * p - glm::dvec3(0, 0, 2);
    floor.shell = *buildShell(wide, 0.2, plateau().extent());
    for (const uint32_t occlusionRays : {0u, 1u}) {
        SCOPED_TRACE(occlusionRays);
        FrameRequest request = inLowLight(lookFrom({0, -2, 6}));
        request.shading.lightDirection = {0.5f, 0.3f, 0.8f};
        request.shading.occlusionRays = occlusionRays;
        const Shadows alone = shadowsOf({floor}, request),
                      marched = shadowsOf({floor, marchedOf(asset, "sphere", 0.1)}, request),
                      remeshed = shadowsOf({floor, castingOf(asset, "sphere", 0.1, 0.5)}, request),
                      before = shadowsOf({castingOf(asset, "sphere", 0.1, 0.5), floor}, request);
        EXPECT_EQ(alone.count(), 0u);
        EXPECT_GT(marched.count(), 300u);
        EXPECT_LT(marched.differing(remeshed) + remeshed.differing(marched), marched.count() / 50);
        EXPECT_LT(before.differing(remeshed), marched.count() / 50);
    }
}

/// A cube from 4 to 12, from above: over it, within it and beside it lies a remeshed plateau of 2 x 2 units.
TEST_F(RemeshedSurfaces, NearerOfDatasetAndSurfaceIsSeenAndShadesTheOther) {
    const auto plateauAt = [](glm::dvec3 place) {
        MesoSurface made = vcp::test::mesoSurface(vcp::test::plateau(), "pyramid", "quad", 1, 2, place);
        made.remeshed = surfaceOf(plateau(), "quad", 1, 1, place).remeshed;
        certify(made, 0.5);
        return made;
    };
    const vcp::test::Scene cube = vcp::test::cubeScene(0);
    const auto pixelOf = [](double x) { return size_t(kEdge / 2) * kEdge + size_t(x / 16 * kEdge); };
    for (const uint32_t occlusionRays : {0u, 1u}) {
        SCOPED_TRACE(occlusionRays);
        start();
        show(cube);
        FrameRequest request;
        request.width = request.height = kEdge;
        request.camera = {.eye = {8, 8, 20},
                          .forward = {0, 0, -1},
                          .up = {0, 1, 0},
                          .projection = Projection::Orthographic,
                          .orthographicHeight = 16};
        request.shading.lightFollowsCamera = false;
        request.shading.lightDirection = glm::normalize(glm::vec3(0.5f, 0, 1));
        request.shading.occlusionRays = occlusionRays;
        const Shadows found =
            shadowsOf({plateauAt({6, 8, 13}), plateauAt({10, 8, 10}), plateauAt({2.5, 8, 8})}, request);
        const auto depths = *renderer_->readDepth();
        EXPECT_NEAR(depths[pixelOf(6)], 20 - 13.6, 1e-3);
        EXPECT_NEAR(depths[pixelOf(10)], 20 - 12, 1e-3);
        EXPECT_NEAR(depths[pixelOf(3)], 20 - 8.6, 1e-3);
        // The upper plateau ends at x = 5, and its shadow on the cube at 4.2; that of the cube on the lower one at 2.3.
        EXPECT_TRUE(found.dark[pixelOf(4.7)]);
        EXPECT_TRUE(found.dark[pixelOf(3)]);
        for (const double x : {1.8, 4.05, 6.0, 10.0}) EXPECT_FALSE(found.dark[pixelOf(x)]) << x;
    }
}

TEST_F(RemeshedSurfaces, ASphereHasNoHoles) {
    const double radius = 1 + 0.6 * 0.2;
    const FrameRequest request = lookFrom({1.5, 2, 2.5});
    for (const double cell : {1.0, 5.0, 20.0}) {
        const auto depths = depthsOf({surfaceOf(plateau(), "sphere", 0.2, cell)}, request);
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const CameraRay ray = cameraRay(request.camera, kEdge, kEdge, x + 0.5, y + 0.5);
                const double along = -glm::dot(ray.origin, ray.direction),
                             off = glm::length(ray.origin + along * ray.direction);
                const bool isHit = std::isfinite(depths[y * kEdge + x]);
                ASSERT_FALSE(off < 0.97 * radius && !isHit) << x << ", " << y;
                ASSERT_FALSE(off > 1.01 * radius && isHit) << x << ", " << y;
            }
    }
}

/// A picture in tiles is the picture: the grid is the whole picture's.
TEST_F(RemeshedSurfaces, TilesAreTheWholePictures) {
    const HeightMap map = *makeHeightField("ridged", 64, 1);
    const MesoSurface surface = surfaceOf(map, "torus", 0.2, 4);
    FrameRequest request = lookFrom({2.4, 1.8, 3});
    const auto whole = depthsOf({surface}, request);
    const Picture picture = *renderer_->readPicture();
    uint32_t differs = 0;
    for (uint32_t ty = 0; ty < 2; ++ty)
        for (uint32_t tx = 0; tx < 3; ++tx) {
            FrameRequest tile = request;
            tile.width = kEdge / 3, tile.height = kEdge / 2;
            tile.tile = PictureTile{tx * tile.width, ty * tile.height, kEdge, kEdge};
            RendererFixture::draw(tile);
            const auto depths = *renderer_->readDepth();
            for (uint32_t y = 0; y < tile.height; ++y)
                for (uint32_t x = 0; x < tile.width; ++x) {
                    const float a = depths[y * tile.width + x],
                                b = whole[(ty * tile.height + y) * kEdge + tx * tile.width + x];
                    differs += std::isfinite(a) != std::isfinite(b) || (std::isfinite(a) && std::abs(a - b) > 1e-3f);
                }
        }
    // Viewports of other sizes round vertices elsewhere within a pixel.
    EXPECT_LT(differs, kEdge * kEdge / 500);
    EXPECT_EQ(picture.width, kEdge);
}

TEST_F(RemeshedSurfaces, PicksAndColours) {
    MesoSurface surface = surfaceOf(plateau(), "quad", 0.5);
    surface.colour = {1, 0, 0};
    FrameRequest request = lookFrom({0, 0, 5});
    request.shading.mode = ShadingMode::Unlit;
    depthsOf({surface}, request);
    const auto hit = renderer_->pick(kEdge / 2, kEdge / 2);
    ASSERT_TRUE(hit && *hit);
    EXPECT_NEAR((*hit)->position.z, 0.3, 1e-4);
    const Picture picture = *renderer_->readPicture();
    const size_t middle = 4 * (size_t{kEdge} / 2 * kEdge + kEdge / 2);
    EXPECT_EQ(picture.rgba[middle], 255);
    EXPECT_EQ(picture.rgba[middle + 1], 0);
}

}  // namespace
}  // namespace vcp
