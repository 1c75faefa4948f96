// Sections and caps by the host against those by the shaders, pixel by pixel.
#include <glm/geometric.hpp>

#include "tests/support/host_comparison.h"

namespace vcp {
namespace {

using test::Difference;
using test::drawnBy;
using test::expectFew;
using test::kHigh;
using test::kLow;
using test::NamedCamera;
using test::Planes;
using test::requestOf;
using test::Scene;
using test::torusAndBox;

class HostSections : public test::CastByRendererTest {};

/// A plane through a part of a box, which leaves what is on the side of `normal`.
SectionPlane through(glm::dvec3 lo, glm::dvec3 hi, glm::dvec3 part, glm::dvec3 normal) {
    return {normal, glm::dot(normal, lo + part * (hi - lo))};
}

/// One plane and several: slanted, along the axes, a corner, a slice, as many as there may be. None is in a wall of a
/// grid, or in the mesh.
std::vector<std::vector<SectionPlane>> cuts(glm::dvec3 lo, glm::dvec3 hi) {
    const auto plane = [&](glm::dvec3 part, glm::dvec3 normal) { return through(lo, hi, part, normal); };
    const glm::dvec3 middle(0.503, 0.497, 0.501);
    return {{plane(middle, {0.2, 0.3, -1})},
            {plane({0.43, 0.5, 0.5}, {3, 0, 0})},
            {plane(middle, {0, 0, -1}), plane({0.55, 0.5, 0.5}, {-1, 0.2, 0})},
            {plane(middle, {1, 0, 0}), plane(middle, {0, -1, 0}), plane(middle, {0, 0, 1})},
            {plane({0.5, 0.5, 0.45}, {0, 0.1, 1}), plane({0.5, 0.5, 0.55}, {0, -0.1, -1})},
            {plane({0.21, 0, 0}, {1, 0, 0}), plane({0.79, 0, 0}, {-1, 0, 0}), plane({0, 0.26, 0}, {0, 1, 0}),
             plane({0, 0.84, 0}, {0, -1, 0}), plane({0, 0, 0.317}, {0, 0, 1}), plane({0, 0, 0.7}, {0.1, 0, -1})}};
}

FrameRequest cutRequest(const NamedCamera& named, const std::vector<SectionPlane>& sections, bool caps,
                        ShadingMode mode = ShadingMode::Lit, double errorPixels = 0.2) {
    FrameRequest request = requestOf(named.camera);
    request.shading.mode = mode;
    request.errorPixels = errorPixels;
    request.sections = sections;
    request.sectionCaps = caps ? Caps::Closed : Caps::None;
    return request;
}

TEST_F(HostSections, EveryKindOfLeafFromEveryCamera) {
    const auto scenes = test::scenesOfEveryLeaf();
    for (const bool caps : {false, true}) {
        Difference all;
        for (const Scene& scene : scenes) {
            open(scene);
            const auto sections = cuts(scene.boxMin, scene.boxMax);
            const auto cameras = test::cameras(scene);
            for (size_t i = 0; i < cameras.size(); ++i) {
                SCOPED_TRACE(scene.name + std::string(", ") + cameras[i].name);
                all +=
                    difference(cutRequest(cameras[i], sections[i % sections.size()], caps), scene.dataset->header.cell);
            }
        }
        expectFew(all);
    }
}

TEST_F(HostSections, ABuiltMeshInEveryCutAndSeveralLevels) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    const auto cameras = test::cameras(kLow, kHigh);
    const auto sections = cuts(kLow, kHigh);
    constexpr ShadingMode kModes[] = {ShadingMode::Lit, ShadingMode::Clay, ShadingMode::Unlit, ShadingMode::Normals};
    for (const double errorPixels : {0.2, 4.0, 30.0})
        for (const bool caps : {false, true}) {
            SCOPED_TRACE(errorPixels);
            Difference all;
            for (size_t i = 0; i < cameras.size() * 2; ++i)
                all += difference(cutRequest(cameras[i % cameras.size()], sections[i % sections.size()], caps,
                                             kModes[i % std::size(kModes)], errorPixels),
                                  built.cache().dataset().header.cell);
            expectFew(all);
        }
}

TEST_F(HostSections, FalseColoursOfWhatIsBehindACap) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    Difference all;
    for (const NamedCamera& named : test::cameras(kLow, kHigh))
        for (const ShadingMode mode : {ShadingMode::Level, ShadingMode::Error})
            all +=
                difference(cutRequest(named, cuts(kLow, kHigh)[0], true, mode, 4), built.cache().dataset().header.cell);
    expectFew(all);
}

// Light comes in by what was cut away, and caps have shadows.
TEST_F(HostSections, ShadowsAndOcclusion) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    // What a renderer has drawn leaves pages behind, so another one draws what is compared with neither.
    const auto other = HostRenderer::create({}).value();
    ASSERT_TRUE(other->open({placed(built.file())}, {}));
    const auto sections = cuts(kLow, kHigh);
    Difference all;
    uint64_t lighter = 0;
    const auto cameras = test::cameras(kLow, kHigh);
    for (size_t i = 0; i < cameras.size(); ++i) {
        SCOPED_TRACE(cameras[i].name);
        FrameRequest request = requestOf(cameras[i].camera);
        request.shading.shadows = true;
        request.shading.occlusionRays = i % 2 == 0 ? 0 : 4;
        const Planes whole = drawnBy(*other, request);
        request.sections = sections[i % sections.size()];
        request.sectionCaps = i % 3 != 0 ? Caps::Closed : Caps::None;
        all += difference(request, built.cache().dataset().header.cell);
        const Planes cut = drawnBy(*host_, request);
        for (size_t k = 0; k < whole.depth.size(); ++k)
            if (std::isfinite(cut.depth[k]) && cut.depth[k] == whole.depth[k])
                lighter += cut.picture.rgba[4 * k] > whole.picture.rgba[4 * k] + 8 ? 1 : 0;
    }
    expectFew(all);
    EXPECT_GT(lighter, 100u);
}

TEST_F(HostSections, SeveralSamplesOfDatasetsTurnedAndScaled) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    const Similarity beside{glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5))), 0.6, {0.5, 0.2, 0.7}};
    openAll({placed(built.file()), placed(built.file(), beside)});
    const auto sections = cuts(kLow, kHigh);
    Difference all;
    const auto cameras = test::cameras(kLow, kHigh);
    for (size_t i = 0; i < cameras.size(); ++i) {
        SCOPED_TRACE(cameras[i].name);
        FrameRequest request = requestOf(cameras[i].camera);
        request.shading.shadows = true;
        request.sections = sections[i % sections.size()];
        request.sectionCaps = Caps::Closed;
        all += difference(request, built.cache().dataset().header.cell, 3);
        EXPECT_EQ(drawnBy(*casting_, request, 3).picture, drawnBy(*host_, request, 3).picture);
        EXPECT_TRUE(casting_->render(request)->onHost);
    }
    expectFew(all, 3);
}

TEST_F(HostSections, PicksSayWhetherTheyAreOnACap) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    openAll({placed(built.file())});
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    request.sections = {through(kLow, kHigh, {0.5, 0.5, 0.5}, {0.2, 0.3, -1})};
    request.sectionCaps = Caps::Closed;
    ASSERT_TRUE(renderer_->drawSettled(request));
    ASSERT_TRUE(casting_->drawSettled(request));
    const test::PickDifference picks = test::comparePicks(*casting_, *renderer_, request);
    EXPECT_LE(picks.differing, 1u);
    EXPECT_GT(picks.caps, 30u);
    EXPECT_GT(picks.ofDataset[0], picks.caps + 30u);
}

struct Ball {
    glm::dvec3 centre;
    double radius;
};

/// Farther from the sheet than a page is wide, and inside of it, where pages hold some of both.
const Ball kBallBeside{{-1.7, 0.02, 0.03}, 0.5}, kBallInside{{0.81, 0.02, 0.03}, 0.4};

/// A ball and a bent sheet that is open.
test::BuiltMesh ballAndSheet(const Ball& ball) {
    IndexedMesh mesh = test::sphereMesh(ball.centre, ball.radius, 40);
    IndexedMesh sheet = test::gridSurface(80, 20, false, [](double u, double v) {
        const double angle = test::kTwoPi * u;
        return glm::dvec3(0.8 + 0.6 * std::cos(angle), 0.6 * std::sin(angle), v - 0.5);
    });
    // Without a third of its circle it has no inside.
    std::erase_if(sheet.triangles, [&](const auto& t) { return t[0] % 80 < 27 || t[1] % 80 < 27 || t[2] % 80 < 27; });
    test::append(mesh, sheet);
    return {mesh, 0.03};
}

class HostSectionsOfOpen : public HostSections, public testing::WithParamInterface<Ball> {};

TEST_P(HostSectionsOfOpen, ByHostAndShaders) {
    const test::BuiltMesh built = ballAndSheet(GetParam());
    ASSERT_TRUE(built.ok());
    ASSERT_TRUE(built.cache().dataset().hasOpenParts());
    open(built);
    const glm::dvec3 low(std::min(GetParam().centre.x - 0.5, 0.2), -0.6, -0.5), high(1.4, 0.6, 0.53);
    const auto cameras = test::cameras(low, high);
    const auto sections = cuts(low, high);
    for (const Caps caps : {Caps::Closed, Caps::All}) {
        Difference all;
        for (size_t i = 0; i < 2 * cameras.size(); ++i) {
            FrameRequest request = requestOf(cameras[i % cameras.size()].camera);
            request.errorPixels = i % 2 == 0 ? 0.2 : 4;
            request.sections = sections[i % sections.size()];
            request.sectionCaps = caps;
            all += difference(request, built.cache().dataset().header.cell);
        }
        expectFew(all);
    }
}

// Across the axis of the sheet: the ball is filled, the sheet is a line two pixels wide, and between its ends is
// nothing. On coarser levels all is so far off as their error.
TEST_P(HostSectionsOfOpen, AnOpenSurfaceIsALine) {
    const Ball ball = GetParam();
    const test::BuiltMesh built = ballAndSheet(ball);
    ASSERT_TRUE(built.ok());
    openAll({placed(built.file())});
    const glm::dvec3 low(std::min(ball.centre.x - 0.5, 0.2), -0.6, -0.5), high(1.4, 0.6, 0.53);
    FrameRequest request = requestOf(fitCamera(low, high, {0, 0, -1}, {0, 1, 0}, 0.6, 1.5));
    request.sections = {{{0, 0, -1}, -0.043}};
    request.sectionCaps = Caps::Closed;
    for (const double error : {0.05, 2.0}) {
        SCOPED_TRACE(error);
        request.errorPixels = error;
        ASSERT_TRUE(casting_->drawSettled(request));
        uint64_t inBall = 0, onLine = 0;
        for (uint32_t y = 0; y < request.height; ++y)
            for (uint32_t x = 0; x < request.width; ++x) {
                const CameraRay ray = cameraRay(request.camera, request.width, request.height, x + 0.5, y + 0.5);
                const double t = (0.043 - ray.origin.z) / ray.direction.z;
                const glm::dvec2 at(ray.origin + t * ray.direction);
                const double pixel = t * 2 * std::tan(0.3) / request.height;
                const double fromBall = glm::distance(at, glm::dvec2(ball.centre)) - ball.radius;
                if (std::abs(fromBall) < (2 + error) * pixel) continue;
                const auto hit = casting_->pick(x, y).value();
                const bool onCap = hit && hit->onCap, isInBall = fromBall < 0;
                const glm::dvec2 fromAxis = at - glm::dvec2(0.8, 0);
                const double angle = std::atan2(fromAxis.y, fromAxis.x) / test::kTwoPi,
                             turn = angle < 0 ? angle + 1 : angle;
                const double fromSheet = std::abs(glm::length(fromAxis) - 0.6);
                const bool isAlongSheet = turn > 28.0 / 80 && turn < 78.0 / 80;
                EXPECT_TRUE(!isInBall || onCap) << x << " " << y;
                EXPECT_TRUE(!isAlongSheet || fromSheet > 0.5 * pixel || onCap || error > 1) << x << " " << y;
                EXPECT_TRUE(isInBall || fromSheet < (2 + error) * pixel || !onCap) << x << " " << y;
                inBall += isInBall ? 1 : 0;
                onLine += !isInBall && onCap ? 1 : 0;
            }
        EXPECT_GT(inBall, error < 1 ? 1000u : 900u);
        EXPECT_GT(onLine, 100u);
    }
}

INSTANTIATE_TEST_SUITE_P(All, HostSectionsOfOpen, testing::Values(kBallBeside, kBallInside));

// A machine's part of few triangles: plates that are thinner than a hundredth of a cell, and one within another. What
// is filled is what is in an odd number of them.
TEST_F(HostSections, PlatesThinnerThanACell) {
    const std::vector<std::array<glm::dvec3, 2>> boxes{{glm::dvec3(0, 0, 0), glm::dvec3(100, 2, 60)},
                                                       {glm::dvec3(10, 4, 10), glm::dvec3(40, 24, 40)},
                                                       {glm::dvec3(12, 6, 12), glm::dvec3(38, 22, 38)},
                                                       {glm::dvec3(60, 3, 10), glm::dvec3(80, 23, 10.5)}};
    IndexedMesh mesh;
    for (const auto& box : boxes) test::append(mesh, test::boxMesh(box[0], box[1], 1));
    const test::BuiltMesh built(mesh, 60);
    ASSERT_TRUE(built.ok());
    open(built);
    const glm::dvec3 low(0, 0, 0), high(100, 24, 60), normal = glm::normalize(glm::dvec3(-1, -1.1, -1.2));
    FrameRequest request = requestOf(fitCamera(low, high, {-0.5, -0.4, -0.7}, {0, 1, 0}, 0.6, 4.0 / 3));
    request.sections = {{normal, glm::dot(normal, glm::dvec3(70, 10, 10.3))}};
    request.sectionCaps = Caps::Closed;
    const Difference d = difference(request, built.cache().dataset().header.cell);
    EXPECT_LE(d.state + d.depth + d.normal + d.colour, 3u);
    const Planes drawn = drawnBy(*host_, request);
    const double error = 2 * built.report().certifiedErrorMax;  // and about as much that triangles are widened by
    uint64_t filled = 0;
    for (uint32_t y = 0; y < request.height; ++y)
        for (uint32_t x = 0; x < request.width; ++x) {
            const CameraRay ray = cameraRay(request.camera, request.width, request.height, x + 0.5, y + 0.5);
            const double t =
                (request.sections[0].offset - glm::dot(normal, ray.origin)) / glm::dot(normal, ray.direction);
            const glm::dvec3 at = ray.origin + t * ray.direction;
            const auto filledBy = [&](double margin) {
                return std::ranges::count_if(boxes, [&](const auto& box) {
                    return glm::all(glm::lessThan(box[0] - margin, at)) && glm::all(glm::lessThan(at, box[1] + margin));
                });
            };
            const bool isFilled = filledBy(0) % 2 == 1;
            if (filledBy(-error) != filledBy(error)) continue;
            const float depth = drawn.depth[size_t{y} * request.width + x];
            filled += isFilled ? 1 : 0;
            EXPECT_EQ(std::abs(depth - t) < 1e-5 * t, isFilled) << x << " " << y;
        }
    EXPECT_GT(filled, 500u);
}

// A ball cut open: each pixel of the disc is cap, and none about it; without caps, its far wall is seen.
TEST_F(HostSections, ABallHasADisc) {
    const Scene scene = test::sphereScene(1);
    ASSERT_TRUE(host_->open({{scene.dataset, scene.source, {}}}, {}));
    const double edge = scene.boxMax.x - scene.boxMin.x, radius = 0.41 * edge;
    const glm::dvec3 centre = scene.boxMin + glm::dvec3(0.503, 0.497, 0.501) * edge;
    FrameRequest request = requestOf(fitCamera(scene.boxMin, scene.boxMax, {0, 0, -1}, {0, 1, 0}, 0.6, 4.0 / 3));
    const double plane = centre.z + 0.1 * radius, toPlane = request.camera.eye.z - plane;
    const double disc = radius * std::sqrt(1 - 0.01);
    request.sections = {{{0, 0, -2}, -2 * plane}};
    for (const bool caps : {false, true}) {
        request.sectionCaps = caps ? Caps::Closed : Caps::None;
        const Planes drawn = drawnBy(*host_, request);
        uint64_t inDisc = 0;
        for (uint32_t y = 0; y < request.height; ++y)
            for (uint32_t x = 0; x < request.width; ++x) {
                const CameraRay ray = cameraRay(request.camera, request.width, request.height, x + 0.5, y + 0.5);
                const double t = -toPlane / ray.direction.z;
                const double off = glm::length(glm::dvec2(ray.origin + t * ray.direction - centre));
                if (std::abs(off - disc) < 0.02 * radius) continue;
                const size_t at = size_t{y} * request.width + x;
                const bool isCap = std::abs(drawn.depth[at] - t) < 1e-5 * t;
                inDisc += off < disc ? 1 : 0;
                EXPECT_EQ(isCap, caps && off < disc) << x << " " << y;
                EXPECT_TRUE(!isCap || drawn.normals[at].z > 0.9999f) << x << " " << y;
                EXPECT_TRUE(off > disc || std::isfinite(drawn.depth[at])) << x << " " << y;
            }
        EXPECT_GT(inDisc, 2000u);
    }
}

}  // namespace
}  // namespace vcp
