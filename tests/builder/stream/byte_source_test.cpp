#include "builder/stream/byte_source.h"

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <numeric>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/piped_bytes.h"

namespace vcp {
namespace {

std::filesystem::path temporaryFile(std::string_view bytes) {
    const auto path = std::filesystem::temp_directory_path() / ("vcp_byte_source_" + std::to_string(::getpid()));
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
}

std::string countedBytes(size_t count) {
    std::string bytes(count, '\0');
    std::iota(bytes.begin(), bytes.end(), '\0');
    return bytes;
}

void expectReadsForward(ByteSource source, std::string_view bytes, size_t window) {
    size_t step = 1;
    while (!source.atEnd()) {
        const auto view = source.window(step);
        ASSERT_TRUE(view.ok()) << view.error().line();
        ASSERT_GE(view->size(), std::min<uint64_t>(step, source.remaining()));
        ASSERT_EQ(*view, bytes.substr(source.offset(), view->size())) << "window " << window;
        source.advance(std::min<uint64_t>(step, source.remaining()));
        step = step * 3 % 101 + 1;
    }
    EXPECT_EQ(source.offset(), bytes.size());
}

TEST(ByteSource, FileAndMemoryReadTheSameInAnyWindow) {
    const std::string bytes = countedBytes(5000);
    const auto path = temporaryFile(bytes);
    for (const size_t window : {1, 2, 13, 100, 4096, 100000}) {
        auto file = ByteSource::open(path, window);
        ASSERT_TRUE(file.ok()) << file.error().line();
        expectReadsForward(std::move(*file), bytes, window);
        expectReadsForward(ByteSource::fromMemory(bytes, "bytes", window), bytes, window);
    }
    std::filesystem::remove(path);
}

TEST(ByteSource, AdvancesPastTheWindow) {
    const std::string bytes = countedBytes(5000);
    const auto path = temporaryFile(bytes);
    auto source = ByteSource::open(path, 16);
    ASSERT_TRUE(source.ok());
    ASSERT_TRUE(source->window().ok());
    EXPECT_EQ(*source->skip(4000), 4000u);
    EXPECT_EQ(source->window(4)->substr(0, 4), bytes.substr(4000, 4));
    std::filesystem::remove(path);
}

TEST(ByteSource, TakesLinesWithAnyEnd) {
    for (const size_t window : {1, 2, 5, 100}) {
        auto source = ByteSource::fromMemory("one\r\n\ntwo\nlast", "text", window);
        for (const std::string_view expected : {"one", "", "two", "last"}) {
            const auto line = source.line(100);
            ASSERT_TRUE(line.ok() && line->has_value());
            EXPECT_EQ(**line, expected);
        }
        EXPECT_FALSE(source.line(100)->has_value());
    }
}

TEST(ByteSource, RefusesALineThatIsTooLong) {
    const std::string text = "short\n" + std::string(1000, 'x') + "\n";
    for (const size_t window : {1, 64, 100000}) {
        auto source = ByteSource::fromMemory(text, "text", window);
        ASSERT_TRUE(source.line(100).ok());
        const auto line = source.line(100);
        ASSERT_FALSE(line.ok());
        EXPECT_EQ(line.error().code, ErrorCode::Limit);
        EXPECT_EQ(line.error().byte, 6u);
    }
}

TEST(ByteSource, AFileThatShrinksIsAnError) {
    const auto path = temporaryFile(countedBytes(1000));
    auto source = ByteSource::open(path, 16);
    ASSERT_TRUE(source.ok());
    std::filesystem::resize_file(path, 20);
    source->advance(16);
    const auto view = source->window(16);
    ASSERT_FALSE(view.ok());
    EXPECT_EQ(view.error().code, ErrorCode::Io);
    EXPECT_EQ(view.error().byte, 20u);
    std::filesystem::remove(path);
}

TEST(ByteSource, ReadsANamedPipe) {
    const auto path = std::filesystem::temp_directory_path() / ("vcp_pipe_" + std::to_string(::getpid()));
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    const std::string bytes = countedBytes(5000);
    std::thread writer([&] { std::ofstream(path, std::ios::binary) << bytes; });
    auto source = ByteSource::open(path, 64);
    EXPECT_TRUE(source.ok());
    if (source.ok()) {
        EXPECT_FALSE(source->sizeKnown());
        EXPECT_EQ(source->fileBytes(), 0u);
        expectReadsForward(std::move(*source), bytes, 64);
    }
    writer.join();
    std::filesystem::remove(path);
}

TEST(ByteSource, APipeReadsTheSameInAnyWindowAndStep) {
    const std::string bytes = countedBytes(5000);
    for (const size_t window : {1, 2, 13, 100, 4096, 100000})
        for (const size_t step : {1, 7, 100000}) {
            auto source = test::piped(bytes, step, window);
            ASSERT_TRUE(source.ok());
            expectReadsForward(std::move(*source), bytes, window);
            auto skipped = test::piped(bytes, step, window);
            EXPECT_EQ(*skipped->skip(4000), 4000u);
            EXPECT_EQ(skipped->window(4)->substr(0, 4), bytes.substr(4000, 4));
            EXPECT_EQ(*skipped->skip(4000), 1000u);
            EXPECT_TRUE(skipped->atEnd());
        }
}

TEST(ByteSource, AHugeRequestOnAShortPipeAllocatesOnlyWhatArrives) {
    auto source = test::piped("short", 5, 16);
    const auto view = source->window(size_t{1} << 50);
    ASSERT_TRUE(view.ok());
    EXPECT_EQ(*view, "short");
    EXPECT_TRUE(source->sizeKnown());
}

}  // namespace
}  // namespace vcp
