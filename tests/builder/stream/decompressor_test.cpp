#include <random>

#include <gtest/gtest.h>

#include "tests/support/compression.h"
#include "tests/support/piped_bytes.h"

namespace vcp {
namespace {

using test::gzipped;
using test::piped;
using test::zstandard;

// Everything that comes out, or the error's line.
std::string drained(Result<ByteSource> source) {
    if (!source) return "error: " + source.error().line();
    std::string all;
    while (true) {
        const auto view = source->window();
        if (!view) return "error: " + view.error().line();
        if (source->atEnd()) return all;
        all += *view;
        source->advance(view->size());
    }
}

std::string noise(size_t count) {
    std::mt19937 random(7);
    std::string bytes(count, '\0');
    for (char& c : bytes) c = char(random() % 23);
    return bytes;
}

bool failed(const std::string& text) { return text.starts_with("error: "); }

TEST(Decompressor, GivesBackWhatWentInWhateverTheSteps) {
    for (const size_t count : {0, 1, 100, 300'000}) {
        const std::string bytes = noise(count);
        for (const auto& packed : {gzipped(bytes), zstandard(bytes)})
            for (const size_t step : {1, 3, 1000, 1'000'000})
                for (const size_t window : {1, 100, 100'000}) {
                    if (count * (1 + 1000 / window) > 1'000'000 || packed.size() > 10'000 * step) continue;
                    EXPECT_TRUE(drained(piped(packed, step, window)) == bytes) << count << ' ' << step << ' ' << window;
                }
    }
}

TEST(Decompressor, ReadsMembersOneAfterAnother) {
    const std::string zeros(100, '\0');
    EXPECT_EQ(drained(piped(gzipped("ab") + gzipped("") + gzipped("c") + zeros, 5, 16)), "abc");
    EXPECT_EQ(drained(piped(zstandard("ab") + zstandard("") + zstandard("c") + zeros, 5, 16)), "abc");
    const std::string skippable("\x50\x2A\x4D\x18\x03\0\0\0xyz", 11);
    EXPECT_EQ(drained(piped(skippable + zstandard("ab") + skippable, 5, 16)), "ab");
}

TEST(Decompressor, EveryTruncationIsAnError) {
    const std::string bytes = noise(200);
    for (const auto& packed : {gzipped(bytes), zstandard(bytes)})
        for (size_t kept = kCompressionMarkBytes; kept < packed.size(); ++kept) {
            const std::string text = drained(piped(std::string_view(packed).substr(0, kept), 7, 64));
            EXPECT_TRUE(failed(text) && text.find("truncated") != std::string::npos) << kept << text;
        }
}

TEST(Decompressor, DamageIsAnErrorThatSaysSo) {
    const std::string bytes = noise(5000);
    std::string packed = gzipped(bytes);
    for (size_t at = packed.size() / 4; at < packed.size(); at += 101) {
        std::string broken = packed;
        broken[at] = char(broken[at] ^ 0x10);
        EXPECT_TRUE(failed(drained(piped(broken, 1000, 64)))) << at;
    }
    EXPECT_NE(drained(piped(gzipped("a") + "garbage", 1000, 64)).find("gzip data are damaged"), std::string::npos);
    EXPECT_NE(drained(piped(zstandard("a") + "garbage", 1000, 64)).find("zstd data are damaged"), std::string::npos);
}

TEST(Decompressor, ABombIsRefused) {
    // 128 KiB of zeros a block of 4 bytes: zstd's raw format, 100,000 blocks in one frame without a size.
    std::string bomb("\x28\xB5\x2F\xFD\x00\x58", 6);
    const std::string block("\x02\x00\x10\x00", 4);  // a run of 0x20000 zeros, not the last
    for (int i = 0; i < 100'000; ++i) bomb += block;
    auto source = piped(bomb, 1'000'000, ByteSource::kWindowBytes);
    ASSERT_TRUE(source.ok()) << source.error().line();
    const auto skipped = source->skip(uint64_t{1} << 40);
    ASSERT_FALSE(skipped.ok());
    EXPECT_EQ(skipped.error().code, ErrorCode::Limit) << skipped.error().line();
}

}  // namespace
}  // namespace vcp
