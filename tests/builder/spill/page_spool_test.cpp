// Finished pages on temporary files: what is read is what was appended, or damage is named.
#include "builder/spill/page_spool.h"

#include <deque>
#include <fstream>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kPages = 40;

std::vector<std::byte> bytesOf(uint64_t seed, size_t count) {
    std::mt19937_64 random(seed);
    std::vector<std::byte> bytes(count);
    for (std::byte& b : bytes) b = std::byte(random());
    return bytes;
}

StoredPage pageOf(uint64_t number) {
    return {bytesOf(number, 50 + number * 3), bytesOf(~number, number % 3 == 0 ? 0 : 20 + number),
            uint32_t(1000 + number), uint32_t(number % 3 == 0 ? 0 : 500 + number)};
}

class Pages : public ::testing::Test {
protected:
    static void fill(PageSpool& spool) {
        for (uint64_t i = 0; i < kPages; ++i) {
            PageEntry entry;
            entry.morton = i * 7;
            entry.level = 2;
            entry.leaves = uint32_t(i + 1);
            ASSERT_TRUE(spool.append(entry, pageOf(i)).ok());
        }
    }

    /// Reads all pages. The first error; where there is none, all are as they were.
    static Result<void> readAll(const PageSpool& spool) {
        EXPECT_EQ(spool.entries().size(), kPages);
        Result<void> result;
        for (uint64_t i = 0; i < spool.entries().size(); ++i) {
            const PageEntry& entry = spool.entries()[i];
            EXPECT_EQ(entry.morton, i * 7);
            EXPECT_EQ(entry.leaves, i + 1);
            const auto page = spool.read(entry);
            if (!page && result) result = page.error();
            if (!page) continue;
            const StoredPage want = pageOf(i);
            EXPECT_TRUE(page->geometry == want.geometry && page->colour == want.colour) << i;
            EXPECT_EQ(page->geometryBytes, want.geometryBytes);
            EXPECT_EQ(page->colourBytes, want.colourBytes);
        }
        return result;
    }

    void flip(const std::string& name, uint64_t bit) const {
        std::fstream file(temp() / name, std::ios::in | std::ios::out | std::ios::binary);
        file.seekg(std::streamoff(bit / 8));
        const int byte = file.get();
        file.seekp(std::streamoff(bit / 8));
        file.put(char(byte ^ 1 << bit % 8));
    }

    fs::path temp() const { return folder_ / "out.vcp.build"; }

    TestFolder folder_{"vcp_page_spool_test"};
};

TEST_F(Pages, ComeBackInTheSameRun) {
    for (const uint64_t memory : {uint64_t{0}, uint64_t{1} << 30}) {
        TempSpace space(temp(), memory);
        PageSpool spool(space, 2);
        fill(spool);
        const auto read = readAll(spool);
        EXPECT_TRUE(read.ok()) << read.error().line();
    }
}

TEST_F(Pages, DamageInTheSameRunIsNamed) {
    TempSpace space(temp(), 0);
    PageSpool spool(space, 2);
    fill(spool);
    for (uint64_t bit = 5; bit < spool.bytes() * 8; bit += 97) {
        flip("pages2.spill", bit);
        const auto read = readAll(spool);
        flip("pages2.spill", bit);
        ASSERT_FALSE(read.ok()) << "bit " << bit;
        EXPECT_EQ(read.error().code, ErrorCode::InvalidInput);
        EXPECT_NE(read.error().line().find("pages2.spill: byte "), std::string::npos) << read.error().line();
        EXPECT_NE(read.error().line().find("build again from the start"), std::string::npos) << read.error().line();
    }
    EXPECT_TRUE(readAll(spool).ok());
}

TEST_F(Pages, DamageAfterAnInterruptionIsNamed) {
    uint64_t bytes = 0;
    {
        TempSpace space(temp(), 1 << 30);
        PageSpool spool(space, 2);
        fill(spool);
        ASSERT_TRUE(spool.sync().ok());
        bytes = spool.bytes();
    }
    const auto again = [&](uint64_t itsBytes, uint64_t itsEntries) {
        TempSpace space(temp(), 0);
        EXPECT_TRUE(space.folder().take().ok());
        PageSpool spool(space, 2);
        const auto reopened = spool.reopen(itsBytes, itsEntries);
        return reopened ? readAll(spool) : reopened;
    };
    EXPECT_TRUE(again(bytes, kPages).ok());
    const uint64_t entryBits = fs::file_size(temp() / "entries2.spill") * 8;
    for (uint64_t i = 0; i < 600; ++i) {
        const bool isEntry = i % 2 == 0;
        const uint64_t bit = std::mt19937_64(i)() % (isEntry ? entryBits : bytes * 8);
        const std::string name = isEntry ? "entries2.spill" : "pages2.spill";
        flip(name, bit);
        const auto read = again(bytes, kPages);
        flip(name, bit);
        ASSERT_FALSE(read.ok()) << name << " bit " << bit;
        EXPECT_NE(read.error().line().find(name + ": byte "), std::string::npos) << read.error().line();
    }
    EXPECT_TRUE(again(bytes, kPages).ok());
    // Numbers that do not fit each other, and those that would need all memory.
    for (const uint64_t entries :
         {uint64_t{0}, kPages - 1, kPages + 1, uint64_t{1} << 40, ~uint64_t{0}, ~uint64_t{0} / 88 + 1})
        EXPECT_FALSE(again(bytes, entries).ok()) << entries;
    for (const uint64_t other : {bytes + 1, uint64_t{1} << 50, ~uint64_t{0}})
        EXPECT_FALSE(again(other, kPages).ok()) << other;
    EXPECT_FALSE(again(bytes - 1, kPages).ok());
}

TEST_F(Pages, OfSeveralSpoolsAreReadAsOne) {
    std::deque<TempSpace> spaces;
    std::deque<PageSpool> spools;
    // Every third page, each in a folder of its own, and a spool without any.
    for (uint64_t k = 0; k < 4; ++k) {
        TempSpace space(folder_ / std::to_string(k), 0);
        PageSpool spool(space, 2);
        for (uint64_t i = k; k < 3 && i < kPages; i += 3)
            ASSERT_TRUE(spool.append({.morton = i * 7, .leaves = uint32_t(i + 1)}, pageOf(i)).ok());
        ASSERT_TRUE(spool.sync().ok());
        spaces.emplace_back(folder_ / std::to_string(k), 0, FolderUse::Read);
        ASSERT_TRUE(spaces.back().folder().take().ok());
        spools.emplace_back(spaces.back(), 2);
        ASSERT_TRUE(spools.back().reopen(spool.bytes(), spool.entries().size()).ok());
        spools.back().rest();
    }
    JoinedSpools all;
    for (const size_t k : {0, 3, 1, 2}) all.add(spools[k]);
    all.sortEntries();
    ASSERT_EQ(all.entries().size(), kPages);
    for (int again = 0; again < 2; ++again) {
        ASSERT_TRUE(all.wake().ok());
        for (uint64_t i = 0; i < kPages; ++i) {
            const auto page = all.read(all.entries()[i]);
            ASSERT_TRUE(page.ok()) << page.error().line();
            EXPECT_EQ(all.entries()[i].morton, i * 7);
            EXPECT_TRUE(page->geometry == pageOf(i).geometry && page->colour == pageOf(i).colour) << i;
        }
        all.rest();
    }
    // Cut off while nobody looked.
    const fs::path file = folder_ / "1" / spools[1].pagesFile();
    fs::resize_file(file, fs::file_size(file) - 1);
    const auto cut = all.wake();
    ASSERT_FALSE(cut.ok());
    EXPECT_EQ(cut.error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(cut.error().file, file.string());
}

}  // namespace
}  // namespace vcp
