// Readers that wrap readers (faulty, caching) and pages that are read together.
#include <algorithm>
#include <atomic>
#include <fstream>
#include <random>
#include <thread>

#include "streaming/caching_reader.h"
#include "streaming/faulty_reader.h"
#include "streaming/page_source.h"
#include "streaming/read_ahead.h"
#include "tests/support/image_file.h"
#include "tests/support/test_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

/// Bytes 0, 1, 2, ... whose reads are counted.
class CountingBytes final : public ByteReader {
public:
    explicit CountingBytes(uint64_t size) : size_(size) {}
    static std::byte at(uint64_t offset) { return std::byte(offset * 2654435761u >> 13); }

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        if (offset > size_ || bytes.size() > size_ - offset)
            return Error{.code = ErrorCode::Io, .message = "past the end"};
        for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = at(offset + i);
        ++reads;
        read_ += bytes.size();
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return size_; }
    [[nodiscard]] const std::string& name() const override { return name_; }
    [[nodiscard]] uint64_t bytesRead() const { return read_; }

    mutable std::atomic<uint64_t> reads{0};

private:
    uint64_t size_;
    mutable std::atomic<uint64_t> read_{0};
    std::string name_ = "counting";
};

/// The bytes, or nothing where reading fails.
std::optional<std::vector<std::byte>> bytesAt(const ByteReader& reader, uint64_t offset, size_t size) {
    std::vector<std::byte> bytes(size);
    if (!reader.read(offset, bytes)) return std::nullopt;
    return bytes;
}

bool isRight(const std::vector<std::byte>& bytes, uint64_t offset) {
    for (size_t i = 0; i < bytes.size(); ++i)
        if (bytes[i] != CountingBytes::at(offset + i)) return false;
    return true;
}

TEST(FaultyReader, FaultsFollowFromSeedOffsetAndAttempt) {
    const auto file = std::make_shared<CountingBytes>(100000);
    const Faults faults{.errorRate = 0.2, .corruptRate = 0.1, .seed = 5};
    const FaultyReader a(file, faults), b(file, faults);
    int failed = 0, corrupt = 0;
    std::vector<std::optional<std::vector<std::byte>>> first;
    for (uint64_t i = 0; i < 2000; ++i) {
        first.push_back(bytesAt(a, i % 500 * 100, 100));
        failed += !first.back() ? 1 : 0;
        corrupt += first.back() && !isRight(*first.back(), i % 500 * 100) ? 1 : 0;
    }
    EXPECT_NEAR(failed, 400, 80);
    EXPECT_NEAR(corrupt, 160, 50);
    // Another order of offsets, the same attempts.
    for (uint64_t offset = 500; offset-- > 0;)
        for (uint64_t attempt = 0; attempt < 4; ++attempt)
            EXPECT_EQ(bytesAt(b, offset * 100, 100), first[attempt * 500 + offset]);
    Faults other = faults;
    other.seed = 6;
    const FaultyReader c(file, other);
    int differing = 0;
    for (uint64_t i = 0; i < 500; ++i) differing += bytesAt(c, i * 100, 100) != first[i] ? 1 : 0;
    EXPECT_GT(differing, 50);
}

TEST(FaultyReader, TakesTheTimeItShould) {
    double now = 0;
    std::vector<double> slept;
    const FaultClock clock{[&] { return now; }, [&](double seconds) { slept.push_back(seconds); }};
    const auto file = std::make_shared<CountingBytes>(100000);
    const FaultyReader slow(file, {.latencySeconds = 0.05, .bytesPerSecond = 1000}, clock);
    for (int i = 0; i < 3; ++i) bytesAt(slow, 0, 500);
    EXPECT_EQ(slept.size(), 3u);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(slept[i], 0.05 + 0.5 * (i + 1), 1e-9) << "reads share the line";
    slept.clear();
    now = 100;
    bytesAt(slow, 0, 500);
    EXPECT_NEAR(slept[0], 0.55, 1e-9);
    slept.clear();
    const FaultyReader stalling(file, {.stallRate = 0.25, .stallSeconds = 0.5, .spreadSeconds = 0.1}, clock);
    for (uint64_t i = 0; i < 400; ++i) bytesAt(stalling, i, 1);
    EXPECT_NEAR(double(std::count_if(slept.begin(), slept.end(), [](double s) { return s >= 0.5; })), 100, 40);
    for (const double s : slept) EXPECT_LT(s, 0.6);
    EXPECT_GT(*std::max_element(slept.begin(), slept.end()) - 0.5, 0.05);
}

TEST(FaultyReader, InterruptEndsAStall) {
    const auto file = std::make_shared<CountingBytes>(1000);
    const FaultyReader reader(file, {.stallRate = 1, .stallSeconds = 1000});
    std::atomic<bool> done{false};
    std::thread thread([&] {
        std::vector<std::byte> bytes(10);
        EXPECT_EQ(reader.read(0, bytes).error().code, ErrorCode::Cancelled);
        done = true;
    });
    while (!done) {
        reader.interrupt();
        std::this_thread::yield();
    }
    thread.join();
}

TEST(CachingReader, ReadsOnceAndForLater) {
    const TestFolder folder("vcp_caching_test");
    const auto file = std::make_shared<CountingBytes>(10 * kCacheBlockBytes + 77);
    std::mt19937_64 random(3);
    for (int round = 0; round < 2; ++round) {
        const auto cache = CachingReader::open(file, "a", folder.path(), 1 << 20);
        ASSERT_TRUE(cache) << cache.error().line();
        for (int i = 0; i < 200; ++i) {
            const uint64_t offset = random() % file->size(),
                           size = 1 + random() % std::min<uint64_t>(file->size() - offset, 100000);
            const auto bytes = bytesAt(**cache, offset, size);
            ASSERT_TRUE(bytes);
            EXPECT_TRUE(isRight(*bytes, offset));
        }
        EXPECT_FALSE(bytesAt(**cache, file->size() - 1, 2));
    }
    EXPECT_EQ(file->bytesRead(), file->size()) << "every byte came once";
    const auto other = CachingReader::open(file, "b", folder.path(), 1 << 20);
    bytesAt(**other, 0, 10);
    EXPECT_GT(file->bytesRead(), file->size()) << "another file's blocks are not used";
}

TEST(CachingReader, KeepsToItsLimitAndDropsTheOldest) {
    const TestFolder folder("vcp_caching_test");
    std::ofstream(folder / "notes.txt") << "not a block";
    const auto file = std::make_shared<CountingBytes>(100 * kCacheBlockBytes);
    const uint64_t limit = 16 * (kCacheBlockBytes + 8);
    const auto cache = CachingReader::open(file, "a", folder.path(), limit);
    ASSERT_TRUE(cache);
    for (uint64_t block = 0; block < 100; ++block) {
        bytesAt(**cache, block * kCacheBlockBytes, 1);
        uint64_t bytes = 0;
        for (const auto& entry : fs::directory_iterator(folder.path()))
            if (entry.path().extension() == ".vcpblock") bytes += entry.file_size();
        EXPECT_LE(bytes, limit);
        EXPECT_EQ(bytes, (*cache)->bytesKept());
    }
    const uint64_t reads = file->reads;
    bytesAt(**cache, 99 * kCacheBlockBytes, 1);
    EXPECT_EQ(file->reads, reads) << "the newest is there";
    bytesAt(**cache, 0, 1);
    EXPECT_EQ(file->reads, reads + 1) << "the oldest is gone";
    EXPECT_TRUE(fs::exists(folder / "notes.txt"));
}

TEST(CachingReader, DamagedAndDistrustedBlocksAreReadAgain) {
    const TestFolder folder("vcp_caching_test");
    const auto file = std::make_shared<CountingBytes>(3 * kCacheBlockBytes);
    const auto cache = CachingReader::open(file, "a", folder.path(), 1 << 20);
    ASSERT_TRUE(bytesAt(**cache, 0, file->size()));
    for (const auto& entry : fs::directory_iterator(folder.path())) {
        std::fstream block(entry.path(), std::ios::binary | std::ios::in | std::ios::out);
        block.seekp(1000);
        block.put('x').put('y');
    }
    const auto again = bytesAt(**cache, 0, file->size());
    ASSERT_TRUE(again);
    EXPECT_TRUE(isRight(*again, 0));
    EXPECT_EQ(file->bytesRead(), 2 * file->size());
    (*cache)->distrust(kCacheBlockBytes + 5, 10);
    ASSERT_TRUE(bytesAt(**cache, 0, file->size()));
    EXPECT_EQ(file->bytesRead(), 2 * file->size() + kCacheBlockBytes);
    fs::permissions(folder.path(), fs::perms::owner_all);
    EXPECT_EQ(CachingReader::open(file, "a", "/dev/null/x", 1).error().code, ErrorCode::Io);
}

TEST(ReadAhead, SmallStepsAreFewReads) {
    const auto file = std::make_shared<CountingBytes>(100003);
    const ReadAhead ahead(file, 10000);
    for (uint64_t at = 0; at < file->size();) {
        const uint64_t size = std::min<uint64_t>(at % 700, file->size() - at);
        const auto bytes = bytesAt(ahead, at, size);
        ASSERT_TRUE(bytes);
        EXPECT_TRUE(isRight(*bytes, at));
        at += size + 1;
    }
    EXPECT_LE(file->reads, 12u);
    EXPECT_TRUE(isRight(*bytesAt(ahead, 500, 20000), 500)) << "back, and more than a piece";
    EXPECT_FALSE(bytesAt(ahead, file->size() - 3, 4));
    EXPECT_FALSE(bytesAt(ahead, file->size() + 3, 4));
}

/// Counts reads of a real file.
class CountingReader final : public ByteReader {
public:
    explicit CountingReader(std::shared_ptr<const ByteReader> reader) : reader_(std::move(reader)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        ++reads;
        return reader_->read(offset, bytes);
    }
    [[nodiscard]] uint64_t size() const override { return reader_->size(); }
    [[nodiscard]] const std::string& name() const override { return reader_->name(); }
    void distrust(uint64_t, uint64_t bytes) const override { distrusted += bytes; }
    mutable uint64_t reads = 0, distrusted = 0;

private:
    std::shared_ptr<const ByteReader> reader_;
};

TEST(PageSource, RunsGiveTheSamePagesInFewerReads) {
    const TestFolder folder("vcp_page_source_test");
    test::writeSphereFile(folder / "scan.vcp", 3);
    const auto reader = std::make_shared<CountingReader>(*openFile(folder / "scan.vcp"));
    const auto dataset = std::make_shared<const Dataset>(*readDataset(*reader));
    const auto pages = uint32_t(dataset->pages.size());
    ASSERT_GT(pages, 8u);
    for (const uint64_t runBytes : {uint64_t{0}, uint64_t{8192}, uint64_t{1} << 30}) {
        const FilePageSource source(reader, dataset, runBytes);
        reader->reads = 0;
        uint64_t runs = 0;
        for (uint64_t page = 0; page < pages; ++runs) {
            const uint32_t count = source.runFrom(page, pages, true);
            const auto read = source.readRun(page, count, true);
            ASSERT_EQ(read.size(), count);
            for (uint32_t i = 0; i < count; ++i) {
                const auto alone = readPage(*reader, *dataset, page + i, true);
                reader->reads -= 2;  // geometry, colour
                ASSERT_TRUE(read[i] && alone);
                EXPECT_EQ(read[i]->geometry, alone->geometry);
                EXPECT_EQ(read[i]->colour, alone->colour);
                EXPECT_GE(source.bytesToRead(page + i, true),
                          read[i]->geometryBytes().size() + read[i]->colourBytes().size());
            }
            page += count;
        }
        EXPECT_EQ(reader->reads, runs);
        EXPECT_EQ(runs == pages, runBytes == 0);
        EXPECT_EQ(runs == 1, runBytes == uint64_t{1} << 30);
    }
}

TEST(PageSource, PiecesOfImagesThatLieTogetherAreReadTogether) {
    const TestFolder folder("vcp_page_source_test");
    test::StoredImages stored;
    for (const uint32_t edge : {700u, 90u, 30u}) stored.add(test::randomImage(edge, edge, edge));
    stored.tables.materials = {{}};
    test::writeImageFile(folder / "images.vcp", stored);
    const auto reader = std::make_shared<CountingReader>(*openFile(folder / "images.vcp"));
    const auto dataset = std::make_shared<const Dataset>(*readDataset(*reader));
    for (const uint64_t runBytes : {uint64_t{0}, uint64_t{400000}, uint64_t{1} << 30}) {
        const FilePageSource source(reader, dataset, runBytes);
        const auto images = *source.images();
        const auto pieces = uint32_t(images->count());
        ASSERT_GT(pieces, 6u);
        reader->reads = 0;
        uint64_t runs = 0;
        for (uint32_t piece = 0; piece < pieces; ++runs) {
            const Request first = Request::imagePiece(piece);
            const uint32_t count = source.runFrom(first, pieces, true);
            const auto read = source.readRun(first, count, true);
            ASSERT_EQ(read.size(), count);
            for (uint32_t i = 0; i < count; ++i, ++piece) {
                ASSERT_TRUE(read[i].ok());
                const auto alone = images->readPiece(*reader, piece);
                --reader->reads;
                EXPECT_EQ(read[i]->texels, *alone);
                EXPECT_GE(source.bytesToRead(Request::imagePiece(piece), true), read[i]->bytes());
            }
        }
        EXPECT_EQ(reader->reads, runs);
        EXPECT_EQ(runs == pieces, runBytes == 0);
        EXPECT_EQ(runs == 1, runBytes == uint64_t{1} << 30);
    }
    // A wrong tile is an error of its piece alone.
    {
        std::fstream file(folder / "images.vcp", std::ios::binary | std::ios::in | std::ios::out);
        const ImagesPlace& place = dataset->header.images;
        const auto last = std::streamoff(place.offset + place.bytes - 1);
        file.seekg(last);
        const char byte = char(file.get());
        file.seekp(last);
        file.put(char(byte ^ 1));
    }
    const FilePageSource source(reader, dataset, uint64_t{1} << 30);
    const auto pieces = uint32_t((*source.images())->count());
    reader->distrusted = 0;
    const auto read = source.readRun(Request::imagePiece(0), pieces, true);
    for (uint32_t i = 0; i < pieces; ++i) EXPECT_EQ(read[i].ok(), i + 1 < pieces) << i;
    EXPECT_EQ(read.back().error().code, ErrorCode::InvalidInput);
    EXPECT_GT(reader->distrusted, 0u);
}

TEST(PageSource, WhatIsKeptIsNotReadAgain) {
    const TestFolder folder("vcp_page_source_test");
    test::writeSphereFile(folder / "scan.vcp", 3);
    const auto reader = std::make_shared<CountingReader>(*openFile(folder / "scan.vcp"));
    const auto dataset = std::make_shared<const Dataset>(*readDataset(*reader));
    const FilePageSource source(reader, dataset, 1 << 20);
    const auto readsOf = [&](uint64_t first, uint32_t count, bool withColour) {
        reader->reads = 0;
        const auto pages = source.readRun(first, count, withColour);
        for (uint32_t i = 0; i < count; ++i) {
            const uint64_t before = reader->reads;
            const auto alone = readPage(*reader, *dataset, first + i, withColour);
            reader->reads = before;
            EXPECT_TRUE(pages[i] && alone && pages[i]->geometry == alone->geometry && pages[i]->colour == alone->colour)
                << first + i;
        }
        return reader->reads;
    };
    EXPECT_EQ(readsOf(2, 3, true), 1u);
    EXPECT_EQ(readsOf(2, 3, true), 1u) << "none may be kept";
    EXPECT_EQ(source.keepWithin(1 << 20), 0u);
    EXPECT_EQ(readsOf(2, 3, true), 1u);
    EXPECT_EQ(readsOf(2, 3, true), 0u);
    EXPECT_EQ(readsOf(1, 5, true), 1u) << "1 and 5, and what lies between";
    EXPECT_EQ(readsOf(1, 5, false), 0u);
    EXPECT_GT(source.keepWithin(1 << 20), 0u);
    EXPECT_EQ(source.keepWithin(0), 0u);
    EXPECT_EQ(readsOf(4, 1, false), 1u);
    source.keepWithin(1 << 20);
    EXPECT_EQ(readsOf(4, 1, false), 1u);
    EXPECT_EQ(readsOf(4, 1, true), 1u) << "colour was not kept";
}

TEST(StoredPages, TheLimitHoldsAndWhatWasUsedLongestAgoGoes) {
    StoredPages pages;
    const auto bytes = [](size_t count) { return std::vector<std::byte>(count, std::byte(7)); };
    pages.keep(0, bytes(10));
    EXPECT_EQ(pages.find(0), nullptr) << "none may be kept before there is a limit";
    EXPECT_EQ(pages.limitTo(1 << 20), 0u);
    pages.keep(1, bytes(1000));
    const uint64_t each = pages.limitTo(1 << 20);
    EXPECT_GE(each, 1000u);
    EXPECT_LT(each, 1300u);
    for (uint64_t page = 2; page <= 4; ++page) pages.keep(page, bytes(1000));
    pages.keep(4, bytes(1000));
    EXPECT_EQ(pages.limitTo(1 << 20), 4 * each);
    ASSERT_NE(pages.find(1), nullptr);
    EXPECT_EQ(pages.find(1)->size(), 1000u);
    EXPECT_EQ(pages.limitTo(3 * each), 3 * each);
    EXPECT_EQ(pages.find(2), nullptr) << "1 was used since";
    pages.keep(5, bytes(1000));
    EXPECT_EQ(pages.find(3), nullptr);
    pages.keep(6, bytes(4000));
    EXPECT_EQ(pages.find(6), nullptr) << "larger than the limit";
    EXPECT_NE(pages.find(1), nullptr);
    EXPECT_EQ(pages.limitTo(0), 0u);
}

TEST(PageSource, ADamagedPageIsAnErrorOfItsOwn) {
    const TestFolder folder("vcp_page_source_test");
    test::writeSphereFile(folder / "scan.vcp", 2);
    const auto dataset = std::make_shared<const Dataset>(*readDataset(**openFile(folder / "scan.vcp")));
    {
        std::fstream file(folder / "scan.vcp", std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(std::streamoff(dataset->pages[2].offset + 3));
        file.put('\x5a');
    }
    const auto reader = std::make_shared<CountingReader>(*openFile(folder / "scan.vcp"));
    const FilePageSource source(reader, dataset, 1 << 20);
    const auto read = source.readRun(0, 4, true);
    ASSERT_EQ(read.size(), 4u);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(read[i].ok(), i != 2);
    EXPECT_EQ(read[2].error().code, ErrorCode::InvalidInput);
    EXPECT_GE(reader->distrusted, dataset->pages[2].storedBytes);
}

}  // namespace
}  // namespace vcp
