// Lines over pictures: which pixels they touch, and how much.
#include "viewer/annotation/overlay_lines.h"

#include <limits>

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr uint32_t kSide = 32;

Picture grey(uint8_t alpha = 255) {
    Picture picture{kSide, kSide, std::vector<uint8_t>(4 * size_t{kSide} * kSide, 100)};
    for (size_t i = 3; i < picture.rgba.size(); i += 4) picture.rgba[i] = alpha;
    return picture;
}

/// Looks along -z; a world unit is a pixel, and (0, 0) is the picture's middle.
Camera flat() {
    Camera camera{.eye = {0, 0, 10}, .forward = {0, 0, -1}, .up = {0, 1, 0}};
    camera.projection = Projection::Orthographic;
    camera.orthographicHeight = kSide;
    return camera;
}

int red(const Picture& picture, uint32_t x, uint32_t y) { return picture.rgba[4 * (size_t{y} * kSide + x)]; }

OverlayLine line(std::vector<glm::dvec3> points, float width) { return {std::move(points), {1, 1, 1}, 1, width}; }

TEST(OverlayLines, CoversThePixelsOfItsWidth) {
    Picture picture = grey();
    // Along the middle of row 15: whole there, nothing beside it.
    const OverlayLine lines[] = {line({{-8, 0.5, 0}, {8, 0.5, 0}}, 1)};
    paintLines(lines, flat(), picture);
    for (uint32_t x = 9; x < 23; ++x) {
        EXPECT_EQ(red(picture, x, 15), 255) << x;
        EXPECT_EQ(red(picture, x, 14), 100) << x;
        EXPECT_EQ(red(picture, x, 16), 100) << x;
    }
    EXPECT_EQ(red(picture, 3, 15), 100);
    EXPECT_EQ(red(picture, 28, 15), 100);
}

TEST(OverlayLines, BetweenTwoRowsBothAreHalf) {
    Picture picture = grey();
    const OverlayLine lines[] = {line({{0, -20, 0}, {0, 20, 0}}, 1)};  // along x = 16, beyond both edges
    paintLines(lines, flat(), picture);
    for (uint32_t y = 0; y < kSide; ++y) {
        EXPECT_NEAR(red(picture, 15, y), 178, 1) << y;
        EXPECT_NEAR(red(picture, 16, y), 178, 1) << y;
        EXPECT_EQ(red(picture, 13, y), 100) << y;
    }
}

TEST(OverlayLines, WidthsScaleWithThePicture) {
    Picture picture = grey();
    const OverlayLine lines[] = {line({{-20, 0.5, 0}, {20, 0.5, 0}}, 10)};
    paintLines(lines, flat(), picture, 0.1f);
    EXPECT_EQ(red(picture, 16, 15), 255);
    EXPECT_EQ(red(picture, 16, 13), 100);
}

TEST(OverlayLines, ACornerIsNoMoreOpaqueThanTheLine) {
    Picture picture = grey();
    OverlayLine bent = line({{-10, 0.5, 0}, {0.5, 0.5, 0}, {0.5, 10, 0}, {0.5, 0.5, 0}}, 4);
    bent.opacity = 0.5f;
    paintLines(std::span(&bent, 1), flat(), picture);
    EXPECT_NEAR(red(picture, 16, 15), 178, 1);
    EXPECT_NEAR(red(picture, 10, 15), 178, 1);
    EXPECT_NEAR(red(picture, 16, 10), 178, 1);
}

TEST(OverlayLines, WhatIsBehindTheEyeIsCutOff) {
    Camera camera{.eye = {0, 0, 0}, .forward = {0, 0, -1}, .up = {0, 1, 0}};
    camera.verticalFov = 1.5707963267948966;
    Picture behind = grey();
    const OverlayLine away[] = {line({{-1, 0, 3}, {1, 0, 5}}, 3)};
    paintLines(away, camera, behind);
    EXPECT_EQ(behind, grey());

    // From behind the eye, below it, to straight ahead: from the lower edge to the middle.
    Picture through = grey();
    const OverlayLine passing[] = {line({{0, -1, 5}, {0, 0, -5}}, 2)};
    paintLines(passing, camera, through);
    EXPECT_EQ(red(through, 16, 20), 255);
    EXPECT_EQ(red(through, 16, 31), 255);
    EXPECT_EQ(red(through, 16, 10), 100);
}

TEST(OverlayLines, TransparentPicturesBecomeOpaqueUnderThem) {
    Picture picture = grey(0);
    const OverlayLine lines[] = {line({{-8, 0.5, 0}, {8, 0.5, 0}}, 1)};
    paintLines(lines, flat(), picture);
    EXPECT_EQ(picture.rgba[4 * (15 * size_t{kSide} + 16) + 3], 255);
    EXPECT_EQ(red(picture, 16, 15), 255);
    EXPECT_EQ(picture.rgba[4 * (2 * size_t{kSide} + 2) + 3], 0);
}

TEST(OverlayLines, SinglePointsAndFarAwayOnesAreSafe) {
    Picture picture = grey();
    const OverlayLine lines[] = {line({}, 2), line({{0, 0, 0}}, 2), line({{0.5, 0.5, 0}, {0.5, 0.5, 0}}, 3),
                                 line({{-1e18, -1e18, 0}, {1e18, 1e18, 0}}, 2)};
    paintLines(lines, flat(), picture);
    EXPECT_EQ(red(picture, 16, 15), 255);
}

}  // namespace
}  // namespace vcp
