// Cameras: what a person sees must hold still where it is promised to.
#include "viewer/camera/orbit_camera.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "viewer/camera/text_file.h"

namespace vcp {
namespace {

constexpr glm::ivec2 kSize(1280, 720);

struct Scene {
    OrbitCamera camera;
    glm::dvec3 point;  // in front of the camera, inside the picture
    glm::dvec2 pixel;
};

Scene randomScene(unsigned seed, Projection projection, glm::dvec3 offset = glm::dvec3(0)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    Scene scene;
    scene.camera.projection = projection;
    scene.camera.up = seed % 2 ? UpAxis::Z : UpAxis::Y;
    const Box box{offset + glm::dvec3(-1, -2, -3), offset + glm::dvec3(4, 5, 6)};
    const View views[] = {View::Front, View::Back, View::Left, View::Right, View::Isometric};
    scene.camera.look(views[seed % 5], box, kSize);
    scene.camera.orbit(box.centre(), unit(random), 0.5 * unit(random));
    scene.point = box.centre() + glm::dvec3(unit(random), unit(random), unit(random));
    scene.pixel = scene.camera.pixelOf(scene.point, kSize).value();
    return scene;
}

void expectNear(glm::dvec2 a, glm::dvec2 b, double tolerance, unsigned seed) {
    EXPECT_NEAR(a.x, b.x, tolerance) << "seed " << seed;
    EXPECT_NEAR(a.y, b.y, tolerance) << "seed " << seed;
}

class CameraMoves : public testing::TestWithParam<Projection> {};

TEST_P(CameraMoves, RayThroughPixelOfAPointPassesThroughThePoint) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        const Scene scene = randomScene(seed, GetParam());
        const CameraRay ray = scene.camera.rayThrough(scene.pixel, kSize);
        const glm::dvec3 to = scene.point - ray.origin;
        EXPECT_NEAR(glm::length(ray.direction), 1, 1e-14);
        EXPECT_LT(glm::length(glm::cross(to, ray.direction)), 1e-11 * glm::length(to)) << "seed " << seed;
        EXPECT_GT(glm::dot(to, ray.direction), 0) << "seed " << seed;
    }
}

TEST_P(CameraMoves, OrbitKeepsThePivotInItsPlace) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        Scene scene = randomScene(seed, GetParam());
        const double depth = scene.camera.depthOf(scene.point);
        scene.camera.orbit(scene.point, 0.7, -0.4);
        expectNear(scene.camera.pixelOf(scene.point, kSize).value(), scene.pixel, 1e-8, seed);
        EXPECT_NEAR(scene.camera.depthOf(scene.point), depth, 1e-12 * depth);
    }
}

TEST_P(CameraMoves, PanBringsThePointUnderTheCursor) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        Scene scene = randomScene(seed, GetParam());
        const glm::dvec2 to = scene.pixel + glm::dvec2(31.5, -12.25);
        scene.camera.pan(scene.pixel, to, scene.camera.depthOf(scene.point), kSize);
        expectNear(scene.camera.pixelOf(scene.point, kSize).value(), to, 1e-8, seed);
    }
}

TEST_P(CameraMoves, ZoomKeepsThePointUnderTheCursorAndScalesAroundIt) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        for (const double factor : {0.5, 0.9, 1.25, 4.0}) {
            Scene scene = randomScene(seed, GetParam());
            const glm::dvec3 beside = scene.point + scene.camera.rightVector() * 1e-3;
            const double before = scene.camera.pixelOf(beside, kSize)->x - scene.pixel.x;
            scene.camera.zoomAbout(scene.point, factor);
            const glm::dvec2 now = scene.camera.pixelOf(scene.point, kSize).value();
            expectNear(now, scene.pixel, 1e-8, seed);
            EXPECT_NEAR((scene.camera.pixelOf(beside, kSize)->x - now.x) * factor / before, 1, 1e-7);
        }
    }
}

// 10^7 cells away from the origin, as in UTM coordinates, nothing that can be seen is lost.
TEST_P(CameraMoves, OriginFarAway) {
    for (unsigned seed = 0; seed < 50; ++seed) {
        Scene scene = randomScene(seed, GetParam(), glm::dvec3(4.4e6, -5.1e6, 3.0e5));
        scene.camera.orbit(scene.point, 0.3, 0.2);
        expectNear(scene.camera.pixelOf(scene.point, kSize).value(), scene.pixel, 1e-4, seed);
    }
}

TEST_P(CameraMoves, FitShowsTheWholeBoxAndNearlyFillsThePicture) {
    for (const glm::ivec2 size : {glm::ivec2(1280, 720), glm::ivec2(200, 900), glm::ivec2(1, 1)}) {
        for (const View view :
             {View::Front, View::Back, View::Left, View::Right, View::Top, View::Bottom, View::Isometric}) {
            OrbitCamera camera;
            camera.projection = GetParam();
            const Box box{{10, 20, 30}, {13, 21, 35}};
            camera.look(view, box, size);
            double reach = 0;
            for (int i = 0; i < 8; ++i) {
                const glm::dvec3 corner(i & 1 ? 13 : 10, i & 2 ? 21 : 20, i & 4 ? 35 : 30);
                const auto pixel = camera.pixelOf(corner, size);
                ASSERT_TRUE(pixel);
                const glm::dvec2 at = glm::abs(*pixel / glm::dvec2(size) * 2.0 - 1.0);
                reach = std::max({reach, at.x, at.y});
            }
            EXPECT_LE(reach, 1.0);
            EXPECT_GT(reach, 0.9);
        }
    }
}

TEST_P(CameraMoves, FitKeepsClearOfWhatIsCovered) {
    const Box box{{10, 20, 30}, {13, 21, 35}};
    const glm::ivec2 size(1280, 720);
    for (const PictureMargins covered : {PictureMargins{.right = 400, .bottom = 20},
                                         PictureMargins{.left = 100, .top = 300}, PictureMargins{.right = 640}}) {
        for (const View view : {View::Front, View::Right, View::Top, View::Isometric}) {
            OrbitCamera camera;
            camera.projection = GetParam();
            camera.look(view, box, size, covered);
            const glm::dvec2 low(covered.left, covered.top), high(size.x - covered.right, size.y - covered.bottom);
            double reach = 0;
            for (int i = 0; i < 8; ++i) {
                const auto pixel = camera.pixelOf({i & 1 ? 13 : 10, i & 2 ? 21 : 20, i & 4 ? 35 : 30}, size);
                ASSERT_TRUE(pixel);
                const glm::dvec2 at = glm::abs((*pixel - low) / (high - low) * 2.0 - 1.0);
                reach = std::max({reach, at.x, at.y});
            }
            EXPECT_LE(reach, 1.0);
            EXPECT_GT(reach, 0.9);
            expectNear(camera.pixelOf(box.centre(), size).value(), 0.5 * (low + high), 1e-9, 0);
        }
    }
    // Where next to nothing is left, all of the picture is taken.
    OrbitCamera camera, whole;
    camera.projection = whole.projection = GetParam();
    camera.look(View::Front, box, size, {.left = 400, .right = 400});
    whole.look(View::Front, box, size);
    EXPECT_EQ(camera.position, whole.position);
}

INSTANTIATE_TEST_SUITE_P(Projections, CameraMoves, testing::Values(Projection::Perspective, Projection::Orthographic),
                         [](const auto& projection) {
                             return projection.param == Projection::Perspective ? "Perspective" : "Orthographic";
                         });

TEST(OrbitCamera, StandardViewsLookWhereTheirNameSays) {
    const Box box{{-1, -1, -1}, {1, 1, 1}};
    struct Case {
        UpAxis up;
        View view;
        glm::dvec3 forward, upward;
    };
    const Case cases[] = {
        {UpAxis::Y, View::Front, {0, 0, -1}, {0, 1, 0}}, {UpAxis::Y, View::Right, {-1, 0, 0}, {0, 1, 0}},
        {UpAxis::Y, View::Top, {0, -1, 0}, {0, 0, -1}},  {UpAxis::Z, View::Front, {0, 1, 0}, {0, 0, 1}},
        {UpAxis::Z, View::Right, {-1, 0, 0}, {0, 0, 1}}, {UpAxis::Z, View::Top, {0, 0, -1}, {0, 1, 0}},
        {UpAxis::Z, View::Left, {1, 0, 0}, {0, 0, 1}},   {UpAxis::Y, View::Bottom, {0, 1, 0}, {0, 0, 1}}};
    for (const Case& c : cases) {
        OrbitCamera camera;
        camera.up = c.up;
        camera.look(c.view, box, kSize);
        EXPECT_LT(glm::distance(camera.forwardVector(), c.forward), 1e-12);
        EXPECT_LT(glm::distance(camera.upVector(), c.upward), 1e-12);
    }
}

TEST(OrbitCamera, OrbitNeverTurnsThePictureUpsideDown) {
    OrbitCamera camera;
    const Box box{{-1, -1, -1}, {1, 1, 1}};
    camera.look(View::Front, box, kSize);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> angle(-2, 2);
    for (int i = 0; i < 500; ++i) {
        camera.orbit(box.centre(), angle(random), angle(random));
        ASSERT_GT(camera.upVector().y, 0) << "step " << i;
        ASSERT_NEAR(glm::length(glm::dvec3(camera.orientation.x, camera.orientation.y, camera.orientation.z)) *
                            glm::length(glm::dvec3(camera.orientation.x, camera.orientation.y, camera.orientation.z)) +
                        camera.orientation.w * camera.orientation.w,
                    1, 1e-12);
        ASSERT_LT(std::abs(camera.rightVector().y), 1e-9) << "the horizon tilts at step " << i;
    }
}

TEST(OrbitCamera, OrbitLeavesTheTopView) {
    OrbitCamera camera;
    camera.look(View::Top, {{-1, -1, -1}, {1, 1, 1}}, kSize);
    camera.orbit(glm::dvec3(0), 0, 0.5);
    EXPECT_NEAR(std::asin(-camera.forwardVector().y), std::numbers::pi / 2 - 0.5, 1e-9);
}

TEST(OrbitCamera, ZoomingInForEverStaysFinite) {
    for (const Projection projection : {Projection::Perspective, Projection::Orthographic}) {
        OrbitCamera camera;
        camera.projection = projection;
        camera.look(View::Front, {{100, 100, 100}, {101, 101, 101}}, kSize);
        for (int i = 0; i < 2000; ++i) camera.zoomAbout({100.5, 100.5, 100.5}, 0.8);
        EXPECT_GT(camera.focusDistance, 0);
        EXPECT_TRUE(std::isfinite(camera.position.x));
        EXPECT_TRUE(camera.pixelOf({100.5, 100.5, 100.5}, kSize));
        camera.zoomAbout({100.5, 100.5, 100.5}, 10);
        EXPECT_TRUE(std::isfinite(camera.focusDistance));
    }
}

TEST(OrbitCamera, PointsBehindTheEyeHaveNoPixel) {
    const OrbitCamera camera;
    EXPECT_FALSE(camera.pixelOf({0, 0, 1}, kSize));
    EXPECT_TRUE(camera.pixelOf({0, 0, -1}, kSize));
}

TEST(CameraJson, RoundTrip) {
    for (unsigned seed = 0; seed < 100; ++seed) {
        const Scene scene = randomScene(seed, seed % 3 ? Projection::Perspective : Projection::Orthographic);
        const auto read = cameraFromJson(cameraToJson(scene.camera), "camera.json");
        ASSERT_TRUE(read) << read.error().line();
        EXPECT_EQ(read->position, scene.camera.position);
        EXPECT_EQ(read->projection, scene.camera.projection);
        EXPECT_EQ(read->up, scene.camera.up);
        EXPECT_NEAR(read->fovY, scene.camera.fovY, 1e-15);
        expectNear(read->pixelOf(scene.point, kSize).value(), scene.pixel, 1e-8, seed);
    }
}

TEST(CameraJson, OptionalFieldsHaveDefaults) {
    const auto camera = cameraFromJson(R"({"position":[0,0,5],"target":[0,0,0]})", "c");
    ASSERT_TRUE(camera) << camera.error().line();
    EXPECT_LT(glm::distance(camera->upVector(), glm::dvec3(0, 1, 0)), 1e-12);
    EXPECT_NEAR(camera->fovY, std::numbers::pi / 4, 1e-12);
    EXPECT_EQ(camera->focusDistance, 5);
}

TEST(CameraJson, EveryFaultIsNamed) {
    struct Case {
        const char* text;
        const char* expected;
    };
    const Case cases[] = {
        {"", "line 1"},
        {"{\n\"position\": [1,2,\n", "c.json: line 3"},
        {"[]", "must be a JSON object"},
        {R"({"position":[0,0,5]})", "\"target\": is missing"},
        {R"({"position":[0,0],"target":[0,0,0]})", "\"position\": must be three numbers"},
        {R"({"position":[0,0,"5"],"target":[0,0,0]})", "\"position\": must be three numbers"},
        {R"({"position":[0,0,1e999],"target":[0,0,0]})", "out of range"},
        {R"({"position":[0,0,5],"target":[0,0,5]})", "\"target\": must be away"},
        {R"({"position":[0,0,5],"target":[0,0,0],"up":[0,0,1]})", "\"up\": must not be"},
        {R"({"position":[0,0,5],"target":[0,0,0],"up":[0,0,0]})", "\"up\": must not be"},
        {R"({"position":[0,0,5],"target":[0,0,0],"fov_degrees":180})", "\"fov_degrees\""},
        {R"({"position":[0,0,5],"target":[0,0,0],"fov_degrees":"45"})", "\"fov_degrees\""},
        {R"({"position":[0,0,5],"target":[0,0,0],"projection":"fisheye"})", "\"perspective\" or \"orthographic\""},
    };
    for (const Case& c : cases) {
        const auto camera = cameraFromJson(c.text, "c.json");
        ASSERT_FALSE(camera) << c.text;
        EXPECT_NE(camera.error().line().find(c.expected), std::string::npos) << camera.error().line();
        EXPECT_NE(camera.error().line().find("c.json"), std::string::npos) << camera.error().line();
    }
}

TEST(CameraJson, EveryTruncationIsRefusedWithoutHarm) {
    const std::string whole = cameraToJson(randomScene(1, Projection::Perspective).camera);
    for (size_t length = 0; length < whole.size(); ++length) EXPECT_FALSE(cameraFromJson(whole.substr(0, length), "c"));
}

TEST(Views, HaveNames) {
    EXPECT_EQ(viewNamed("fit"), View::Fit);
    EXPECT_EQ(viewNamed("iso"), View::Isometric);
    EXPECT_FALSE(viewNamed("sideways"));
    EXPECT_FALSE(viewNamed(""));
}

TEST(OrbitCamera, BetweenEndsAtBothAndKeepsALengthOfView) {
    const Box box{{-1, -2, -3}, {3, 2, 1}};
    OrbitCamera from, to;
    from.look(View::Front, box, {640, 480});
    to.look(View::Isometric, box, {640, 480});
    to.zoomAbout(box.centre(), 1e-3);
    EXPECT_EQ(between(from, to, 0).position, from.position);
    EXPECT_EQ(between(from, to, 1).position, to.position);
    EXPECT_EQ(between(from, to, 1).orientation, to.orientation);
    for (const double part : {0.1, 0.5, 0.9}) {
        const OrbitCamera camera = between(from, to, part);
        EXPECT_NEAR(glm::length(camera.orientation), 1, 1e-12);
        EXPECT_LT(glm::distance(camera.focus(), box.centre()), 1e-9)
            << "both look at the same point, and so does all between";
        EXPECT_NEAR(camera.focusDistance, from.focusDistance * std::pow(to.focusDistance / from.focusDistance, part),
                    1e-9);
    }
}

TEST(OrbitCamera, TurningTheHeadKeepsTheEyeAndTheHorizon) {
    OrbitCamera camera;
    camera.look(View::Isometric, {{-1, -1, -1}, {1, 1, 1}}, {640, 480});
    const OrbitCamera before = camera;
    camera.turnHead(0.3, -0.2);
    EXPECT_LT(glm::distance(camera.position, before.position), 1e-12);
    EXPECT_NEAR(camera.rightVector().y, 0, 1e-9);
    EXPECT_GT(glm::distance(camera.forwardVector(), before.forwardVector()), 0.1);
    for (int i = 0; i < 100; ++i) camera.turnHead(0, 0.5);
    EXPECT_GT(camera.upVector().y, 0) << "never upside down";
}

TEST(OrbitCamera, StandsUpAlsoWhereItLooksAlongTheAxis) {
    for (const View view : {View::Front, View::Right, View::Top, View::Isometric}) {
        OrbitCamera camera;
        camera.look(view, {{-1, -1, -1}, {1, 1, 1}}, {640, 480});
        const OrbitCamera before = camera;
        camera.standUp(UpAxis::Z);
        EXPECT_LT(glm::distance(camera.forwardVector(), before.forwardVector()), 1e-9);
        EXPECT_NEAR(glm::length(camera.orientation), 1, 1e-9);
        EXPECT_GE(camera.upVector().z, -1e-9);
    }
}

TEST(UpAxis, TheBoxSaysWhichItIs) {
    const auto text = readText(VCP_SOURCE_DIR "/tests/viewer/camera/up_axis.json", 1 << 20, "cases", "");
    ASSERT_TRUE(text);
    for (const auto& each : nlohmann::json::parse(*text)) {
        const auto corner = [&](const char* name) {
            return glm::dvec3(each[name][0].get<double>(), each[name][1].get<double>(), each[name][2].get<double>());
        };
        const auto up = upOf({corner("low"), corner("high")});
        const nlohmann::json found = up ? nlohmann::json(*up == UpAxis::Z ? "z" : "y") : nlohmann::json();
        EXPECT_EQ(found, each["up"]) << each["what"];
    }
}

TEST(OrbitCamera, TerrainIsSeenHalfwayBetweenFrontAndTop) {
    const Box terrain{{376000, 3788000, 300}, {412000, 3807000, 2300}}, statue{{0, 0, 0}, {1, 1, 2}};
    OrbitCamera camera;
    camera.up = UpAxis::Z;
    camera.look(View::Fit, terrain, {320, 200});
    EXPECT_LT(glm::distance(camera.forwardVector(), glm::normalize(glm::dvec3(0, 1, -1))), 1e-12);
    EXPECT_GT(camera.upVector().z, 0.7);
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 corner((i & 1) != 0 ? terrain.low.x : terrain.high.x,
                                (i & 2) != 0 ? terrain.low.y : terrain.high.y,
                                (i & 4) != 0 ? terrain.low.z : terrain.high.z);
        const auto pixel = camera.pixelOf(corner, {320, 200});
        ASSERT_TRUE(pixel);
        EXPECT_TRUE(pixel->x >= 0 && pixel->x <= 320 && pixel->y >= 0 && pixel->y <= 200);
    }
    camera.look(View::Front, terrain, {320, 200});
    EXPECT_LT(glm::distance(camera.forwardVector(), glm::dvec3(0, 1, 0)), 1e-12);
    camera.look(View::Fit, statue, {320, 200});
    EXPECT_LT(glm::distance(camera.forwardVector(), glm::dvec3(0, 1, 0)), 1e-12);
    camera.up = UpAxis::Y;
    camera.look(View::Fit, terrain, {320, 200});
    EXPECT_LT(glm::distance(camera.forwardVector(), glm::dvec3(0, 0, -1)), 1e-12);
}

}  // namespace
}  // namespace vcp
