#include "viewer/command/terminal/suggestion.h"

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(Suggestion, DistanceCountsMistypedLetters) {
    EXPECT_EQ(editDistance("render", "render"), 0u);
    EXPECT_EQ(editDistance("", "view"), 4u);
    EXPECT_EQ(editDistance("rendr", "render"), 1u);
    EXPECT_EQ(editDistance("rneder", "render"), 1u);
    EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
    EXPECT_EQ(editDistance("sitting", "kitten"), 3u);
}

TEST(Suggestion, NearestNameOrNone) {
    const std::vector<std::string> names = {"build", "bench", "render", "view"};
    EXPECT_EQ(nearestName("buidl", names), "build");
    EXPECT_EQ(nearestName("rendering", names), "render");
    EXPECT_EQ(nearestName("vew", names), "view");
    EXPECT_FALSE(nearestName("fly", names));
    EXPECT_FALSE(nearestName("x", {}));
}

}  // namespace
}  // namespace vcp
