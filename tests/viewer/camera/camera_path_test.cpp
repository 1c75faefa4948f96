// Turntables and paths through cameras.
#include "viewer/camera/camera_path.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace vcp {
namespace {

OrbitCamera lookingAt(glm::dvec3 eye, glm::dvec3 target) {
    OrbitCamera camera;
    camera.position = eye;
    camera.focusDistance = glm::distance(eye, target);
    camera.orientation = facing(target - eye, {0, 1, 0});
    return camera;
}

TEST(CameraPath, ATurntableGoesOnceAround) {
    const glm::dvec3 pivot(1, 2, 3);
    const OrbitCamera from = lookingAt({1, 4, 8}, {1, 2, 3});
    const auto cameras = turntable(from, pivot, 8);
    ASSERT_EQ(cameras.size(), 8u);
    EXPECT_EQ(cameras.front().position, from.position);
    for (size_t i = 0; i < 8; ++i) {
        const OrbitCamera& camera = cameras[i];
        EXPECT_NEAR(glm::distance(camera.position, pivot), glm::distance(from.position, pivot), 1e-12);
        EXPECT_NEAR(camera.position.y, 4, 1e-12) << "about the up axis";
        EXPECT_LT(glm::distance(camera.focus(), pivot), 1e-12);
        const glm::dvec3 next = cameras[(i + 1) % 8].position;
        EXPECT_NEAR(glm::distance(camera.position, next), 2 * 5 * std::sin(std::numbers::pi / 8), 1e-12)
            << "in equal steps, the last one back to the first";
    }
    OrbitCamera upward = from;
    upward.up = UpAxis::Z;
    EXPECT_NEAR(turntable(upward, pivot, 4)[1].position.z, 8, 1e-12);
}

TEST(CameraPath, ATurntableThatIsFittedSeesAllOfItsBoxEachTime) {
    constexpr glm::ivec2 kSize(320, 240);
    // It is narrow from the front and wide from the side.
    const Box box{{9, 1, -4}, {11, 3, 4}};
    const auto isInPicture = [&](const OrbitCamera& camera, int i) {
        const glm::dvec3 corner((i & 1) != 0 ? box.high.x : box.low.x, (i & 2) != 0 ? box.high.y : box.low.y,
                                (i & 4) != 0 ? box.high.z : box.low.z);
        const auto pixel = camera.pixelOf(corner, kSize);
        return pixel && pixel->x >= 0 && pixel->x <= kSize.x && pixel->y >= 0 && pixel->y <= kSize.y;
    };
    const auto cornersOutside = [&](const OrbitCamera& first) {
        int outside = 0;
        for (const OrbitCamera& camera : turntable(first, box.centre(), 12))
            for (int i = 0; i < 8; ++i) outside += isInPicture(camera, i) ? 0 : 1;
        return outside;
    };
    for (const Projection projection : {Projection::Perspective, Projection::Orthographic}) {
        OrbitCamera camera;
        camera.projection = projection;
        camera.look(View::Front, box, kSize);
        EXPECT_GT(cornersOutside(camera), 0);
        OrbitCamera around = camera;
        around.fitAround(box, kSize, 12);
        EXPECT_EQ(cornersOutside(around), 0);
        EXPECT_EQ(around.orientation, camera.orientation);
        // It is no farther away than the widest view needs.
        around.focusDistance *= 0.9;
        around.position = box.centre() - around.forwardVector() * around.focusDistance;
        EXPECT_GT(cornersOutside(around), 0);
    }
}

TEST(CameraPath, TwoCamerasAreJoinedByAStraightLine) {
    const std::vector<OrbitCamera> keys{lookingAt({0, 0, 5}, {0, 0, 0}), lookingAt({2, 0, 5}, {2, 0, 0})};
    const auto path = cameraPath(keys, 5);
    ASSERT_EQ(path.size(), 5u);
    for (size_t i = 0; i < 5; ++i) EXPECT_LT(glm::distance(path[i].position, {0.5 * double(i), 0, 5}), 1e-12);
    EXPECT_EQ(cameraPath(keys, 1).front().position, keys.front().position);
    EXPECT_EQ(cameraPath(std::span(keys).first(1), 3).back().position, keys.front().position);
}

TEST(CameraPath, GoesThroughItsCamerasAndAroundWhatTheyLookAt) {
    std::vector<OrbitCamera> keys;
    for (int i = 0; i < 4; ++i)
        keys.push_back(lookingAt({3 * std::cos(1.5 * i), 0.3 * i, 3 * std::sin(1.5 * i)}, {0, 0.1 * i, 0}));
    keys[2].orientation = -keys[2].orientation;  // the same turn
    const auto path = cameraPath(keys, 301);
    for (size_t i = 0; i < 4; ++i) EXPECT_LT(glm::distance(path[100 * i].position, keys[i].position), 1e-9) << i;
    for (const OrbitCamera& camera : path)
        EXPECT_NEAR(glm::distance(camera.position, camera.focus()), 3, 0.1) << "no short cut through the middle";
}

// Neither the way nor the view has a kink: from frame to frame the speed changes by little.
TEST(CameraPath, IsSmoothAtItsCameras) {
    const std::vector<OrbitCamera> keys{lookingAt({0, 0, 5}, {0, 0, 0}), lookingAt({4, 1, 3}, {0, 0, 0}),
                                        lookingAt({5, 2, -4}, {1, 0, 0}), lookingAt({0, 6, -3}, {0, 1, 0}),
                                        lookingAt({-9, 0, 1}, {0, 0, 0})};
    const auto path = cameraPath(keys, 4001);
    double fastest = 0, sharpest = 0, sharpestTurn = 0, fastestTurn = 0;
    for (size_t i = 1; i + 1 < path.size(); ++i) {
        const glm::dvec3 before = path[i].position - path[i - 1].position,
                         after = path[i + 1].position - path[i].position;
        const glm::dvec3 turnBefore = path[i].forwardVector() - path[i - 1].forwardVector(),
                         turnAfter = path[i + 1].forwardVector() - path[i].forwardVector();
        fastest = std::max(fastest, glm::length(before));
        fastestTurn = std::max(fastestTurn, glm::length(turnBefore));
        sharpest = std::max(sharpest, glm::length(after - before));
        sharpestTurn = std::max(sharpestTurn, glm::length(turnAfter - turnBefore));
    }
    EXPECT_LT(sharpest, 0.02 * fastest);
    EXPECT_LT(sharpestTurn, 0.02 * fastestTurn);
}

TEST(CameraPath, AFileOfCameras) {
    const std::string two =
        R"([{"position":[0,0,5],"target":[0,0,0]},{"position":[2,0,5],"target":[2,0,0],"projection":"orthographic"}])";
    const auto cameras = camerasFromJson(two, "path.json");
    ASSERT_TRUE(cameras) << cameras.error().line();
    ASSERT_EQ(cameras->size(), 2u);
    EXPECT_EQ((*cameras)[1].position, glm::dvec3(2, 0, 5));
    EXPECT_EQ((*cameras)[1].projection, Projection::Orthographic);
    const std::string deep = "[" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "]";
    const std::string deepCamera =
        R"([{"position":)" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + R"(,"target":[0,0,0]}])";
    for (const std::string& bad : {std::string(), std::string("{}"), std::string("[]"), std::string("[1]"),
                                   std::string("[{}]"), std::string("["), std::string("[\"\xff\"]"),
                                   std::string(R"([{"position":[0,0,"x"],"target":[0,0,0]}])"), deep, deepCamera}) {
        const auto broken = camerasFromJson(bad, "path.json");
        ASSERT_FALSE(broken) << bad.substr(0, 100);
        EXPECT_EQ(broken.error().code, ErrorCode::InvalidInput);
        EXPECT_TRUE(broken.error().line().starts_with("path.json"));
    }
    const std::string third =
        "[\n{\"position\":[0,0,5],\"target\":[0,0,0]},\n{\"position\":[2,0,5],\n\"target\":[2,0,\"x\"]}]";
    EXPECT_EQ(camerasFromJson(third, "path.json").error().line(),
              "path.json: line 4: camera 1: \"target\": must be three numbers");
    EXPECT_EQ(readCameras("/no/such/file.json").error().code, ErrorCode::Io);
    EXPECT_EQ(readCameras("/").error().code, ErrorCode::Io);
}

}  // namespace
}  // namespace vcp
