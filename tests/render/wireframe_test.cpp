// The lines of wireframes against lines that are projected into the picture, and pictures of them.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "render/host/wireframe.h"
#include "render/pixel_samples.h"
#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

// A camera in the origin that looks along -z, so far away that a pixel is as wide all over what it sees.
constexpr double kPixelPerDepth = 3e-5, kDistance = 100;

glm::dvec2 projected(glm::dvec3 p) { return glm::dvec2(p.x, p.y) / (-p.z * kPixelPerDepth); }

/// The distance of a pixel from the line through two points of the picture.
double distanceFrom(glm::dvec2 pixel, glm::dvec2 a, glm::dvec2 b) {
    const glm::dvec2 along = glm::normalize(b - a), to = pixel - a;
    return std::abs(along.x * to.y - along.y * to.x);
}

/// How much is seen of a line so far away, of lines that are so far apart; pixels.
double lineSeen(double distance, double apart) {
    return std::clamp(1 - distance, 0.0, 1.0) * std::clamp((apart - 3) / 5, 0.0, 1.0);
}

class LinesTest : public testing::Test {
protected:
    glm::dvec3 inCube(double half) {
        std::uniform_real_distribution<double> number(-half, half);
        return {number(random_), number(random_), number(random_)};
    }
    /// A size between two, by powers.
    double size(double least, double most) {
        return std::exp(std::uniform_real_distribution<double>(std::log(least), std::log(most))(random_));
    }
    double part() { return std::uniform_real_distribution<double>(0, 1)(random_); }

    std::mt19937 random_{11};
};

TEST_F(LinesTest, OfTrianglesAreWhereEdgesAreInThePicture) {
    int seen = 0, faint = 0;
    for (int seed = 0; seed < 20000; ++seed) {
        const glm::dvec3 middle = inCube(0.5) + glm::dvec3(0, 0, -kDistance);
        const double edge = size(0.008, 0.4);
        glm::dvec3 corners[3];
        for (glm::dvec3& corner : corners) corner = middle + inCube(edge);
        const glm::dvec3 across = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        // Near one of the edges, as often as not.
        glm::dvec3 weights(part() * (seed % 2 == 0 ? 1 : 0.03), 0, 0);
        weights.y = (1 - weights.x) * part();
        weights.z = 1 - weights.x - weights.y;
        const glm::dvec3 hit = weights.x * corners[0] + weights.y * corners[1] + weights.z * corners[2];
        const glm::dvec3 direction = glm::normalize(hit);
        if (std::abs(glm::dot(glm::normalize(across), direction)) < 0.05) continue;
        double expected = 0;
        for (int i = 0; i < 3; ++i) {
            const glm::dvec2 a = projected(corners[(i + 1) % 3]), b = projected(corners[(i + 2) % 3]);
            expected = std::max(
                expected, lineSeen(distanceFrom(projected(hit), a, b), distanceFrom(projected(corners[i]), a, b)));
        }
        // As in a page, about its own corner.
        const glm::vec3 found[] = {corners[0] - middle, corners[1] - middle, corners[2] - middle};
        const float line = f32::linesOfTriangle(found[0], found[1], found[2], weights, direction,
                                                float(kPixelPerDepth * glm::length(hit)));
        ASSERT_NEAR(line, expected, 0.03) << seed;
        seen += expected > 0.5 ? 1 : 0;
        faint += expected > 0.05 && expected < 0.5 ? 1 : 0;
    }
    EXPECT_GT(seen, 1000);
    EXPECT_GT(faint, 500);
}

TEST_F(LinesTest, OfLeavesAreWhereTheSurfaceMeetsTheirWalls) {
    int seen = 0;
    for (int seed = 0; seed < 20000; ++seed) {
        const double edge = size(0.008, 0.4);
        const glm::dvec3 low = inCube(0.5) + glm::dvec3(0, 0, -kDistance);
        const glm::dvec3 x(part(), part(), seed % 2 == 0 ? part() : 0.03 * part());
        const glm::dvec3 hit = low + edge * x, direction = glm::normalize(hit), n = glm::normalize(inCube(1));
        if (std::abs(glm::dot(n, direction)) < 0.05) continue;
        double expected = 0;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 wall(0);
            wall[axis] = 1;
            const glm::dvec3 along = glm::cross(n, wall);
            if (glm::length(along) < 0.01) continue;
            // A step in the surface across the line, by which the walls are reached.
            const glm::dvec3 step = glm::cross(along, n) / glm::cross(along, n)[axis];
            double distance[2];
            for (int side = 0; side < 2; ++side) {
                const glm::dvec3 on = hit + step * (low[axis] + side * edge - hit[axis]);
                distance[side] =
                    distanceFrom(projected(hit), projected(on), projected(on + edge * glm::normalize(along)));
            }
            expected = std::max(expected, lineSeen(std::min(distance[0], distance[1]), distance[0] + distance[1]));
        }
        const float line = f32::linesOfLeaf(x, n, direction, float(kPixelPerDepth * glm::length(hit) / edge));
        ASSERT_NEAR(line, expected, 0.03) << seed;
        seen += expected > 0.5 ? 1 : 0;
    }
    EXPECT_GT(seen, 1000);
}

class WireframeTest : public test::RendererFixture {
protected:
    Picture pictureOf(const FrameRequest& request) {
        draw(request);
        return *renderer_->readPicture();
    }
    static uint64_t darkened(const Picture& plain, const Picture& wired) {
        uint64_t count = 0;
        for (size_t i = 0; i < plain.rgba.size(); i += 4) count += wired.rgba[i] + 16 < plain.rgba[i] ? 1 : 0;
        return count;
    }
};

// Lines that would fill the picture are not there: it is clay.
TEST_F(WireframeTest, FadesWhereLinesWouldBeDense) {
    start();
    const test::Scene scene = test::sphereScene(3);
    show(scene);
    FrameRequest request =
        test::requestOf(fitCamera(scene.boxMin, scene.boxMax, {-0.3, -0.5, -1}, {0, 1, 0}, 0.6, 4.0 / 3), 160, 120);
    request.errorPixels = 1e-6;
    const auto picturesOf = [&](FrameRequest asked) {
        asked.shading.mode = ShadingMode::Clay;
        const Picture clay = pictureOf(asked);
        asked.shading.mode = ShadingMode::Wireframe;
        return std::pair(clay, pictureOf(asked));
    };
    FrameRequest far = request;
    far.camera.eye -= 6.0 * glm::length(scene.boxMax - scene.boxMin) * far.camera.forward;
    const auto [farClay, farWired] = picturesOf(far);
    EXPECT_EQ(farWired, farClay);
    FrameRequest near = request;
    near.width = 640, near.height = 480;
    const auto [clay, wired] = picturesOf(near);
    EXPECT_GT(darkened(clay, wired), 2000u);
    // Lines take the part of the picture that they take, not more: most of it is between them.
    EXPECT_LT(darkened(clay, wired), uint64_t{640} * 480 / 3);
}

TEST_F(WireframeTest, HasTheSamplesOfAPicture) {
    FrameRequest request;
    request.shading.mode = ShadingMode::Wireframe;
    EXPECT_EQ(samplesOf(request, 16), 16u);
    request.shading.mode = ShadingMode::Level;
    EXPECT_EQ(samplesOf(request, 16), 1u);
}

}  // namespace
}  // namespace vcp
