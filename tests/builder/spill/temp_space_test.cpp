// Temporary files: memory first, then the disk; cut and taken over; one build at a time.
#include "builder/spill/temp_space.h"

#include <cstring>
#include <fstream>
#include <random>
#include <thread>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/random_bytes.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::byte>;

class Temp : public ::testing::Test {
protected:
    fs::path place() const { return folder_ / "temp"; }

    static void expectHolds(const TempFile& file, const Bytes& bytes) {
        ASSERT_EQ(file.size(), bytes.size());
        Bytes read(bytes.size());
        ASSERT_TRUE(file.read(0, read).ok());
        ASSERT_TRUE(read == bytes);
    }

    TestFolder folder_{"vcp_temp_space_test"};
};

TEST_F(Temp, LittleStaysInMemory) {
    TempSpace space(place(), 4 << 20);
    TempFile file(space, "pages1.spill");
    const Bytes bytes = test::randomBytes(3 << 20, 1);
    ASSERT_TRUE(file.append(bytes).ok());
    expectHolds(file, bytes);
    EXPECT_FALSE(fs::exists(place()));
    EXPECT_EQ(space.peakDiskBytes(), 0u);
}

TEST_F(Temp, MuchGoesToTheDisk) {
    for (uint64_t seed = 0; seed < 5; ++seed) {
        TempSpace space(place(), 1 << 20);
        TempFile a(space, "pages1.spill"), b(space, "pages2.spill");
        Bytes inA, inB;
        std::mt19937_64 random(seed);
        while (inA.size() + inB.size() < 8 << 20) {
            const bool toA = random() % 3 != 0;
            const Bytes bytes = test::randomBytes(random() % (random() % 8 == 0 ? 900000 : 3000), random());
            Bytes& all = toA ? inA : inB;
            const auto at = (toA ? a : b).append(bytes);
            ASSERT_TRUE(at.ok());
            ASSERT_EQ(*at, all.size());
            all.insert(all.end(), bytes.begin(), bytes.end());
            // Any part, from memory or disk or both.
            const uint64_t from = random() % (all.size() + 1);
            Bytes part(random() % (all.size() - from + 1));
            ASSERT_TRUE((toA ? a : b).read(from, part).ok());
            ASSERT_EQ(std::memcmp(part.data(), all.data() + from, part.size()), 0);
        }
        expectHolds(a, inA);
        expectHolds(b, inB);
        EXPECT_GT(space.diskBytes(), 5u << 20);
        EXPECT_EQ(space.diskBytes(), fs::file_size(place() / "pages1.spill") + fs::file_size(place() / "pages2.spill"));
        const uint64_t peak = space.peakDiskBytes();
        a.remove();
        b.remove();
        EXPECT_EQ(space.diskBytes(), 0u);
        EXPECT_EQ(space.peakDiskBytes(), peak);
        EXPECT_FALSE(fs::exists(place() / "pages1.spill"));
        // It may be used again.
        ASSERT_TRUE(a.append(inB).ok());
        expectHolds(a, inB);
        space.folder().remove();
        EXPECT_FALSE(fs::exists(place()));
    }
}

TEST_F(Temp, ReadersBesideTheWriter) {
    TempSpace space(place(), 1 << 20);
    TempFile file(space, "pages1.spill");
    const Bytes bytes = test::randomBytes(6 << 20, 9);
    std::atomic<bool> wrong = false;
    std::vector<std::thread> readers;
    for (int i = 0; i < 3; ++i)
        readers.emplace_back([&, i] {
            std::mt19937_64 random{uint64_t(i)};
            while (file.size() < bytes.size() && !wrong) {
                const uint64_t size = file.size();
                if (size == 0) continue;
                const uint64_t from = random() % size;
                Bytes part(std::min<uint64_t>(size - from, 5000));
                if (!file.read(from, part) || std::memcmp(part.data(), bytes.data() + from, part.size()) != 0)
                    wrong = true;
            }
        });
    for (size_t at = 0; at < bytes.size(); at += 7777)
        ASSERT_TRUE(file.append(std::span(bytes).subspan(at, std::min<size_t>(7777, bytes.size() - at))).ok());
    for (std::thread& reader : readers) reader.join();
    EXPECT_FALSE(wrong);
    EXPECT_GT(space.peakDiskBytes(), 0u);
}

TEST_F(Temp, TakenOverAndCut) {
    const Bytes bytes = test::randomBytes(700000, 4);
    {
        TempSpace space(place(), 1 << 30);
        TempFile file(space, "pages1.spill");
        ASSERT_TRUE(file.append(bytes).ok());
        EXPECT_FALSE(fs::exists(place()));
        ASSERT_TRUE(file.sync().ok());
        EXPECT_EQ(fs::file_size(place() / "pages1.spill"), bytes.size());
        // More, that is never made durable.
        ASSERT_TRUE(file.append(bytes).ok());
    }
    for (const size_t kept : {size_t{600000}, size_t{1}, size_t{0}}) {
        TempSpace space(place(), 1 << 30);
        ASSERT_TRUE(space.folder().take().ok());
        TempFile file(space, "pages1.spill");
        ASSERT_TRUE(file.reopen(kept).ok());
        Bytes want(bytes.begin(), bytes.begin() + ptrdiff_t(kept));
        expectHolds(file, want);
        EXPECT_EQ(space.diskBytes(), kept);
        ASSERT_TRUE(file.append(bytes).ok());
        want.insert(want.end(), bytes.begin(), bytes.end());
        expectHolds(file, want);
        ASSERT_TRUE(file.sync().ok());
        expectHolds(file, want);
    }
    TempSpace space(place(), 1 << 30);
    ASSERT_TRUE(space.folder().take().ok());
    TempFile shorter(space, "pages1.spill"), missing(space, "pages2.spill");
    for (TempFile* file : {&shorter, &missing}) {
        const auto result = file->reopen(800000);
        ASSERT_FALSE(result.ok());
        EXPECT_EQ(result.error().code, ErrorCode::InvalidInput);
        EXPECT_NE(result.error().line().find("from the start"), std::string::npos) << result.error().line();
    }
}

TEST_F(Temp, OneBuildAtATime) {
    TempSpace first(place(), 0);
    ASSERT_TRUE(first.folder().take().ok());
    ASSERT_TRUE(first.folder().take().ok()) << "it has it already";
    {
        TempSpace second(place(), 0);
        const auto refused = second.folder().take();
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().code, ErrorCode::Io);
        EXPECT_NE(refused.error().line().find("another build"), std::string::npos) << refused.error().line();
        // Nor by writing there.
        TempFile file(second, "pages1.spill");
        EXPECT_FALSE(file.append(test::randomBytes(10, 1)).ok());
        second.folder().remove();
        EXPECT_TRUE(fs::exists(place()));
    }
    first.folder().remove();
    EXPECT_FALSE(fs::exists(place()));
    TempSpace third(place(), 0);
    EXPECT_TRUE(third.folder().take().ok());
    EXPECT_TRUE(first.folder().take().ok() == false);
}

TEST_F(Temp, PlacesThatCannotBe) {
    std::ofstream(folder_ / "file") << "x";
    TempSpace space(folder_ / "file" / "temp", 0);
    TempFile file(space, "pages1.spill");
    const auto result = file.append(test::randomBytes(10, 1));
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::Io);
    EXPECT_NE(result.error().line().find("temporary folder"), std::string::npos) << result.error().line();
}

}  // namespace
}  // namespace vcp
