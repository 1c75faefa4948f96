#include "viewer/scene/setting_names.h"

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(SettingNames, StandBehindTheFirstOfEachThing) {
    constexpr SettingName names[] = {{"memory cap", "--memory"}, {"cell edge", "--cell"}};
    EXPECT_EQ(withSettingNames("let the memory cap be 700M or more", names),
              "let the memory cap (--memory) be 700M or more");
    EXPECT_EQ(withSettingNames("a smaller cell edge or a larger memory cap; a memory cap", names),
              "a smaller cell edge (--cell) or a larger memory cap (--memory); a memory cap");
    EXPECT_EQ(withSettingNames("cannot be opened", names), "cannot be opened");
    EXPECT_EQ(withSettingNames("", names), "");
}

}  // namespace
}  // namespace vcp
