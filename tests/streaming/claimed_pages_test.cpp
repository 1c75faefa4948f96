// A server that sends 64 KiB and claims any number of pages: what opening it takes follows from what it sends.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "octree/reference_caster.h"
#include "streaming/page_source.h"
#include "streaming/residency_policy.h"
#include "tests/support/directory_files.h"
#include "tests/support/peak_memory.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

constexpr uint64_t kMany = 30'000'000;
constexpr uint64_t kMost = 64ull << 20;  // bytes that all of it may take, where each page would be 80 and more

/// The first 64 KiB and the commit record are valid; there is nothing between.
class ClaimingFile final : public ByteReader {
public:
    explicit ClaimingFile(uint64_t pages) : head_(kLeadBytes) {
        FileHeader& h = header_;
        h.pages = pages;
        h.log2Cells = 5;
        h.cell = 1;
        // Each level has as many pages as there is room for below the one above.
        for (uint64_t left = pages, room = 1; left > 0; room *= 8) {
            h.level[h.levels++] = {pages - left, std::min(room, left), 0};
            left -= std::min(room, left);
        }
        h.level[0].certifiedError = 1;
        const uint64_t blocks = (pages + kEntriesPerBlock - 1) / kEntriesPerBlock,
                       pagesBegin = (blockOffset(blocks) + 255) / 256 * 256;
        h.fileBytes = pagesBegin + 256 * pages + sizeof(CommitRecord);
        uint32_t level = 0;
        for (uint64_t page = 0; page < (kLeadBytes - kDirectoryOffset) / kBlockBytes * kEntriesPerBlock; ++page) {
            PageEntry e;
            e.offset = pagesBegin + 256 * page;
            e.storedBytes = 16;
            e.pageBytes = 4096;
            while (page >= h.level[level].firstEntry + h.level[level].pages) ++level;
            e.level = uint8_t(level);
            e.morton = page - h.level[level].firstEntry;
            e.childMask = page == 0 ? 0xff : 0;
            e.firstChild = page == 0 ? 1 : 0;
            e.certifiedError = page == 0 ? 1.0f : 0.0f;
            std::memcpy(&head_[blockOffset(page / kEntriesPerBlock) + page % kEntriesPerBlock * sizeof e], &e,
                        sizeof e);
        }
        seal();
    }
    Result<void> read(uint64_t offset, std::span<std::byte> to) const override {
        if (offset + to.size() <= head_.size())
            std::copy_n(head_.begin() + std::ptrdiff_t(offset), to.size(), to.begin());
        else if (offset == size() - sizeof commit_ && to.size() == sizeof commit_)
            std::memcpy(to.data(), &commit_, sizeof commit_);
        else
            return Error{.code = ErrorCode::Io, .message = "does not come", .file = name_, .byte = offset};
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return header_.fileBytes; }
    [[nodiscard]] const std::string& name() const override { return name_; }

private:
    void seal() {
        const std::span all(head_);
        for (uint64_t at = kDirectoryOffset; at < head_.size(); at += kBlockBytes) {
            const uint64_t hash = hashBytes(all.subspan(at, kBlockBytes - 8));
            std::memcpy(&head_[at + kBlockBytes - 8], &hash, sizeof hash);
        }
        std::memcpy(head_.data(), &header_, sizeof header_);
        header_.hash = hashBytes(all.first(kDirectoryOffset));
        std::memcpy(head_.data(), &header_, sizeof header_);
        commit_.fileBytes = header_.fileBytes;
        commit_.headerHash = header_.hash;
        commit_.hash = hashBytes(std::as_bytes(std::span(&commit_, 1)).first(offsetof(CommitRecord, hash)));
    }

    std::vector<std::byte> head_;
    FileHeader header_;
    CommitRecord commit_;
    std::string name_ = "claims.vcp";
};

/// Memory that this process has now.
uint64_t residentBytes() {
    uint64_t all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident * uint64_t(::sysconf(_SC_PAGESIZE));
}

uint64_t grownSince(uint64_t before) {
    const uint64_t now = residentBytes();
    return test::kMemoryIsMeasured && now > before ? now - before : 0;
}

SelectionView viewOfAll() {
    SelectionView all;
    all.eye = {0.5, 0.5, -1};
    all.pixelsPerUnit = 1000;
    for (glm::dvec4& plane : all.planes) plane = {0, 0, 0, 1};
    return all;
}

TEST(ClaimedPages, TheWholeDirectoryTakesWhatCame) {
    const ClaimingFile file(kMany);
    const uint64_t before = residentBytes();
    const auto whole = readDataset(file);
    ASSERT_FALSE(whole);
    EXPECT_NE(whole.error().line().find("does not come"), std::string::npos) << whole.error().line();
    EXPECT_LT(grownSince(before), kMost);
}

TEST(ClaimedPages, TheFirstPartAndWhatViewsMakeOfItTakeWhatCame) {
    const ClaimingFile file(kMany);
    const uint64_t before = residentBytes();
    auto start = readDatasetStart(file);
    ASSERT_TRUE(start) << start.error().line();
    ASSERT_EQ(start->pages.size(), kMany);
    EXPECT_EQ(start->pages.blocksKnown(), 15u);
    const Dataset copy = *start;
    EXPECT_EQ(copy.pages.blocksKnown(), 15u);
    EXPECT_TRUE(copy.pages.knows(700));
    EXPECT_EQ(copy.pages[700].morton, 700u - (1 + 8 + 64 + 512));
    EXPECT_FALSE(copy.pages.knows(kMany - 1));
    const auto dataset = std::make_shared<const Dataset>(*std::move(start));
    ASSERT_LT(grownSince(before), kMost);

    const PooledDataset pooled{dataset, false};
    ResidencyPolicy policy({&pooled, 1}, poolShapeFor({&pooled, 1}, 64 << 20, 16 << 20));
    EXPECT_TRUE(policy.hasRoom());
    SelectionView view = viewOfAll();
    for (int frame = 0; frame < 3; ++frame, view.eye.x += 0.01) {
        policy.look(test::only(view), frame);
        for (const Wish& wish : policy.finish().wishes) policy.place(wish.request.number);
    }
    EXPECT_EQ(policy.pagesResident(), 9u);
    const PageCache cache(nullptr, copy);
    EXPECT_EQ(cache.view(kMany - 1), nullptr);
    EXPECT_TRUE(ReferenceCaster::create(cache, {}));
    EXPECT_LT(grownSince(before), kMost);
}

TEST(ClaimedPages, APageTakesWhatCame) {
    // One page of one level that claims to be stored in 200 MB; the first MB of them never comes.
    Dataset dataset;
    dataset.header.levels = 1;
    dataset.pages.push_back({.offset = uint64_t{1} << 30, .storedBytes = 200'000'000, .pageBytes = 4096});
    struct Counting final : ByteReader {
        Result<void> read(uint64_t, std::span<std::byte> bytes) const override {
            largest = std::max<uint64_t>(largest, bytes.size());
            return Error{.code = ErrorCode::Io, .message = "does not come"};
        }
        [[nodiscard]] uint64_t size() const override { return uint64_t{1} << 40; }
        [[nodiscard]] const std::string& name() const override { return named; }
        mutable uint64_t largest = 0;
        std::string named = "claims.vcp";
    } file;
    EXPECT_FALSE(readPage(file, dataset, 0, false));
    EXPECT_EQ(file.largest, 1u << 20);
}

TEST(ClaimedPages, PiecesMakeTheSameDirectory) {
    // Large enough for several pieces, and for blocks to be copied.
    Dataset tree = test::randomTree(1, 7, 0.7, 256);
    const test::CountedFile file(test::directoryFile(tree));
    ASSERT_GT(tree.pages.blocks() * kBlockBytes, 3u << 20);
    const auto whole = readDataset(file);
    ASSERT_TRUE(whole) << whole.error().line();
    ASSERT_EQ(whole->pages.size(), tree.pages.size());
    EXPECT_EQ(std::memcmp(whole->pages.data(), tree.pages.data(), tree.pages.size() * sizeof(PageEntry)), 0);

    const auto start = readDatasetStart(file);
    ASSERT_TRUE(start) << start.error().line();
    const auto admit = [&](const Dataset& to, uint64_t block) {
        return admitBlock(to, "tree.vcp", block, std::span(file.bytes).subspan(blockOffset(block), kBlockBytes));
    };
    for (uint64_t block = 0; block < start->pages.blocks(); block += 2) ASSERT_TRUE(admit(*start, block));
    const Dataset copy = *start;
    for (uint64_t block = 0; block < copy.pages.blocks(); ++block) ASSERT_TRUE(admit(copy, block));
    EXPECT_EQ(std::memcmp(copy.pages.data(), tree.pages.data(), tree.pages.size() * sizeof(PageEntry)), 0);
}

}  // namespace
}  // namespace vcp
