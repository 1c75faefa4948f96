#include "builder/stream/random_bytes.h"

#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <glm/vec2.hpp>

#include "builder/stream/data_uri.h"
#include "builder/stream/spilled_array.h"
#include "tests/support/gltf_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

TEST(Spool, ReadsBackInMemoryAndFromItsFile) {
    TestFolder folder("vcp_spool");
    std::mt19937 random(1);
    for (const size_t memory : {0, 100, 100'000}) {
        Spool spool(folder.path(), memory);
        std::string all;
        for (int i = 0; i < 200; ++i) {
            const std::string piece(random() % 100, char(i));
            ASSERT_TRUE(spool.append(piece).ok());
            all += piece;
            const size_t offset = random() % (all.size() + 1), count = random() % (all.size() - offset + 1);
            std::string read(count, '\0');
            ASSERT_TRUE(spool.read(offset, read.data(), count).ok());
            ASSERT_EQ(read, all.substr(offset, count));
        }
        EXPECT_EQ(spool.size(), all.size());
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "its file has no name";
    }
    Spool nowhere(folder / "missing", 0);
    const auto failed = nowhere.append("x");
    ASSERT_FALSE(failed.ok());
    EXPECT_EQ(failed.error().code, ErrorCode::Io);
    EXPECT_EQ(failed.error().file, (folder / "missing").string());
}

TEST(Spool, DamageIsNoticed) {
    TestFolder folder("vcp_spool");
    std::mt19937 random(2);
    std::string all(200'000, '\0');
    for (char& c : all) c = char(random());
    for (const size_t damaged : {size_t{0}, size_t{65'535}, size_t{65'536}, size_t{131'071}}) {
        Spool spool(folder.path(), 1000);
        for (size_t at = 0; at < all.size(); at += 777)
            ASSERT_TRUE(spool.append(std::string_view(all).substr(at, 777)).ok());
        // Its file has no name, but the descriptor has one.
        for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
            std::error_code ignored;
            const auto target = std::filesystem::read_symlink(entry.path(), ignored).string();
            if (target.find((folder / "vcp_spool_").string()) == std::string::npos) continue;
            std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
            file.seekp(std::streamoff(damaged));
            file.put(char(all[damaged] ^ 16));
        }
        size_t refused = 0;
        std::string part(1000, '\0');
        for (size_t at = 0; at < all.size(); at += part.size()) {
            const auto read = spool.read(at, part.data(), part.size());
            if (read) {
                ASSERT_EQ(part, all.substr(at, part.size())) << at;
                continue;
            }
            ++refused;
            EXPECT_EQ(read.error().code, ErrorCode::InvalidInput);
            EXPECT_NE(read.error().message.find("came back damaged"), std::string::npos) << read.error().line();
        }
        EXPECT_GT(refused, 60u) << damaged;
        EXPECT_LT(refused, 70u) << damaged;
    }
}

TEST(SpilledArray, GivesWhatWasAppendedBeyondItsMemory) {
    TestFolder folder("vcp_uv");
    SpilledArray<glm::vec2> array(folder.path(), 3);
    constexpr uint64_t kCount = 10 * SpilledArray<glm::vec2>::kBlock + 17;
    const auto uv = [](uint64_t i) { return glm::vec2(float(i), float(i % 97)); };
    std::mt19937_64 random(2);
    for (uint64_t i = 0; i < kCount; ++i) {
        ASSERT_TRUE(array.append(uv(i)).ok());
        if (i % 1000 == 0) {
            const uint64_t number = random() % (i + 1);
            EXPECT_EQ(*array.at(number), uv(number));
        }
    }
    for (int i = 0; i < 5000; ++i) {
        const uint64_t number = random() % kCount;
        ASSERT_EQ(*array.at(number), uv(number)) << number;
    }
}

TEST(RandomBytes, OpensRegularFilesOnly) {
    TestFolder folder("vcp_random");
    std::ofstream(folder / "a") << "0123456789";
    auto bytes = openRandomBytes(folder / "a", 4);
    ASSERT_TRUE(bytes.ok());
    EXPECT_EQ((*bytes)->size(), 6u);
    char two[2];
    ASSERT_TRUE((*bytes)->read(3, two, 2).ok());
    EXPECT_EQ(std::string(two, 2), "78");
    std::filesystem::resize_file(folder / "a", 5);
    EXPECT_FALSE((*bytes)->read(3, two, 2).ok());
    EXPECT_FALSE(openRandomBytes("/dev/zero").ok());
    EXPECT_FALSE(openRandomBytes(folder.path()).ok());
    EXPECT_FALSE(openRandomBytes(folder / "b").ok());
}

TEST(DataUri, DecodesBase64OfAnyLength) {
    for (size_t count = 0; count < 10; ++count) {
        std::string bytes;
        for (size_t i = 0; i < count; ++i) bytes += char(250 + 3 * i);
        EXPECT_EQ(decodeDataUri("data:x/y;base64," + test::base64(bytes)), bytes);
    }
    EXPECT_EQ(decodeDataUri("data:;base64,-_-_"), std::string("\xFB\xFF\xBF", 3));
    for (const char* wrong : {"data:,abc", "data:x;base64", "data:;base64,a", "data:;base64,ab*d", "file.bin"})
        EXPECT_FALSE(decodeDataUri(wrong)) << wrong;
}

TEST(FileBelow, StaysBelowTheFolder) {
    const std::filesystem::path folder = "/a/b";
    EXPECT_EQ(fileBelow(folder, "c%20d/e.bin"), folder / "c d/e.bin");
    EXPECT_EQ(fileBelow(folder, "c:d"), std::nullopt);
    EXPECT_EQ(fileBelow(folder, "c/d:e"), folder / "c/d:e");
    EXPECT_EQ(fileBelow(folder, "100%"), folder / "100%");
    for (const char* wrong :
         {"", "/etc/passwd", "../x", "c/../../x", "%2e%2e/x", "..%5cx", "\\x", "http://x/y", "c%00d"})
        EXPECT_EQ(fileBelow(folder, wrong), std::nullopt) << wrong;
    EXPECT_EQ(nameBelow(folder, ".\\c\\d.jpg"), folder / "./c/d.jpg");
    EXPECT_EQ(nameBelow(folder, "C:\\d.jpg"), std::nullopt);
    EXPECT_EQ(nameBelow(folder, "100%20.jpg"), folder / "100%20.jpg");
}

}  // namespace
}  // namespace vcp
