// Isolated pixels, silhouettes, light and normals of pictures that are made by hand.
#include "viewer/bench/picture/picture_difference.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr int kWidth = 40, kHeight = 30;
constexpr float kNothing = std::numeric_limits<float>::infinity();

size_t at(int x, int y) { return size_t(y) * kWidth + x; }

/// A wall before the camera, one unit away.
LightPicture wall() {
    constexpr size_t kPixels = size_t{kWidth} * kHeight;
    return {{kWidth, kHeight},
            std::vector<float>(kPixels, 0.7f),
            std::vector<float>(kPixels, 1.0f),
            std::vector<glm::vec3>(kPixels, glm::vec3(0, 0, 1)),
            std::vector<float>(kPixels, 1.0f)};
}

void remove(LightPicture& picture, int x, int y) {
    picture.coverage[at(x, y)] = 0;
    picture.depth[at(x, y)] = kNothing;
}

TEST(PictureDifference, LightErrorIsTheRootOfTheMeanSquare) {
    const LightPicture reference = wall();
    LightPicture picture = reference;
    EXPECT_EQ(lightError(reference, picture), 0);
    for (float& light : picture.light) light -= 0.2f;
    EXPECT_NEAR(lightError(reference, picture), 0.2, 1e-6);
    picture = reference;
    picture.light[at(3, 4)] = 0.1f;
    EXPECT_NEAR(lightError(reference, picture), 0.6 / std::sqrt(kWidth * kHeight), 1e-6);
}

TEST(PictureDifference, APixelIsIsolatedWhereOnlyItsLightDiffers) {
    const Camera camera;
    LightPicture picture = wall();
    EXPECT_TRUE(isolatedPixels(picture, camera).empty());
    picture.light[at(10, 12)] = 0.7f - 41.0f / 255;
    ASSERT_EQ(isolatedPixels(picture, camera).size(), 1u);
    EXPECT_EQ(isolatedPixels(picture, camera).front(), glm::ivec2(10, 12));
    picture.light[at(10, 12)] = 0.7f - 39.0f / 255;
    EXPECT_TRUE(isolatedPixels(picture, camera).empty()) << "no more than 40 of 255";
    picture.light[at(10, 12)] = picture.light[at(11, 13)] = 0.1f;
    EXPECT_TRUE(isolatedPixels(picture, camera).empty()) << "two side by side are not isolated";
}

TEST(PictureDifference, APixelOfAnotherDepthIsNotIsolated) {
    const Camera camera;
    const double footprint = 2 * std::tan(camera.verticalFov / 2) / kHeight;
    LightPicture picture = wall();
    picture.light[at(10, 12)] = 0.1f;
    picture.depth[at(10, 12)] = float(1 + 3.8 * footprint);
    EXPECT_EQ(isolatedPixels(picture, camera).size(), 1u);
    picture.depth[at(10, 12)] = float(1 + 5 * footprint);
    EXPECT_TRUE(isolatedPixels(picture, camera).empty());
    // The slope of what is seen counts, not the normal of the pixel that is wrong.
    for (glm::vec3& normal : picture.normals) normal = {std::sqrt(0.75f), 0, 0.5f};
    picture.normals[at(10, 12)] = {0, 0, 1};
    EXPECT_EQ(isolatedPixels(picture, camera).size(), 1u);
    remove(picture, 11, 12);
    EXPECT_TRUE(isolatedPixels(picture, camera).empty()) << "beside it nothing is seen";
}

TEST(PictureDifference, SilhouettesAreAsFarApartAsTheyWereMoved) {
    LightPicture reference = wall(), moved = wall();
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            if (x >= 20) remove(reference, x, y);
            if (x >= 23) remove(moved, x, y);
        }
    SilhouetteDifference same = silhouetteDifference(reference, reference);
    EXPECT_EQ(same.pixels, 0u);
    EXPECT_EQ(same.distancePixels.max, 0);
    const SilhouetteDifference apart = silhouetteDifference(reference, moved);
    EXPECT_EQ(apart.pixels, 3u * kHeight);
    EXPECT_EQ(apart.distancePixels.p50, 3);
    EXPECT_EQ(apart.distancePixels.max, 3);
}

TEST(PictureDifference, SilhouetteDistancesAreThoseOfASearch) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        std::mt19937 random(seed);
        LightPicture a = wall(), b = wall();
        // One open pixel in a covered wall has an outline of its four neighbours.
        const glm::ivec2 p(3 + random() % 30, 3 + random() % 20), q(3 + random() % 30, 3 + random() % 20);
        remove(a, p.x, p.y), remove(b, q.x, q.y);
        const glm::ivec2 sides[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
        double farthest = 0;
        for (const auto& [from, to] : {std::pair(p, q), std::pair(q, p)})
            for (const glm::ivec2 s : sides) {
                double nearest = 1e9;
                for (const glm::ivec2 r : sides)
                    nearest = std::min(nearest, std::hypot(from.x + s.x - to.x - r.x, from.y + s.y - to.y - r.y));
                farthest = std::max(farthest, nearest);
            }
        EXPECT_NEAR(silhouetteDifference(a, b).distancePixels.max, farthest, 1e-5) << "seed " << seed;
    }
}

TEST(PictureDifference, NormalsAreComparedWhereBothCoverThePixel) {
    const LightPicture reference = wall();
    LightPicture picture = reference;
    const float angle = 10 * std::numbers::pi_v<float> / 180;
    for (glm::vec3& normal : picture.normals) normal = {std::sin(angle), 0, std::cos(angle)};
    EXPECT_NEAR(normalDifference(reference, picture).p50, 10, 1e-3);
    EXPECT_NEAR(normalDifference(reference, picture).max, 10, 1e-3);
    picture.normals[at(5, 5)] = {1, 0, 0};
    picture.coverage[at(5, 5)] = 0.5f;
    EXPECT_NEAR(normalDifference(reference, picture).max, 10, 1e-3);
}

}  // namespace
}  // namespace vcp
