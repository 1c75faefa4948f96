// The difference of pictures as people see it, against values that follow from its definition alone.
#include "viewer/bench/picture/flip.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

ColourPicture evenPicture(int width, int height, glm::dvec3 colour) {
    return {width, height, std::vector<glm::dvec3>(size_t(width) * height, colour)};
}

ColourPicture randomPicture(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> value(0, 1);
    ColourPicture picture = evenPicture(31, 17, glm::dvec3(0));
    for (glm::dvec3& pixel : picture.pixels) pixel = {value(random), value(random), value(random)};
    return picture;
}

/// What even greys differ by: no features, no colour; only their lightness, by CIELAB, and the paper's map. Lab of pure
/// green and blue: (87.735, -86.183, 83.180) and (32.297, 79.188, -107.860), whose a and b the Hunt effect scales by
/// 0.01 of the lightness.
double expectedOfGreys(double lightness) {
    const double chroma = std::hypot(-86.183 * 0.87735 - 79.188 * 0.32297, 83.180 * 0.87735 + 107.860 * 0.32297);
    const double largest = std::pow(87.735 - 32.297 + chroma, 0.7), knee = 0.4 * largest;
    const double difference = std::pow(lightness, 0.7);
    return difference < knee ? 0.95 * difference / knee : 0.95 + 0.05 * (difference - knee) / (largest - knee);
}

TEST(Flip, IdenticalPicturesDoNotDiffer) {
    for (uint64_t seed = 1; seed <= 5; ++seed) {
        const ColourPicture picture = randomPicture(seed);
        for (const double difference : flip(picture, picture)) EXPECT_EQ(difference, 0) << "seed " << seed;
    }
}

TEST(Flip, BlackAndWhiteAndGreysFollowFromTheirLightness) {
    const ColourPicture black = evenPicture(24, 20, glm::dvec3(0));
    for (const double difference : flip(black, evenPicture(24, 20, glm::dvec3(1))))
        EXPECT_NEAR(difference, expectedOfGreys(100), 2e-4);
    EXPECT_NEAR(expectedOfGreys(100), 0.9674, 2e-4);
    // sRGB 0.5 is 0.21404 of white: lightness 116 * 0.21404^(1/3) - 16 = 53.389.
    for (const double difference : flip(black, evenPicture(24, 20, glm::dvec3(0.5))))
        EXPECT_NEAR(difference, expectedOfGreys(53.389), 2e-4);
    EXPECT_NEAR(expectedOfGreys(53.389), 0.9315, 5e-4);
}

TEST(Flip, GreenAndBlueDifferMost) {
    for (const double difference :
         flip(evenPicture(24, 20, glm::dvec3(0, 1, 0)), evenPicture(24, 20, glm::dvec3(0, 0, 1))))
        EXPECT_NEAR(difference, 1, 1e-6);
}

TEST(Flip, IsSymmetricAndFromZeroToOne) {
    for (uint64_t seed = 1; seed <= 5; ++seed) {
        const ColourPicture a = randomPicture(seed), b = randomPicture(seed + 100);
        const auto there = flip(a, b), back = flip(b, a);
        for (size_t i = 0; i < there.size(); ++i) {
            EXPECT_EQ(there[i], back[i]) << "seed " << seed;
            EXPECT_GE(there[i], 0);
            EXPECT_LE(there[i], 1);
        }
    }
}

TEST(Flip, AnotherPixelShowsThereAndNotFarAway) {
    const ColourPicture grey = evenPicture(61, 61, glm::dvec3(0.5));
    ColourPicture speck = grey;
    speck.pixels[30 * 61 + 30] = glm::dvec3(0);
    const auto differences = flip(grey, speck);
    // At 67 pixels a degree, no filter reaches farther than 10 pixels.
    for (int y = 0; y < 61; ++y)
        for (int x = 0; x < 61; ++x) {
            const double difference = differences[size_t(y) * 61 + x];
            EXPECT_LE(difference, differences[30 * 61 + 30] + 1e-12);
            if (std::max(std::abs(x - 30), std::abs(y - 30)) > 10) {
                EXPECT_LT(difference, 1e-6);
            }
        }
    EXPECT_GT(differences[30 * 61 + 30], 0.1);
    EXPECT_LT(differences[30 * 61 + 30], 0.9);
}

TEST(Flip, WhatIsSeenFromFartherAwayDiffersLess) {
    ColourPicture board = evenPicture(64, 64, glm::dvec3(0));
    for (size_t i = 0; i < board.pixels.size(); ++i) board.pixels[i] = glm::dvec3((i % 64 + i / 64) % 2 == 0 ? 1 : 0);
    // A board of single pixels, seen sharply, and as an even grey of the same light: sRGB 0.7354.
    const ColourPicture grey = evenPicture(64, 64, glm::dvec3(0.7353569830));
    const size_t middle = 32 * 64 + 32;
    EXPECT_LT(flip(board, grey, 200)[middle], flip(board, grey, 20)[middle]);
}

}  // namespace
}  // namespace vcp
