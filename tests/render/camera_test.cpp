// Cameras: rays, frusta and fitting agree with each other.
#include "render/camera.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"

namespace vcp {
namespace {

TEST(Camera, MiddleOfThePictureLooksForward) {
    Camera camera;
    camera.eye = {1, 2, 3};
    camera.forward = {0, 0, -2};
    const CameraRay ray = cameraRay(camera, 640, 480, 320, 240);
    EXPECT_NEAR(glm::distance(ray.direction, glm::dvec3(0, 0, -1)), 0, 1e-12);
    EXPECT_GT(cameraRay(camera, 640, 480, 320, 0).direction.y, 0) << "the upper edge is up";
    EXPECT_GT(cameraRay(camera, 640, 480, 640, 240).direction.x, 0) << "the right edge is right";
    EXPECT_NEAR(std::acos(cameraRay(camera, 640, 480, 320, 0).direction.z * -1), camera.verticalFov / 2, 1e-12);
}

TEST(Camera, FitShowsTheWholeBox) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 lo(u(random) * 1e6, u(random), u(random)),
            hi = lo + glm::dvec3(1.1 + u(random), 1.1 + u(random), 1.1 + u(random));
        const Camera camera = fitCamera(lo, hi, {u(random), u(random), 1.5 + u(random)}, {0, 1, 0}, 0.6, 1.6);
        for (const Projection projection : {Projection::Perspective, Projection::Orthographic}) {
            FrameRequest request;
            request.camera = camera;
            request.camera.projection = projection;
            request.width = 1600;
            request.height = 1000;
            const SelectionView view = selectionView(request);
            for (int corner = 0; corner < 8; ++corner) {
                const glm::dvec3 p =
                    glm::dvec3(corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y, corner & 4 ? hi.z : lo.z) -
                    camera.eye;
                for (const glm::dvec4& plane : view.planes)
                    EXPECT_GE(glm::dot(glm::dvec3(plane), p) + plane.w, -1e-6) << i;
            }
        }
    }
}

TEST(Camera, RequestsWithoutAPictureAreRefused) {
    FrameRequest good;
    EXPECT_TRUE(checkRequest(good));
    FrameRequest bad = good;
    bad.width = 0;
    EXPECT_FALSE(checkRequest(bad));
    bad = good;
    bad.camera.up = bad.camera.forward;
    EXPECT_FALSE(checkRequest(bad));
    bad = good;
    bad.camera.eye.x = NAN;
    EXPECT_FALSE(checkRequest(bad));
    bad = good;
    bad.camera.verticalFov = 4;
    EXPECT_FALSE(checkRequest(bad));
    bad = good;
    bad.errorPixels = NAN;
    EXPECT_FALSE(checkRequest(bad));
}

}  // namespace
}  // namespace vcp
