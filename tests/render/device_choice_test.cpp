// Which device a choice means.
#include <gtest/gtest.h>

#include "render/vulkan/instance.h"

namespace vcp {
namespace {

DeviceInfo device(uint32_t index, std::string name, std::string type, bool usable = true) {
    return {.index = index,
            .name = std::move(name),
            .type = std::move(type),
            .driver = {},
            .software = false,
            .usable = usable,
            .chosen = false};
}

TEST(DeviceChoice, BestTypeFirstOfEquals) {
    const std::vector<DeviceInfo> all = {device(0, "llvmpipe", "cpu"), device(1, "Old", "discrete", false),
                                         device(2, "Iris", "integrated"), device(3, "GeForce A", "discrete"),
                                         device(4, "GeForce B", "discrete")};
    EXPECT_EQ(*chooseDevice(all, ""), 3u);
    EXPECT_EQ(*chooseDevice({all[0], all[1], all[2]}, ""), 2u);
    EXPECT_EQ(*chooseDevice({all[0]}, ""), 0u);
}

TEST(DeviceChoice, ByIndexOrPartOfTheName) {
    const std::vector<DeviceInfo> all = {device(0, "llvmpipe (LLVM 15)", "cpu"), device(1, "Old", "discrete", false),
                                         device(2, "NVIDIA B", "discrete")};
    EXPECT_EQ(*chooseDevice(all, "0"), 0u);
    EXPECT_EQ(*chooseDevice(all, "LLVM"), 0u);
    EXPECT_EQ(*chooseDevice(all, "nvidia"), 2u);
    for (const char* wrong : {"7", "radeon", "old", "1", "-1", "2x"}) {
        const auto choice = chooseDevice(all, wrong);
        ASSERT_FALSE(choice) << wrong;
        EXPECT_EQ(choice.error().code, ErrorCode::Device);
        EXPECT_NE(choice.error().message.find("NVIDIA B"), std::string::npos) << "the message lists what there is";
    }
    EXPECT_FALSE(chooseDevice({}, ""));
}

TEST(DeviceChoice, ThisMachineListsItsDevices) {
    const auto devices = listDevices();
    ASSERT_TRUE(devices) << devices.error().line();
    int chosen = 0;
    for (const DeviceInfo& info : *devices) {
        EXPECT_FALSE(info.name.empty());
        EXPECT_EQ(info.software, info.type == "cpu");
        chosen += info.chosen ? 1 : 0;
    }
    EXPECT_EQ(chosen, 1);
    EXPECT_FALSE(listDevices("no such device"));
}

}  // namespace
}  // namespace vcp
