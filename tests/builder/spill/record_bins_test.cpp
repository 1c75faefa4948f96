// Bins of records: what goes in comes out, also after an interruption; damage is noticed.
#include "builder/spill/record_bins.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <random>
#include <thread>

#include <gtest/gtest.h>
#include <malloc.h>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

struct Record {
    int32_t position[3];
    float value;
    uint32_t bits;

    bool operator<(const Record& b) const { return std::memcmp(this, &b, sizeof b) < 0; }
    bool operator==(const Record& b) const { return std::memcmp(this, &b, sizeof b) == 0; }
};

/// Smooth ones, as a mesh has them, and noise with all bits.
Record randomRecord(std::mt19937_64& random, uint64_t i) {
    Record r{};
    if (random() % 4 == 0) {
        const uint64_t words[3] = {random(), random(), random()};
        std::memcpy(&r, words, sizeof r);
    } else {
        r = {{int32_t(i), -int32_t(i * 3), int32_t(random() % 100)}, 0.5f, uint32_t(i)};
    }
    return r;
}

class Bins : public ::testing::Test {
protected:
    using All = std::vector<std::vector<Record>>;

    static All fill(RecordBins<Record>& bins, size_t count, size_t records, uint64_t seed, All all = {}) {
        all.resize(count);
        std::mt19937_64 random(seed);
        for (size_t i = 0; i < records;) {
            const size_t bin = random() % count, run = 1 + random() % 200;
            std::vector<Record> batch;
            for (size_t k = 0; k < run; ++k) batch.push_back(randomRecord(random, i + k));
            EXPECT_TRUE(bins.append(bin, batch).ok());
            all[bin].insert(all[bin].end(), batch.begin(), batch.end());
            i += run;
        }
        return all;
    }

    static void expectHolds(const RecordBins<Record>& bins, const All& all) {
        uint64_t total = 0;
        for (size_t bin = 0; bin < all.size(); ++bin) {
            ASSERT_EQ(bins.count(bin), all[bin].size()) << bin;
            const auto loaded = bins.load(bin);
            ASSERT_TRUE(loaded.ok()) << loaded.error().line();
            ASSERT_TRUE(*loaded == all[bin]) << bin;
            std::vector<Record> byBlock;
            const auto blocks = bins.blocks(bin);
            ASSERT_TRUE(blocks.ok()) << blocks.error().line();
            for (const RawBins::Block& block : *blocks) {
                const auto part = bins.read(block);
                ASSERT_TRUE(part.ok());
                byBlock.insert(byBlock.end(), part->begin(), part->end());
            }
            ASSERT_TRUE(byBlock == all[bin]) << bin;
            total += all[bin].size();
        }
        EXPECT_EQ(bins.raw().total(), total);
    }

    TestFolder folder_{"vcp_record_bins_test"};
};

TEST_F(Bins, WhatGoesInComesOut) {
    for (const size_t count : {size_t{1}, size_t{7}, size_t{300}})
        for (const uint64_t memory : {uint64_t{0}, uint64_t{1} << 30}) {
            TempSpace space(folder_ / "temp", memory);
            RecordBins<Record> bins(space, "bins", count, 1 << 20);
            All all = fill(bins, count, 40000, count + memory);
            ASSERT_TRUE(bins.raw().flush().ok());
            expectHolds(bins, all);
            // After a flush more may follow.
            all = fill(bins, count, 10000, 77, std::move(all));
            ASSERT_TRUE(bins.raw().flush().ok());
            expectHolds(bins, all);
            EXPECT_EQ(fs::exists(folder_ / "temp"), memory == 0);
            bins.raw().remove();
            EXPECT_EQ(bins.raw().total(), 0u);
            space.folder().remove();
        }
}

TEST_F(Bins, MoreBinsThanExpected) {
    TempSpace space(folder_ / "temp", 1 << 30);
    RecordBins<Record> bins(space, "bins", 2, 1 << 16);
    const All all = fill(bins, 40, 5000, 3);
    ASSERT_TRUE(bins.raw().flush().ok());
    expectHolds(bins, all);
    EXPECT_EQ(bins.count(1000), 0u);
    EXPECT_TRUE(bins.load(1000)->empty());
}

TEST_F(Bins, BlocksAreReadInTheOrderOfTheFile) {
    TempSpace space(folder_ / "temp", 0);
    RecordBins<Record> bins(space, "bins", 4, 1 << 16);
    All all = fill(bins, 4, 30000, 9);
    ASSERT_TRUE(bins.raw().flush().ok());
    std::vector<Record> have, want;
    uint64_t at = 0;
    while (at < bins.raw().bytes()) {
        const auto block = bins.raw().blockAt(at);
        ASSERT_TRUE(block.ok()) << block.error().line();
        const auto part = bins.read(*block);
        ASSERT_TRUE(part.ok());
        have.insert(have.end(), part->begin(), part->end());
        at = block->end;
    }
    EXPECT_EQ(at, bins.raw().bytes());
    EXPECT_FALSE(bins.raw().blockAt(at).ok());
    EXPECT_FALSE(bins.raw().blockAt(1).ok());
    for (const auto& each : all) want.insert(want.end(), each.begin(), each.end());
    std::sort(have.begin(), have.end());
    std::sort(want.begin(), want.end());
    EXPECT_TRUE(have == want);
}

TEST_F(Bins, ManyBinsStayWithinTheirMemory) {
    // A billion triangles under 150 MB are some 8,000 bins; here are more. Records come in runs of a few, in bins at
    // random, which is the worst order.
    constexpr size_t kBins = 100000, kRecords = 500000;
    constexpr uint64_t kBufferBytes = 12 << 20;
    struct Parcel {
        uint32_t word[10];
    };
    const auto parcel = [](size_t bin, size_t i) {
        return Parcel{{uint32_t(bin), uint32_t(i), 3, uint32_t(i / 7), uint32_t(bin * 5), 6, 7, 8, 9, 10}};
    };
    TempSpace space(folder_ / "temp", 0);
    std::vector<uint32_t> next(kBins, 0);
    const uint64_t before = mallinfo2().uordblks;
    uint64_t most = 0;
    RecordBins<Parcel> bins(space, "bins", kBins, kBufferBytes);
    std::mt19937_64 random(3);
    for (size_t i = 0, step = 0; i < kRecords; ++step) {
        const size_t bin = random() % kBins;
        std::vector<Parcel> run(1 + random() % 4);
        for (Parcel& each : run) each = parcel(bin, next[bin]++);
        ASSERT_TRUE(bins.append(bin, run).ok());
        i += run.size();
        if (step % 1024 == 0) most = std::max<uint64_t>(most, mallinfo2().uordblks - before);
    }
    EXPECT_LE(most, kBufferBytes * 11 / 10);
    ASSERT_TRUE(bins.raw().flush().ok());
    // Blocks are not crumbs: a header is less than a record.
    EXPECT_LT(bins.raw().bytes(), kRecords * sizeof(Parcel));
    uint64_t total = 0;
    for (size_t bin = 0; bin < kBins; bin += 97) {
        const auto loaded = bins.load(bin);
        ASSERT_TRUE(loaded.ok()) << loaded.error().line();
        ASSERT_EQ(loaded->size(), next[bin]);
        for (size_t i = 0; i < loaded->size(); ++i) {
            const Parcel want = parcel(bin, i);
            ASSERT_EQ(std::memcmp(&(*loaded)[i], &want, sizeof want), 0) << bin;
        }
        total += loaded->size();
    }
    EXPECT_GT(total, 0u);
}

TEST_F(Bins, ThreadsAppendToManyBins) {
    // Blocks of a bin that different threads write are chained whole.
    constexpr size_t kBins = 3000, kThreads = 4;
    TempSpace space(folder_ / "temp", 0);
    RecordBins<Record> bins(space, "bins", kBins, 1 << 18);
    std::vector<All> parts(kThreads);
    std::vector<std::thread> threads;
    for (size_t i = 0; i < kThreads; ++i) threads.emplace_back([&, i] { parts[i] = fill(bins, kBins, 60000, 70 + i); });
    for (std::thread& thread : threads) thread.join();
    ASSERT_TRUE(bins.raw().flush().ok());
    for (size_t bin = 0; bin < kBins; ++bin) {
        std::vector<Record> want;
        for (const All& part : parts) want.insert(want.end(), part[bin].begin(), part[bin].end());
        auto have = bins.load(bin);
        ASSERT_TRUE(have.ok()) << have.error().line();
        std::sort(want.begin(), want.end());
        std::sort(have->begin(), have->end());
        ASSERT_TRUE(*have == want) << bin;
    }
}

TEST_F(Bins, ThreadsAppendTogether) {
    TempSpace space(folder_ / "temp", 0);
    RecordBins<Record> bins(space, "bins", 5, 1 << 18);
    std::vector<All> parts(4);
    std::vector<std::thread> threads;
    for (size_t i = 0; i < parts.size(); ++i) threads.emplace_back([&, i] { parts[i] = fill(bins, 5, 20000, 50 + i); });
    for (std::thread& thread : threads) thread.join();
    ASSERT_TRUE(bins.raw().flush().ok());
    for (size_t bin = 0; bin < 5; ++bin) {
        std::vector<Record> want;
        for (const All& part : parts) want.insert(want.end(), part[bin].begin(), part[bin].end());
        auto have = bins.load(bin);
        ASSERT_TRUE(have.ok());
        std::sort(want.begin(), want.end());
        std::sort(have->begin(), have->end());
        EXPECT_TRUE(*have == want);
    }
}

TEST_F(Bins, GoOnAfterAnInterruption) {
    All all;
    uint64_t recorded = 0;
    {
        TempSpace space(folder_ / "temp", 1 << 30);
        RecordBins<Record> bins(space, "bins", 6, 1 << 18);
        all = fill(bins, 6, 20000, 1);
        ASSERT_TRUE(bins.raw().sync().ok());
        recorded = bins.raw().bytes();
        fill(bins, 6, 20000, 2);  // is not recorded, whether or not it reached the disk
        ASSERT_TRUE(bins.raw().sync().ok());
    }
    TempSpace space(folder_ / "temp", 0);
    ASSERT_TRUE(space.folder().take().ok());
    // Other memory, other blocks.
    RecordBins<Record> bins(space, "bins", 6, 1 << 22);
    ASSERT_TRUE(bins.raw().reopen(recorded).ok());
    expectHolds(bins, all);
    all = fill(bins, 6, 5000, 3, std::move(all));
    ASSERT_TRUE(bins.raw().flush().ok());
    expectHolds(bins, all);
}

TEST_F(Bins, SmoothRecordsAreSmallWhereMemoryIsShort) {
    std::vector<Record> records(400000);
    for (size_t i = 0; i < records.size(); ++i)
        records[i] = {{int32_t(i * 5), 1000000 - int32_t(i), 7}, 1, uint32_t(i / 3)};
    const uint64_t bytes = records.size() * sizeof(Record);
    for (const uint64_t memory : {uint64_t{0}, bytes, 4 * bytes}) {
        TempSpace space(folder_ / "temp", memory);
        RecordBins<Record> bins(space, "bins", 1, 1 << 20);
        ASSERT_TRUE(bins.append(0, records).ok());
        ASSERT_TRUE(bins.raw().flush().ok());
        // What half of the memory holds is left as it is.
        const uint64_t plain = std::min(memory / 2, bytes);
        EXPECT_LT(bins.raw().bytes(), plain + (bytes - plain) / 4 + bytes / 50) << memory;
        EXPECT_GE(bins.raw().bytes(), plain * 9 / 10) << memory;
        const auto back = bins.load(0);
        ASSERT_TRUE(back.ok()) << back.error().line();
        EXPECT_EQ(std::memcmp(back->data(), records.data(), bytes), 0) << memory;
    }
}

TEST_F(Bins, EveryDamageIsNoticed) {
    const fs::path file = folder_ / "temp/bins.spill";
    All all;
    {
        TempSpace space(folder_ / "temp", 0);
        RecordBins<Record> bins(space, "bins", 3, 1 << 14);
        all = fill(bins, 3, 1500, 1);
        ASSERT_TRUE(bins.raw().sync().ok());
    }
    const std::string intact = contentOf(file);
    ASSERT_GT(intact.size(), 1000u);
    std::mt19937_64 random(5);
    for (int i = 0; i < 400; ++i) {
        const size_t at = i < 60 ? size_t(i) : random() % intact.size();
        std::string damaged = intact;
        damaged[at] = char(damaged[at] ^ 1 << random() % 8);
        std::ofstream(file, std::ios::binary) << damaged;
        TempSpace space(folder_ / "temp", 0);
        ASSERT_TRUE(space.folder().take().ok());
        RecordBins<Record> bins(space, "bins", 3, 1 << 14);
        Result<void> result = bins.raw().reopen(intact.size());
        for (size_t bin = 0; bin < bins.raw().bins() && result; ++bin)
            if (const auto loaded = bins.load(bin); !loaded) result = loaded.error();
        ASSERT_FALSE(result.ok()) << "byte " << at << " of " << intact.size();
        EXPECT_EQ(result.error().code, ErrorCode::InvalidInput);
        EXPECT_NE(result.error().line().find("bins.spill: byte "), std::string::npos) << result.error().line();
        EXPECT_NE(result.error().line().find("temporary data came back damaged"), std::string::npos)
            << result.error().line();
    }
}

TEST_F(Bins, TheIndexIsOfIntactHeadersOnly) {
    // A block that claims to be of a bin that is done would be lost without a word.
    const fs::path file = folder_ / "temp/bins.spill";
    {
        TempSpace space(folder_ / "temp", 0);
        RecordBins<Record> bins(space, "bins", 3, 1 << 14);
        fill(bins, 3, 100, 1);
        ASSERT_TRUE(bins.raw().sync().ok());
    }
    const std::string intact = contentOf(file);
    for (size_t bit = 0; bit < 40 * 8; ++bit) {
        std::string damaged = intact;
        damaged[bit / 8] = char(damaged[bit / 8] ^ 1 << bit % 8);
        std::ofstream(file, std::ios::binary) << damaged;
        TempSpace space(folder_ / "temp", 0);
        ASSERT_TRUE(space.folder().take().ok());
        RecordBins<Record> bins(space, "bins", 3, 1 << 14);
        const auto reopened = bins.raw().reopen(intact.size());
        ASSERT_FALSE(reopened.ok()) << "bit " << bit;
        EXPECT_NE(reopened.error().line().find("byte 0: temporary data came back damaged"), std::string::npos)
            << reopened.error().line();
    }
}

}  // namespace
}  // namespace vcp
