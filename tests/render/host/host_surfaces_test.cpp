// Surfaces with mesostructure by the host against those by the shaders, pixel by pixel.
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>

#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"
#include "mesostructure/appearance.h"
#include "mesostructure/base_transfer.h"
#include "mesostructure/shell_paths.h"
#include "tests/support/host_comparison.h"
#include "tests/support/meso_surfaces.h"

namespace vcp {
namespace {

using test::Difference;
using test::heightAsset;
using test::mesoSurface;
using test::plateau;
using test::solidAsset;

constexpr uint32_t kWidth = 144, kHeight = 112;

meso::Asset relief() { return heightAsset("fbm", *meso::makeHeightField("fbm", 64, 1)); }

/// Perspective from a side, close, and orthographic from above.
std::vector<Camera> views() {
    const auto towards = [](glm::dvec3 eye, glm::dvec3 at) {
        return Camera{.eye = eye, .forward = glm::normalize(at - eye), .up = {0, 0, 1}};
    };
    return {towards({2.1, -1.7, 1.4}, {0, 0, 0.1}),
            towards({0.31, -0.6, 0.42}, {0.2, 0.1, 0.1}),
            {.eye = {0, 0, 5},
             .forward = {0, 0, -1},
             .up = {0, 1, 0},
             .projection = Projection::Orthographic,
             .orthographicHeight = 2.7}};
}

class HostSurfaces : public test::CastByRendererTest {
protected:
    static FrameRequest lookFrom(const Camera& camera) {
        FrameRequest request = test::requestOf(camera, kWidth, kHeight);
        request.shading.lightFollowsCamera = false;
        request.shading.lightDirection = {0.8f, 0.2f, 0.35f};
        return request;
    }
    void setSurfaces(const std::vector<MesoSurface>& surfaces) {
        ASSERT_TRUE(host_->setSurfaces(surfaces));
        ASSERT_TRUE(renderer_->setSurfaces(surfaces));
    }
    /// Compares what both draw; depths by a ten-thousandth of the surfaces' 2 units.
    Difference differenceOf(const FrameRequest& request, uint32_t samples = 1) {
        const test::Planes host = test::drawnBy(*host_, request, samples),
                           device = test::drawnBy(*renderer_, request, samples);
        return test::compare(host, device, 0.2);
    }
    /// Hits may differ where a ray passes an edge or a silhouette of texels and cells: 6 of 10,000 did at most.
    static void expectAlike(const Difference& d, double most = 2e-3) {
        EXPECT_GT(d.hits, 1000u);
        EXPECT_LE(double(d.state + d.depth + d.normal + d.colour), most * double(d.hits))
            << d.state << " states, " << d.depth << " depths, " << d.normal << " normals, " << d.colour
            << " colours of " << d.hits << " hits";
    }
};

TEST_F(HostSurfaces, EveryMethodFromEveryView) {
    for (const auto method : meso::methodNames()) {
        SCOPED_TRACE(method);
        Difference all;
        const meso::Asset asset = meso::methodFits(method, relief()) ? relief() : solidAsset("beads");
        setSurfaces({mesoSurface(asset, std::string(method), "torus", 0.2)});
        for (const Camera& camera : views()) {
            FrameRequest request = lookFrom(camera);
            // Another pipeline a method: shadows are cast by the same source.
            request.shading.shadows = method == "boxes" || method == "pyramid";
            all += differenceOf(request);
        }
        // Within a slice, normals are blended of such as point to all sides: where they nearly cancel, rounding turns
        // them.
        expectAlike(all, method == "slices" ? 1e-2 : 2e-3);
    }
}

TEST_F(HostSurfaces, TheCameraMayBeInAPrism) {
    // Between the beads over a torus, against rays in double through the same shell, and against the shaders.
    const meso::Asset asset = solidAsset("beads");
    const auto shape = *meso::shapeOf(asset);
    const double height = 0.2, tiles = 2;
    meso::BaseSurface base = *meso::makeBaseSurface("torus", tiles);
    setSurfaces({mesoSurface(asset, "boxes", "torus", height, tiles)});
    const meso::ShellPaths paths({{shape.get(), base, height}}, 0.5);
    uint64_t compared = 0, off = 0;
    Difference all;
    // The slab's place in the tile changes with the turn; where a bead is in the way, the camera is in it and sees it.
    for (const double turn : {0.1, 1.3, 2.2, 4.0})
        for (const double over : {0.03, 0.1, 0.17}) {
            const glm::dvec3 out(std::cos(turn), std::sin(turn), 0), along(-out.y, out.x, 0);
            FrameRequest request =
                lookFrom({.eye = (1.45 + over) * out, .forward = glm::normalize(along - 0.2 * out), .up = {0, 0, 1}});
            const test::Planes drawn = test::drawnBy(*host_, request);
            all += differenceOf(request);
            for (uint32_t y = 0; y < kHeight; y += 3)
                for (uint32_t x = 0; x < kWidth; x += 3) {
                    const CameraRay ray = cameraRay(request.camera, kWidth, kHeight, x + 0.5, y + 0.5);
                    const meso::TileMeeting truth = paths.meet(ray.origin, ray.direction);
                    const float depth = drawn.depth[y * kWidth + x];
                    const bool hits = truth.kind == meso::TileMeeting::Kind::Surface;
                    ++compared;
                    if (hits != std::isfinite(depth))
                        ++off;
                    else if (hits)  // a grid of 8 cells shows a bead to within a part of a cell
                        off += std::abs(glm::distance(truth.point.at, ray.origin) - double(depth)) > 0.15;
                }
        }
    EXPECT_GT(compared, 20000u);
    EXPECT_LT(double(off), 0.1 * double(compared)) << off;
    expectAlike(all);
}

TEST_F(HostSurfaces, SolidsWithAndWithoutTheirBase) {
    for (const char* name : {"beads", "weave"})
        for (const bool withBase : {false, true}) {
            SCOPED_TRACE(testing::Message() << name << withBase);
            Difference all;
            for (const char* method : {"boxes", "ddm"}) {
                MesoSurface surface = mesoSurface(solidAsset(name), method, "cylinder", 0.25);
                surface.withBase = withBase;
                setSurfaces({surface});
                for (const Camera& camera : views()) {
                    FrameRequest request = lookFrom(camera);
                    request.shading.shadows = true;
                    all += differenceOf(request);
                }
            }
            expectAlike(all);
        }
}

TEST_F(HostSurfaces, ModesSectionsLightsTexturesAndFar) {
    std::vector<glm::vec4> colours, normals;
    for (int i = 0; i < 16 * 16; ++i) {
        colours.emplace_back(float(i % 16) / 15, float(i / 16) / 15, 0.4f, 1);
        normals.emplace_back(0.3f * float(i % 3 - 1), 0.2f * float(i % 5 - 2), 1, 0);
    }
    MesoSurface textured = mesoSurface(relief(), "pyramid", "sphere", 0.2);
    textured.colours = std::make_shared<const MesoTexture>(makeMesoTexture({16, 16}, colours));
    textured.normals = std::make_shared<const MesoTexture>(makeMesoTexture({16, 16}, normals));
    MesoSurface small = mesoSurface(relief(), "boxes", "quad", 0.004, 200, {0.5, 0.3, -0.2});
    small.far = std::make_shared<const meso::Appearance>(appearanceOf(**shapeOf(relief()), 0.5, 64));
    setSurfaces({textured, small});
    const auto compared = [&](const auto& change, uint32_t samples = 1) {
        Difference all;
        for (const Camera& camera : views()) {
            FrameRequest request = lookFrom(camera);
            change(request);
            all += differenceOf(request, samples);
        }
        expectAlike(all);
    };
    for (const ShadingMode mode : {ShadingMode::Lit, ShadingMode::Clay, ShadingMode::Unlit, ShadingMode::Normals,
                                   ShadingMode::Level, ShadingMode::Error, ShadingMode::Steps})
        for (const bool shadows : {false, true}) {
            SCOPED_TRACE(testing::Message() << int(mode) << shadows);
            compared([&](FrameRequest& request) { request.shading.mode = mode, request.shading.shadows = shadows; });
        }
    for (const bool shadows : {false, true}) {
        SCOPED_TRACE(testing::Message() << "lights" << shadows);
        compared([&](FrameRequest& request) {
            request.shading.shadows = shadows;
            request.shading.lightStrength = 0.6f;
            request.shading.moreLights = {{false, {-0.5f, 0.4f, 0.3f}, 0.5f}, {true, {0, 0, 1}, 0.3f}};
        });
    }
    SCOPED_TRACE("environment");
    compared([&](FrameRequest& request) { request.shading.environment = environmentNamed("clear"); });
    SCOPED_TRACE("sections");
    compared([&](FrameRequest& request) {
        request.shading.shadows = true;
        request.sections = {{{0.3, 0.1, -1}, -0.4}, {{1, 0, 0}, -0.6}};
    });
    SCOPED_TRACE("samples");
    compared([&](FrameRequest&) {}, 4);
    const FrameRequest from = lookFrom(views()[0]);
    ASSERT_TRUE(host_->settle(from));
    EXPECT_GT(host_->render(from)->farHits, 100u);
    const auto iterations = *host_->readIterations();
    EXPECT_GT(std::accumulate(iterations.begin(), iterations.end(), uint64_t{0}), 1000u);
}

std::shared_ptr<const meso::TransferVolume> transferOf(const meso::Asset& asset) {
    return std::make_shared<const meso::TransferVolume>(
        *traceTransfer(**shapeOf(asset), {.cells = 12, .albedo = 0.7, .paths = 24}));
}

/// What the torus of mesoSurface does to light from everywhere.
std::shared_ptr<const meso::BaseTransfer> torusTransfer(double albedo) {
    meso::BaseScene scene;
    scene.add(*meso::makeBaseSurface("torus", 2), 0.1, albedo);
    const IndexedMesh mesh{scene.positions, scene.triangles, {}};
    const MeshBvh bvh(mesh);
    meso::BaseTransferOptions options{.rays = 64};
    options.cast = [&](glm::dvec3 origin, glm::dvec3 direction) -> std::optional<meso::BaseHit> {
        const auto hit = bvh.nearestHit(origin, direction);
        if (!hit) return std::nullopt;
        return meso::BaseHit{hit->triangle, hit->t};
    };
    const std::array all{std::pair(0u, uint32_t(scene.positions.size()))};
    auto made = traceBaseTransfer(scene, all, options);
    EXPECT_TRUE(made) << made.error().line();
    return std::make_shared<const meso::BaseTransfer>(std::move((*made)[0]));
}

TEST_F(HostSurfaces, WithTransferAsTheShadersHaveIt) {
    MesoSurface hollow = mesoSurface(relief(), "boxes", "torus", 0.3);
    hollow.transfer = transferOf(relief());
    hollow.baseTransfer = torusTransfer(0.6);
    MesoSurface beads = mesoSurface(solidAsset("beads"), "boxes", "cylinder", 0.2, 3, {0.6, -0.3, 0.2});
    beads.transfer = transferOf(solidAsset("beads"));
    // One without lies before and behind the others, in all orders of drawing.
    const MesoSurface open = mesoSurface(relief(), "pyramid", "sphere", 0.2, 2, {-0.5, -0.4, 0.3});
    for (const bool withShadows : {false, true}) {
        Difference all;
        const auto surfaces = withShadows ? std::vector{open, beads, hollow} : std::vector{hollow, open, beads};
        setSurfaces(surfaces);
        for (const Camera& camera : views()) {
            FrameRequest request = lookFrom(camera);
            request.shading.environment = environmentNamed("clear");
            request.shading.shadows = withShadows;
            request.shading.lightStrength = withShadows ? 0.4f : 0.0f;
            all += differenceOf(request);
        }
        expectAlike(all);
    }
}

TEST_F(HostSurfaces, TransferOfAPlaneLooksOpenOnAnySurface) {
    // A plane hides nothing from itself: its transfer is the clamped cosine, in the frame of each piece of the base,
    // mirrored maps too. What is drawn with it is what is drawn without.
    MesoSurface with = mesoSurface(plateau(), "boxes", "sphere", 0.1);
    with.transfer = std::make_shared<const meso::TransferVolume>(
        *traceTransfer(**shapeOf(plateau()), {.cells = 4, .paths = 20000}));
    MesoSurface without = with;
    without.transfer = nullptr;
    MesoSurface relieved = mesoSurface(relief(), "boxes", "sphere", 0.3);
    MesoSurface shadowed = relieved;
    shadowed.transfer = transferOf(relief());
    FrameRequest request = lookFrom(views()[0]);
    request.shading.environment = environmentNamed("clear");
    request.shading.environment->turn = 50;
    const auto drawn = [&](const MesoSurface& surface) {
        EXPECT_TRUE(host_->setSurfaces(std::vector{surface}));
        return test::drawnBy(*host_, request).picture;
    };
    const auto apart = [&](const Picture& a, const Picture& b) {
        double sum = 0;
        int most = 0;
        for (size_t i = 0; i < a.rgba.size(); ++i)
            sum += std::abs(a.rgba[i] - b.rgba[i]), most = std::max(most, std::abs(a.rgba[i] - b.rgba[i]));
        return std::pair(sum / double(a.rgba.size()), most);
    };
    const auto [mean, most] = apart(drawn(with), drawn(without));
    EXPECT_LE(most, 4);
    EXPECT_LT(mean, 0.5);
    EXPECT_GT(apart(drawn(shadowed), drawn(relieved)).first, 1);
    // A torus that gives nothing back takes light from itself, and what it lets through turns with the light.
    MesoSurface ring = mesoSurface(relief(), "boxes", "torus", 0.3), shaded = ring;
    ring.transfer = transferOf(relief());
    shaded.transfer = ring.transfer, shaded.baseTransfer = torusTransfer(0);
    const Picture before = drawn(ring), after = drawn(shaded);
    EXPECT_GT(apart(before, after).first, 0.3);
    EXPECT_LT(std::accumulate(after.rgba.begin(), after.rgba.end(), uint64_t{0}),
              std::accumulate(before.rgba.begin(), before.rgba.end(), uint64_t{0}));
    request.shading.environment->turn = 190;
    EXPECT_GT(apart(after, drawn(shaded)).first, 1);
    request.shading.environment->turn = 50;
    EXPECT_EQ(drawn(shaded), after);
    // What no picture asks for makes no pipeline and no bytes.
    ASSERT_TRUE(renderer_->setSurfaces(std::vector{without}));
    request.shading.environment.reset();
    const auto plain = test::drawnBy(*renderer_, request).picture;
    const uint32_t pipelines = renderer_->render(request)->pipelines;
    ASSERT_TRUE(renderer_->setSurfaces(std::vector{with}));
    EXPECT_EQ(test::drawnBy(*renderer_, request).picture, plain);
    EXPECT_EQ(renderer_->render(request)->pipelines, pipelines);
    request.shading.environment = environmentNamed("clear");
    test::drawnBy(*renderer_, request);
    EXPECT_GT(renderer_->render(request)->pipelines, pipelines);
}

TEST_F(HostSurfaces, NearerOfDatasetAndSurface) {
    const auto scene = test::cubeScene(0);
    const std::vector<MesoSurface> surfaces{mesoSurface(relief(), "boxes", "torus", 0.3, 2, {11.5, 8, 11})};
    ASSERT_TRUE(host_->open({{scene.dataset, scene.source, {}}}, surfaces));
    ASSERT_TRUE(renderer_->open({{scene.dataset, scene.source, {}}}, surfaces));
    ASSERT_TRUE(casting_->open({{scene.dataset, scene.source, {}}}, surfaces));
    FrameRequest request = test::requestOf(
        {.eye = {20, -4, 19}, .forward = glm::normalize(glm::dvec3(-10, 12, -9)), .up = {0, 0, 1}}, 320, 240);
    const Difference d = differenceOf(request);
    test::expectFew(d);
    // The renderer whose device is the processor draws the same, byte by byte, by no shader, and knows what is hit.
    const test::Planes host = test::drawnBy(*host_, request), cast = test::drawnBy(*casting_, request);
    EXPECT_EQ(host.picture, cast.picture);
    EXPECT_EQ(host.depth, cast.depth);
    EXPECT_EQ(casting_->render(request)->pipelines, 0u);
    EXPECT_TRUE(casting_->render(request)->onHost);
    uint64_t onSurface = 0, onDataset = 0;
    ASSERT_TRUE(renderer_->render(request));
    for (uint32_t y = 1; y < request.height; y += 7)
        for (uint32_t x = 1; x < request.width; x += 7) {
            const auto a = *casting_->pick(x, y), b = *renderer_->pick(x, y);
            ASSERT_EQ(a.has_value(), b.has_value());
            if (!a) continue;
            EXPECT_EQ(a->onSurface, b->onSurface);
            (a->onSurface ? onSurface : onDataset) += 1;
        }
    EXPECT_GT(onSurface, 20u);
    EXPECT_GT(onDataset, 20u);
}

TEST_F(HostSurfaces, TilesAreCutFromTheWholeAndBytesFromTheBudget) {
    const std::vector<MesoSurface> surfaces{mesoSurface(relief(), "boxes", "sphere", 0.2)};
    setSurfaces(surfaces);
    FrameRequest request = lookFrom(views()[0]);
    const Picture whole = test::drawnBy(*host_, request).picture;
    request.width = 40, request.height = 24;
    request.tile = PictureTile{48, 32, kWidth, kHeight};
    const Picture tile = test::drawnBy(*host_, request).picture;
    int largest = 0;
    for (uint32_t y = 0; y < 24; ++y)
        for (uint32_t i = 0; i < 160; ++i)
            largest = std::max(
                largest, std::abs(int(tile.rgba[y * 160 + i]) - int(whole.rgba[4 * ((y + 32) * kWidth + 48) + i])));
    EXPECT_LE(largest, 2);
    ASSERT_TRUE(host_->settle(request));
    const uint64_t bytes = host_->render(request)->surfaceBytes;
    EXPECT_GT(bytes, 1000u);
    const auto cube = test::cubeScene(0);
    RendererOptions options;
    options.budgetBytes = (1 << 20) + bytes - 1;
    host_ = HostRenderer::create(options).value();
    EXPECT_EQ(host_->open({{cube.dataset, cube.source, {}}}, surfaces).error().code, ErrorCode::Limit);
    EXPECT_TRUE(host_->open({{cube.dataset, cube.source, {}}}, {}));
    EXPECT_EQ(host_->setSurfaces(surfaces).error().code, ErrorCode::Limit);
    options.budgetBytes += 1;
    host_ = HostRenderer::create(options).value();
    EXPECT_TRUE(host_->open({{cube.dataset, cube.source, {}}}, surfaces));
}

TEST_F(HostSurfaces, WhatIsMovedIsSeenAsIfItLayThere) {
    const glm::dvec3 by(0.25, -0.5, 0.375);
    const MesoSurface ground = mesoSurface(relief(), "pyramid", "quad", 0.2);
    const auto ball = [](glm::dvec3 place) { return mesoSurface(solidAsset("ball"), "boxes", "quad", 1, 2, place); };
    for (const Camera& camera : views()) {
        FrameRequest request = lookFrom(camera);
        request.shading.shadows = true;
        request.sections = {{{0, 1, 0}, -0.9}};
        setSurfaces({ground, ball(by)});
        const test::Planes onHost = test::drawnBy(*host_, request, 1), onDevice = test::drawnBy(*renderer_, request, 1);
        setSurfaces({ground, ball({0, 0, 0})});
        const test::Planes unmoved = test::drawnBy(*host_, request, 1);
        request.surfacesMoved = {{0, 0, 0}, by};
        for (const auto& [there, moved] : {std::pair(onHost, test::drawnBy(*host_, request, 1)),
                                           std::pair(onDevice, test::drawnBy(*renderer_, request, 1))}) {
            const Difference d = test::compare(there, moved, 0.2);
            EXPECT_GT(d.hits, 1000u);
            EXPECT_EQ(d.state + d.depth + d.normal + d.colour, 0u);
            EXPECT_GT(test::compare(unmoved, moved, 0.2).state, 100u);
        }
    }
}

TEST_F(HostSurfaces, IsCancelledBetweenTiles) {
    setSurfaces({mesoSurface(plateau(), "boxes", "quad", 0.2)});
    const FrameRequest request = lookFrom(views()[0]);
    ASSERT_TRUE(host_->settle(request));
    std::atomic<int> asked = 0;
    const auto stopped = host_->render(request, [&] { return ++asked > 3; });
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
    EXPECT_FALSE(host_->readPicture());
    EXPECT_TRUE(host_->render(request));
}

/// A ball over a slab, by closed forms: the slab fills |x|, |y| <= 1 and 0 <= z <= kTop.
struct BallOverSlab {
    static constexpr double kTop = 0.3, kUnit = 0.05, kFar = 1e30;
    glm::dvec3 middle;
    double radius = 0.41 * 16 * kUnit;

    [[nodiscard]] Similarity placement() const {
        return {.rotation = {1, 0, 0, 0},
                .scale = kUnit,
                .translation = middle - kUnit * 16 * glm::dvec3(0.503, 0.497, 0.501)};
    }
    [[nodiscard]] double ball(glm::dvec3 o, glm::dvec3 d) const {
        const double b = glm::dot(d, o - middle), root = b * b - glm::dot(o - middle, o - middle) + radius * radius;
        const double t = root < 0 ? -1 : -b - std::sqrt(root);
        return t > 0 ? t : kFar;
    }
    static double slab(glm::dvec3 o, glm::dvec3 d) {
        double enter = 0, leave = kFar;
        const glm::dvec3 low(-1, -1, 0), high(1, 1, kTop);
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (low[axis] - o[axis]) / d[axis], b = (high[axis] - o[axis]) / d[axis];
            enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
        }
        return enter < leave ? enter : kFar;
    }
};

/// Counts of pixels by what is seen and whether the other stands in its light, and those that are drawn otherwise.
struct ShadowCounts {
    uint64_t onBall[2] = {}, onSlab[2] = {};
    uint64_t wrong = 0, doubtful = 0;
};

ShadowCounts countShadows(const BallOverSlab& truth, const FrameRequest& request, const Picture& lit,
                          const Picture& shadowed) {
    ShadowCounts counts;
    const glm::dvec3 light = glm::normalize(glm::dvec3(request.shading.lightDirection));
    for (uint32_t y = 0; y < request.height; ++y)
        for (uint32_t x = 0; x < request.width; ++x) {
            // What is seen, and its light, are clear where the ray and its neighbours a little aside agree.
            const auto seen = [&](glm::dvec2 aside) {
                const CameraRay beside =
                    cameraRay(request.camera, request.width, request.height, x + 0.5 + aside.x, y + 0.5 + aside.y);
                const double ball = truth.ball(beside.origin, beside.direction),
                             slab = truth.slab(beside.origin, beside.direction);
                if (std::min(ball, slab) >= truth.kFar) return 0;
                const glm::dvec3 at = beside.origin + std::min(ball, slab) * beside.direction;
                if (ball < slab)
                    return glm::dot(at - truth.middle, light) <= 0 ? 1 : truth.slab(at, light) < truth.kFar ? 3 : 2;
                const bool isTop = std::abs(at.z - truth.kTop) < 1e-9;
                return !isTop || light.z <= 0 ? 4 : truth.ball(at, light) < truth.kFar ? 6 : 5;
            };
            const int what = seen({0, 0});
            bool isClear = true;
            for (int i = 0; i < 8; ++i)
                isClear = isClear && seen({1.5 * std::cos(i * M_PI / 4), 1.5 * std::sin(i * M_PI / 4)}) == what;
            if (!isClear) {
                ++counts.doubtful;
                continue;
            }
            // Sides of the slab, and what is turned away, say nothing.
            if (what == 0 || what == 1 || what == 4) continue;
            const size_t pixel = size_t{y} * request.width + x;
            const bool isDark = what == 3 || what == 6;
            counts.wrong += (test::channelsApart(lit, shadowed, pixel) > 2) == isDark ? 0 : 1;
            ++(what < 4 ? counts.onBall : counts.onSlab)[isDark ? 1 : 0];
        }
    return counts;
}

TEST_F(HostSurfaces, ScanAndReliefCastShadowsOnEachOther) {
    const auto scene = test::sphereScene(1);
    const struct {
        BallOverSlab truth;
        Camera camera;
        glm::vec3 light;
    } cases[] = {{{{0.1, -0.05, 0.75}},
                  {.eye = {1.5, -2.2, 2.4}, .forward = glm::normalize(glm::dvec3(-1.5, 2.2, -2)), .up = {0, 0, 1}},
                  {0.45f, 0.3f, 0.9f}},
                 {{{0.8, -0.05, 0.75}},
                  {.eye = {2.4, -2.2, 0.1}, .forward = glm::normalize(glm::dvec3(-1.6, 2.2, 0.5)), .up = {0, 0, 1}},
                  {0.75f, -0.1f, -1.0f}}};
    for (const auto& [truth, camera, light] : cases) {
        std::vector<MesoSurface> surfaces{mesoSurface(plateau(), "boxes", "quad", 0.5)};
        // Where shadow rays start is not part of the closed forms, and its texels are wide.
        surfaces[0].lift = 1e-3;
        const std::array<PictureRenderer*, 2> both{host_.get(), renderer_.get()};
        for (PictureRenderer* const each : both) {
            SCOPED_TRACE(each->device().name);
            ASSERT_TRUE(each->open({{scene.dataset, scene.source, truth.placement()}}, surfaces));
            FrameRequest request = lookFrom(camera);
            request.width = 400, request.height = 300;
            request.shading.lightDirection = light;
            const Picture lit = test::drawnBy(*each, request).picture;
            request.shading.shadows = true;
            const Picture shadowed = test::drawnBy(*each, request).picture;
            const ShadowCounts counts = countShadows(truth, request, lit, shadowed);
            EXPECT_EQ(counts.wrong, 0u);
            const bool fromAbove = light.z > 0;
            EXPECT_GT(fromAbove ? counts.onSlab[1] : counts.onBall[1], 900u);
            EXPECT_GT(counts.onBall[0], 1000u);
            EXPECT_LT(counts.doubtful, 12000u);
        }
    }
}

// Of several surfaces and datasets, in lights, samples and from far.
TEST_F(HostSurfaces, WhatTheyCastOnEachOtherIsTheSame) {
    const auto scene = test::sphereScene(1);
    const BallOverSlab truth{{0.1, -0.05, 0.65}};
    MesoSurface small = mesoSurface(relief(), "boxes", "quad", 0.004, 200, {0.5, 0.3, 0.6});
    small.far = std::make_shared<const meso::Appearance>(appearanceOf(**shapeOf(relief()), 0.5, 64));
    const std::vector<MesoSurface> surfaces{
        small, mesoSurface(solidAsset("weave"), "boxes", "cylinder", 0.2, 3, {0.5, 1, 0.5})};
    Similarity second = truth.placement();
    second.translation += glm::dvec3(-0.8, 0.3, 0.2);
    const std::vector<PlacedDataset> one{{scene.dataset, scene.source, truth.placement()}},
        two{one[0], {scene.dataset, scene.source, second}};
    const auto compared = [&](const std::vector<PlacedDataset>& datasets, const auto& change, uint32_t samples = 1) {
        ASSERT_TRUE(host_->open(datasets, surfaces));
        ASSERT_TRUE(renderer_->open(datasets, surfaces));
        FrameRequest request = lookFrom(views()[datasets.size() % 2]);
        change(request);
        expectAlike(differenceOf(request, samples), 4e-3);
    };
    for (const auto& datasets : {std::vector<PlacedDataset>(), one, two}) {
        SCOPED_TRACE(datasets.size());
        if (!datasets.empty()) compared(datasets, [](FrameRequest& request) { request.shading.shadows = true; });
        compared(datasets, [](FrameRequest& request) { request.shading.occlusionRays = 8; });
    }
    compared(one, [](FrameRequest& request) {
        request.shading.shadows = true;
        request.shading.occlusionRays = 4;
        request.shading.lightStrength = 0.6f;
        request.shading.moreLights = {{false, {-0.5f, 0.4f, 0.3f}, 0.5f}};
        request.sections = {{{0.3, 0.2, -1}, -0.6}};
    });
    compared(
        one, [](FrameRequest& request) { request.shading.shadows = true; }, 4);
}

// What takes a software device long is drawn in steps, between which another view draws the same surfaces.
TEST_F(HostSurfaces, StepByStepBesideAnotherViewTheyAreTheSame) {
    const auto scene = test::sphereScene(1);
    const BallOverSlab truth{{0.1, -0.05, 0.65}};
    ASSERT_TRUE(renderer_->open({{scene.dataset, scene.source, truth.placement()}},
                                std::vector{mesoSurface(relief(), "boxes", "quad", 0.3)}));
    FrameRequest request = lookFrom(views()[0]), smaller = lookFrom(views()[1]);
    request.shading.occlusionRays = 16;
    request.shading.shadows = true;
    smaller.width = 64, smaller.height = 48;
    smaller.shading.shadows = true;
    const Picture expected = test::drawnBy(*renderer_, request).picture;
    auto other = renderer_->addView();
    ASSERT_TRUE(other) << other.error().line();
    const Picture beside = test::drawnBy(**other, smaller).picture;
    ASSERT_TRUE(renderer_->settle(request) && renderer_->renderAhead(request));
    ASSERT_TRUE(renderer_->isUnfinished());
    int steps = 0;
    for (; renderer_->isUnfinished(); ++steps) {
        ASSERT_TRUE((*other)->render(smaller));
        ASSERT_TRUE(renderer_->continueFrame());
    }
    EXPECT_GT(steps, 20);
    EXPECT_EQ(renderer_->readPicture().value(), expected);
    EXPECT_EQ((*other)->readPicture().value(), beside);
}

/// With rays into the sky, a scan stands in a hollow of light on the relief, and is darker next to it.
TEST_F(HostSurfaces, ScanAndReliefOccludeEachOther) {
    const auto scene = test::sphereScene(1);
    const BallOverSlab truth{{0.1, -0.05, 0.65}};
    FrameRequest request =
        lookFrom({.eye = {1.5, -2.2, 1.4}, .forward = glm::normalize(glm::dvec3(-1.5, 2.2, -1)), .up = {0, 0, 1}});
    request.shading.occlusionRays = 16;
    request.shading.occlusionRadius = 0.5;
    const std::vector<MesoSurface> surfaces{mesoSurface(plateau(), "boxes", "quad", 0.5)};
    const std::vector<PlacedDataset> ball{{scene.dataset, scene.source, truth.placement()}};
    ASSERT_TRUE(host_->open(ball, surfaces));
    const test::Planes both = test::drawnBy(*host_, request);
    ASSERT_TRUE(host_->open(ball, {}));
    const test::Planes ballAlone = test::drawnBy(*host_, request);
    ASSERT_TRUE(host_->open({}, surfaces));
    const test::Planes slabAlone = test::drawnBy(*host_, request);
    uint64_t darker[2] = {}, brighter = 0;
    for (size_t i = 0; i < both.depth.size(); ++i) {
        if (!std::isfinite(both.depth[i])) continue;
        const bool onBall = both.depth[i] == ballAlone.depth[i];
        const int apart = int((onBall ? ballAlone : slabAlone).picture.rgba[4 * i]) - int(both.picture.rgba[4 * i]);
        darker[onBall ? 1 : 0] += apart > 4 ? 1 : 0;
        brighter += apart < -1 ? 1 : 0;
    }
    EXPECT_GT(darker[0], 300u);
    EXPECT_GT(darker[1], 100u);
    EXPECT_EQ(brighter, 0u);
}

}  // namespace
}  // namespace vcp
