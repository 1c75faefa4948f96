// Small files of text, and what may stand in their place: a test that waits for a pipe never ends.
#include "viewer/camera/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "render/picture.h"
#include "tests/support/test_folder.h"
#include "viewer/camera/camera_path.h"
#include "viewer/camera/orbit_camera.h"
#include "viewer/scene/mesh_cache.h"
#include "viewer/scene/scene_file.h"
#include "viewer/window/user_settings.h"

namespace vcp {
namespace {

TEST(TextFile, IsReadWithinItsLimit) {
    const TestFolder folder("vcp_text_file_test");
    std::ofstream(folder / "text") << std::string(100'000, 'a');
    const auto text = readText(folder / "text", 100'000, "a text");
    ASSERT_TRUE(text) << text.error().line();
    EXPECT_EQ(text->size(), 100'000u);
    const auto large = readText(folder / "text", 99'999, "a text");
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().code, ErrorCode::Limit);
    EXPECT_EQ(readText(folder / "none", 10, "a text", "is not there").error().message, "is not there");
}

TEST(TextFile, APipeOfTheShellIsRead) {
    int ends[2] = {};
    ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
    ASSERT_EQ(::write(ends[1], "piped", 5), 5);
    ::close(ends[1]);
    const auto text = readText(fmt::format("/dev/fd/{}", ends[0]), 10, "a text");
    ::close(ends[0]);
    ASSERT_TRUE(text) << text.error().line();
    EXPECT_EQ(*text, "piped");
}

TEST(TextFile, NothingThatIsReadWaitsForAPipe) {
    const TestFolder folder("vcp_text_file_test");
    const std::filesystem::path pipe = folder / "pipe.json";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const auto expectRefused = [&](const auto& read) {
        ASSERT_FALSE(read);
        EXPECT_EQ(read.error().line(), pipe.string() + ": is a pipe, not a file");
    };
    expectRefused(readText(pipe, 10, "a text"));
    expectRefused(readScene(pipe));
    expectRefused(readCamera(pipe));
    expectRefused(readCameras(pipe));
    expectRefused(readUserSettings(pipe));
    expectRefused(readPng(pipe));
    EXPECT_FALSE(looksLikeDataset(pipe));
    EXPECT_EQ(readCamera("/dev/zero").error().message, "is a device, not a file");
    EXPECT_EQ(readScene(folder.path()).error().message, "is a folder, not a file");
}

}  // namespace
}  // namespace vcp
