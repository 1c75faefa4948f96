// Directories that come in parts: what a first view reads does not depend on the file's size, what a view settles on
// does not depend on what is known, and what lies is found.
#include <algorithm>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "streaming/page_loader.h"
#include "streaming/page_source.h"
#include "streaming/residency_policy.h"
#include "tests/support/directory_files.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

constexpr uint64_t kLead = kDirectoryOffset + kBlockBytes;  // one block

struct Scan {
    std::shared_ptr<test::CountedFile> file;
    std::shared_ptr<const Dataset> whole;

    [[nodiscard]] std::shared_ptr<const Dataset> start() const {
        return std::make_shared<const Dataset>(readDatasetStart(*file, kLead).value());
    }
};

/// `lastBytes`: of the last page, which few views want.
Scan scanOf(uint64_t seed, uint32_t levels = 6, uint32_t lastBytes = 1024) {
    Dataset tree = test::randomTree(seed, levels, 0.5, 2 * 16384);
    tree.pages[tree.pages.size() - 1].pageBytes = lastBytes;
    Scan scan{std::make_shared<test::CountedFile>(test::directoryFile(tree)), nullptr};
    const auto whole = readDataset(*scan.file);
    EXPECT_TRUE(whole) << whole.error().line();
    scan.whole = std::make_shared<const Dataset>(*whole);
    return scan;
}

struct Settled {
    DrawableCut cut;
    uint64_t blocks = 0, problems = 0;
};

/// Places pages unread, in any order; blocks come from the file.
Settled settle(const std::shared_ptr<const Dataset>& dataset, const test::CountedFile& file, const SelectionView& view,
               uint64_t budget, uint64_t seed, uint64_t chunkBytes = uint64_t{1} << 40) {
    const auto reader = std::shared_ptr<const ByteReader>(&file, [](const ByteReader*) {});
    const FilePageSource source(reader, dataset);
    const bool colour = dataset->hasColour();
    const PooledDataset pooled{dataset, colour};
    ResidencyPolicy policy({&pooled, 1}, poolShapeFor({&pooled, 1}, budget, chunkBytes));
    std::mt19937_64 random(seed);
    Settled settled;
    std::vector<Wish> wishes;
    for (int round = 0; round < 3000; ++round) {
        std::shuffle(wishes.begin(), wishes.end(), random);
        if (wishes.size() > 5) wishes.resize(5);
        std::vector<uint64_t> pages;
        for (const Wish& wish : wishes) {
            if (wish.request.isPage())
                pages.push_back(wish.request.number);
            else if (source.read(wish.request, colour))
                ++settled.blocks;
            else if (policy.giveUp(wish.request))
                ++settled.problems;
        }
        policy.look(test::only(view), round);
        for (const uint64_t page : pages) policy.place(page);
        const PolicyOutcome outcome = policy.finish();
        for (const Wish& wish : outcome.wishes)
            EXPECT_TRUE(!wish.request.isPage() || dataset->pages.knows(wish.request.number));
        wishes = outcome.wishes;
        settled.cut = outcome.cuts[0];
        EXPECT_EQ(outcome.cuts[0].complete, outcome.missing[0] == 0);
        if (settled.cut.complete && round > 1) return settled;
    }
    ADD_FAILURE() << "does not settle";
    return settled;
}

TEST(DirectoryParts, AFirstViewReadsTheSameWhateverTheFilesSize) {
    std::set<uint64_t> read;
    for (const uint32_t levels : {6u, 7u}) {
        const Scan scan = scanOf(3, levels);
        ASSERT_GT(scan.whole->pages.blocks() * kBlockBytes, wholeDirectoryBytes(kLead));
        scan.file->reads = scan.file->bytesRead = 0;
        const auto start = scan.start();
        EXPECT_TRUE(start->pages.knows(0));
        EXPECT_FALSE(start->pages.knows(start->pages.size() - 1));
        EXPECT_EQ(start->pages.blocksKnown(), 1u);
        EXPECT_EQ(scan.file->reads, 3u);
        read.insert(scan.file->bytesRead);
    }
    EXPECT_EQ(read, std::set<uint64_t>{kLead + sizeof(CommitRecord)});
    // A small directory is read as a whole.
    const Scan small = scanOf(3, 3);
    EXPECT_EQ(small.start()->pages.blocksKnown(), small.whole->pages.blocks());
}

TEST(DirectoryParts, SettlesOnTheSamePagesAndReadsNoMoreBlocksThanItNeeds) {
    int relaxed = 0, partly = 0;
    for (uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(seed);
        const Scan scan = scanOf(seed % 3);
        ASSERT_GT(scan.whole->pages.blocks() * kBlockBytes, wholeDirectoryBytes(kLead));
        std::mt19937_64 random(seed);
        const SelectionView view = test::randomView(random, 0.2 + double(random() % 30) / 10);
        const uint64_t budget = (4 + random() % 600) * kPoolUnitBytes;
        const Settled whole = settle(scan.whole, *scan.file, view, budget, seed);
        const auto start = scan.start();
        const Settled parts = settle(start, *scan.file, view, budget, seed + 1);
        EXPECT_EQ(parts.cut.cut, whole.cut.cut);
        EXPECT_EQ(parts.cut.isRelaxed, whole.cut.isRelaxed);
        EXPECT_EQ(parts.cut.errorPixels, whole.cut.errorPixels);
        EXPECT_EQ(whole.blocks, 0u);
        EXPECT_EQ(parts.blocks + 1, start->pages.blocksKnown()) << "a block was read twice";
        relaxed += whole.cut.isRelaxed ? 1 : 0;
        partly += start->pages.blocksKnown() < start->pages.blocks() ? 1 : 0;
    }
    EXPECT_GT(relaxed, 3);
    EXPECT_LT(relaxed, 27);
    EXPECT_GT(partly, 15);
}

TEST(DirectoryParts, SettlesOnTheSamePagesInAPoolOfSeveralChunks) {
    constexpr uint64_t kChunk = 4 << 20;  // room for a page of 128 KiB is left in each
    int relaxed = 0;
    for (uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(seed);
        const Scan scan = scanOf(seed % 3, 6, 48 << 10);
        std::mt19937_64 random(seed);
        const SelectionView view = test::randomView(random, 0.2);
        const uint64_t budget = 2 * kChunk + random() % (2 * kChunk);
        const Settled whole = settle(scan.whole, *scan.file, view, budget, seed, kChunk);
        EXPECT_EQ(settle(scan.start(), *scan.file, view, budget, seed + 1, kChunk).cut.cut, whole.cut.cut);
        relaxed += whole.cut.isRelaxed ? 1 : 0;
    }
    EXPECT_GT(relaxed, 3);
}

TEST(DirectoryParts, AMovingViewAsksForBlocksOfWhatComesLater) {
    const Scan scan = scanOf(1);
    std::mt19937_64 random(5);
    int now = 0, ahead = 0;
    for (int i = 0; i < 10; ++i) {
        const auto start = scan.start();
        const PooledDataset pooled{start, start->hasColour()};
        ResidencyPolicy policy({&pooled, 1}, poolShapeFor({&pooled, 1}, uint64_t{1} << 30, uint64_t{1} << 40));
        SelectionView view = test::randomView(random, 0.5);
        const auto blocksWished = [&](double seconds, bool urgent) {
            policy.look(test::only(view), seconds);
            const auto wishes = policy.finish().wishes;
            return std::count_if(wishes.begin(), wishes.end(), [&](const Wish& wish) {
                return !wish.request.isPage() && (wish.priority > 1e6) == urgent;
            });
        };
        blocksWished(0, true);
        now += int(blocksWished(0.1, true));
        EXPECT_EQ(blocksWished(0.2, false), 0) << "a still view looks at nothing ahead";
        view.eye *= 0.9;
        ahead += int(blocksWished(0.3, false));
    }
    EXPECT_GT(now, 0);
    EXPECT_GT(ahead, 0);
}

TEST(DirectoryParts, ABrokenBlockIsReportedOnceAndDrawnFromItsParents) {
    const Scan scan = scanOf(1);
    const auto start = scan.start();
    SelectionView all;
    all.eye = {0.5, 0.5, -1};
    all.pixelsPerUnit = 1000;
    all.errorPixels = 1e-6;
    for (glm::dvec4& plane : all.planes) plane = {0, 0, 0, 1};
    const uint64_t last = start->pages.blocks() - 1;
    scan.file->bytes[blockOffset(last) + 100] ^= std::byte{4};
    const Settled settled = settle(start, *scan.file, all, uint64_t{1} << 40, 1);
    EXPECT_EQ(settled.problems, 1u);
    EXPECT_EQ(start->pages.blocksKnown(), start->pages.blocks() - 1);
    EXPECT_TRUE(std::none_of(settled.cut.cut.begin(), settled.cut.cut.end(),
                             [&](uint64_t page) { return page / kEntriesPerBlock == last; }));
    EXPECT_FALSE(settled.cut.cut.empty());
}

TEST(DirectoryParts, TheLoaderReadsBlocksTogetherAndTriesAgain) {
    const Scan scan = scanOf(2);
    const auto start = scan.start();
    scan.file->bytes[blockOffset(5) + 9] ^= std::byte{1};
    scan.file->reads = 0;
    PageLoader loader(
        std::make_shared<FilePageSource>(scan.file, start),
        {.threads = {1},
         .retry = {.attempts = 3, .damagedAttempts = 3, .firstDelaySeconds = 0.001, .longestDelaySeconds = 0.001}});
    loader.request({{Request::directoryBlock(2), 1},
                    {Request::directoryBlock(3), 1},
                    {Request::directoryBlock(4), 1},
                    {Request::directoryBlock(5), 1}});
    std::vector<Loaded> came;
    while (loader.pending() > 0) {
        loader.waitForPage(std::chrono::milliseconds(1000));
        for (Loaded& page : loader.collect()) came.push_back(std::move(page));
    }
    ASSERT_EQ(came.size(), 4u);
    for (const Loaded& block : came) EXPECT_EQ(block.bytes.ok(), block.request != Request::directoryBlock(5));
    EXPECT_NE(came.back().bytes.error().line().find("directory block 5"), std::string::npos)
        << came.back().bytes.error().line();
    EXPECT_EQ(scan.file->reads, 3u) << "four blocks together, then one twice more";
    EXPECT_EQ(loader.stats().heldBytes, 0u);
    for (const uint64_t block : {2u, 3u, 4u}) EXPECT_TRUE(start->pages.knowsBlock(block));
    EXPECT_FALSE(start->pages.knowsBlock(5));
}

/// Changes entries behind valid hashes, then takes all blocks in, in an order by the seed; the first error.
Result<void> admitAll(const std::vector<std::byte>& bytes, uint64_t seed) {
    const test::CountedFile file(bytes);
    const auto start = readDatasetStart(file, kLead);
    if (!start) return start.error();
    std::vector<uint64_t> blocks(start->pages.blocks());
    for (uint64_t b = 0; b < blocks.size(); ++b) blocks[b] = b;
    std::mt19937_64 random(seed);
    std::shuffle(blocks.begin(), blocks.end(), random);
    for (const uint64_t b : blocks)
        VCP_TRY(admitBlock(*start, file.name(), b, std::span(file.bytes).subspan(blockOffset(b), kBlockBytes)));
    for (uint64_t page = 0; page < start->pages.size(); ++page) EXPECT_TRUE(start->pages.knows(page));
    return {};
}

TEST(DirectoryParts, WhatWasRefusedIsNotKept) {
    const Scan scan = scanOf(4);
    const auto start = scan.start();
    const uint64_t block = start->pages.blocks() - 1, page = block * kEntriesPerBlock;
    PageEntry lie = scan.whole->pages[page];
    lie.firstChild = UINT32_MAX;
    lie.childMask = 0xff;
    std::memcpy(&scan.file->bytes[blockOffset(block)], &lie, sizeof lie);
    test::sealFile(scan.file->bytes);
    EXPECT_FALSE(
        admitBlock(*start, "lie.vcp", block, std::span(scan.file->bytes).subspan(blockOffset(block), kBlockBytes)));
    for (uint64_t i = page; i < start->pages.size(); ++i) EXPECT_EQ(start->pages[i].childMask, 0) << i;
}

TEST(DirectoryParts, LiesBehindValidHashesAreFoundInAnyOrder) {
    const Scan scan = scanOf(4);
    const Dataset& d = *scan.whole;
    uint64_t parent = d.header.level[3].firstEntry;  // with children in a block of its own
    while (d.pages[parent].childMask == 0) ++parent;
    const uint64_t child = d.pages[parent].firstChild;
    using Change = void (*)(PageEntry&);
    const std::tuple<const char*, uint64_t, Change> lies[] = {
        {"wrong level", child, [](PageEntry& e) { e.level = 1; }},
        {"do not match", child, [](PageEntry& e) { e.morton ^= 1; }},
        {"wrong child pages", parent, [](PageEntry& e) { e.firstChild = 0; }},
        {"wrong child pages", parent, [](PageEntry& e) { e.firstChild = UINT32_MAX; }},
        {"child pages", parent, [](PageEntry& e) { e.firstChild += 1; }},
        {"outside the file", child, [](PageEntry& e) { e.offset = 256; }},
        {"outside the file", child, [](PageEntry& e) { e.storedBytes = 0x80000000; }},
        {"page size out of range", child, [](PageEntry& e) { e.pageBytes = 7; }},
        {"certified error", child, [](PageEntry& e) { e.certifiedError = -1; }},
    };
    for (const auto& [words, page, change] : lies)
        for (uint64_t seed = 0; seed < 4; ++seed) {
            std::vector<std::byte> bytes = scan.file->bytes;
            PageEntry entry = d.pages[page];
            change(entry);
            std::memcpy(&bytes[blockOffset(page / kEntriesPerBlock) + page % kEntriesPerBlock * sizeof entry], &entry,
                        sizeof entry);
            test::sealFile(bytes);
            const auto admitted = admitAll(bytes, seed);
            ASSERT_FALSE(admitted) << words;
            EXPECT_EQ(admitted.error().code, ErrorCode::InvalidInput);
            EXPECT_NE(admitted.error().line().find(words), std::string::npos) << admitted.error().line();
        }
    for (uint64_t seed = 0; seed < 4; ++seed) EXPECT_TRUE(admitAll(scan.file->bytes, seed));
}

}  // namespace
}  // namespace vcp
