// Videos: what goes to ffmpeg and what is left of it, with programs in its place; and what comes out of the real one.
#include "viewer/picture/video_file.h"

#include <cstdlib>
#include <fstream>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/ext/vector_uint3_sized.hpp>

#include "tests/support/encoder_in_path.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

class VideoFileTest : public testing::Test {
protected:
    [[nodiscard]] std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& each : fs::directory_iterator(folder_.path()))
            if (each.path().filename() != "bin") names.push_back(each.path().filename().string());
        return names;
    }

    const TestFolder folder_{"vcp_video_file_test"};
};

/// A frame of one colour.
std::vector<uint8_t> frameOf(const VideoFormat& format, glm::u8vec3 colour) {
    std::vector<uint8_t> rgba;
    for (uint32_t i = 0; i < format.width * format.height; ++i)
        rgba.insert(rgba.end(), {colour.x, colour.y, colour.z, 255});
    return rgba;
}

TEST_F(VideoFileTest, FramesGoToTheEncoderAsTheyAre) {
    const test::EncoderInPath encoder(
        folder_.path(),
        fmt::format("echo \"$@\" >{0}/said\n(printf '1234ftyp'; cat) >/dev/fd/3\n", folder_.path().string()));
    const VideoFormat format{.width = 300, .height = 200, .framesPerSecond = 25};
    auto video = VideoFile::create(folder_ / "a.mp4", format);
    ASSERT_TRUE(video) << video.error().line();
    std::string wanted = "1234ftyp";
    for (const uint8_t grey : {uint8_t{10}, uint8_t{20}, uint8_t{30}}) {
        std::vector<uint8_t> rgba = frameOf(format, glm::u8vec3(grey));
        rgba[5] = 77;
        wanted.append(rgba.begin(), rgba.end());
        // In two bands of rows.
        const std::span<const uint8_t> all(rgba);
        ASSERT_TRUE((*video)->add(all.first(size_t{4} * 300 * 50)));
        ASSERT_TRUE((*video)->add(all.subspan(size_t{4} * 300 * 50)));
    }
    EXPECT_FALSE(fs::exists(folder_ / "a.mp4"));
    const auto finished = (*video)->finish();
    ASSERT_TRUE(finished) << finished.error().line();
    EXPECT_EQ(contentOf(folder_ / "a.mp4"), wanted);
    const std::string said = contentOf(folder_ / "said");
    for (const char* part : {"-video_size 300x200 ", "-framerate 25 ", "-pix_fmt rgba ", " -f mp4 "})
        EXPECT_NE(said.find(part), std::string::npos) << said;
}

TEST_F(VideoFileTest, WhatTheEncoderSaysIsTheError) {
    const test::EncoderInPath encoder(folder_.path(),
                                      "cat >/dev/null\necho first >&2\necho 'no such codec' >&2\nexit 3\n");
    auto video = VideoFile::create(folder_ / "a.webm", {.width = 8, .height = 8});
    ASSERT_TRUE(video) << video.error().line();
    ASSERT_TRUE((*video)->add(frameOf({.width = 8, .height = 8}, {})));
    const auto finished = (*video)->finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().line().find("a.webm: ffmpeg failed: no such codec"), std::string::npos)
        << finished.error().line();
    video->reset();
    EXPECT_TRUE(files().empty());
}

TEST_F(VideoFileTest, WhatTheEncoderSaysIsAnErrorHoweverItEnds) {
    const VideoFormat format{.width = 8, .height = 8};
    Result<std::unique_ptr<VideoFile>> video = std::unique_ptr<VideoFile>();
    {
        // As ffmpeg does where the disk is full.
        const test::EncoderInPath encoder(
            folder_.path(), std::string(test::EncoderInPath::kCopies) + "echo 'No space left on device' >&2\n");
        video = VideoFile::create(folder_ / "a.mp4", format);
    }
    ASSERT_TRUE(video) << video.error().line();
    ASSERT_TRUE((*video)->add(frameOf(format, {})));
    const auto finished = (*video)->finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().line().find("No space left on device"), std::string::npos);
    video->reset();
    EXPECT_TRUE(files().empty());
}

TEST_F(VideoFileTest, AnEncoderThatGoesAwayIsNoSignal) {
    const test::EncoderInPath encoder(folder_.path(), "echo 'disk full' >&2\nexit 1\n");
    const VideoFormat format{.width = 1000, .height = 1000};
    auto video = VideoFile::create(folder_ / "a.mp4", format);
    ASSERT_TRUE(video) << video.error().line();
    Result<void> added;
    for (int i = 0; i < 100 && added; ++i) added = (*video)->add(frameOf(format, {}));
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().line().find("disk full"), std::string::npos) << added.error().line();
    video->reset();
    EXPECT_TRUE(files().empty());
}

TEST_F(VideoFileTest, WhatIsNotFinishedLeavesNothing) {
    const test::EncoderInPath encoder(folder_.path());
    {
        std::ofstream(folder_ / "a.mp4") << "1234ftyp of before";
        auto video = VideoFile::create(folder_ / "a.mp4", {.width = 8, .height = 8});
        ASSERT_TRUE(video) << video.error().line();
        ASSERT_TRUE((*video)->add(std::vector<uint8_t>(32)));
        EXPECT_FALSE((*video)->finish()) << "seven rows are missing";
    }
    EXPECT_EQ(files(), std::vector<std::string>{"a.mp4"});
    EXPECT_EQ(contentOf(folder_ / "a.mp4"), "1234ftyp of before");
}

TEST_F(VideoFileTest, RefusesInALine) {
    const std::string path = std::getenv("PATH");
    setenv("PATH", folder_.path().c_str(), 1);
    EXPECT_FALSE(hasVideoEncoder());
    const auto missing = VideoFile::create(folder_ / "a.mp4", {.width = 8, .height = 8});
    setenv("PATH", path.c_str(), 1);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::Unsupported);
    EXPECT_NE(missing.error().line().find("ffmpeg, which is not installed"), std::string::npos);
    const test::EncoderInPath encoder(folder_.path());
    EXPECT_TRUE(hasVideoEncoder());
    EXPECT_FALSE(VideoFile::create(folder_ / "a.avi", {.width = 8, .height = 8}));
    EXPECT_FALSE(VideoFile::create(folder_ / "a.mp4", {.width = 0, .height = 8}));
    EXPECT_FALSE(VideoFile::create(folder_ / "a.mp4", {.width = 8, .height = 8, .framesPerSecond = 0}));
    std::ofstream(folder_ / "text.mp4") << "a letter";
    EXPECT_FALSE(VideoFile::create(folder_ / "text.mp4", {.width = 8, .height = 8})) << "it is no video";
    EXPECT_EQ(contentOf(folder_ / "text.mp4"), "a letter");
}

TEST_F(VideoFileTest, ColoursComeBackFromRealVideos) {
    if (!hasVideoEncoder()) GTEST_SKIP() << "no ffmpeg";
    const std::vector<glm::u8vec3> colours{{250, 20, 10}, {20, 200, 40}, {30, 60, 220}, {128, 128, 128}};
    const VideoFormat format{.width = 61, .height = 35, .framesPerSecond = 10};
    for (const std::string name : {"a.mp4", "a.webm"}) {
        SCOPED_TRACE(name);
        auto video = VideoFile::create(folder_ / name, format);
        ASSERT_TRUE(video) << video.error().line();
        for (const glm::u8vec3& colour : colours) {
            const auto added = (*video)->add(frameOf(format, colour));
            ASSERT_TRUE(added) << added.error().line();
        }
        const auto finished = (*video)->finish();
        ASSERT_TRUE(finished) << finished.error().line();
        const std::string decode = fmt::format("ffmpeg -loglevel error -y -i '{}' -f rawvideo -pix_fmt rgb24 '{}'",
                                               (folder_ / name).string(), (folder_ / "frames").string());
        ASSERT_EQ(std::system(decode.c_str()), 0);
        const std::string frames = contentOf(folder_ / "frames");
        const size_t frameBytes = size_t{3} * 62 * 36;
        ASSERT_EQ(frames.size(), colours.size() * frameBytes);
        for (size_t k = 0; k < colours.size(); ++k)
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(int(uint8_t(frames[k * frameBytes + 3 * (10 * 62 + 20) + size_t(c)])), int(colours[k][c]),
                            4)
                    << "frame " << k << ", channel " << c;
    }
}

}  // namespace
}  // namespace vcp
