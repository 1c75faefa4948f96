// The .vcp file and its writer: golden bytes, every truncation, every bit flip, lies behind valid hashes, disks
// that are full and folders that cannot be written.

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <random>
#include <thread>

#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "octree/io/content_hash.h"
#include "octree/vcp_verify.h"
#include "octree/vcp_writer.h"
#include "tests/support/analytic_page.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/peak_memory.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::byte>;

Bytes bytesOf(const fs::path& path) {
    const std::string text = contentOf(path);
    Bytes bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

/// A file in memory, of which one bit may be wrong.
class MemoryFile final : public ByteReader {
public:
    static constexpr uint64_t kIntact = ~uint64_t{0};
    explicit MemoryFile(std::span<const std::byte> bytes, uint64_t wrongBit = kIntact)
        : bytes_(bytes), wrongBit_(wrongBit) {}

    Result<void> read(uint64_t offset, std::span<std::byte> out) const override {
        if (offset > bytes_.size() || out.size() > bytes_.size() - offset)
            return Error{.code = ErrorCode::Io, .message = "read past the end", .file = name_};
        if (!out.empty()) std::memcpy(out.data(), bytes_.data() + offset, out.size());
        if (wrongBit_ / 8 >= offset && wrongBit_ / 8 - offset < out.size())
            out[wrongBit_ / 8 - offset] ^= std::byte{1} << int(wrongBit_ % 8);
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return bytes_.size(); }
    [[nodiscard]] const std::string& name() const override { return name_; }

private:
    std::span<const std::byte> bytes_;
    uint64_t wrongBit_;
    std::string name_ = "memory.vcp";
};

PageEntry entryOf(const Dataset& dataset, size_t page) {
    PageEntry entry = dataset.pages[page];
    entry.offset = entry.hash = 0;
    return entry;
}

/// Writes a sphere of two levels with colour; 4 cells a page edge keep it small. By default it is in all octants.
void writeSphere(const fs::path& path, glm::dvec3 centre = {3, 3.2, 2.9}, double radius = 1.4) {
    const auto made =
        test::analyticDataset(test::sphere(centre, radius), {.origin = {-1, -1, -1}, .levels = 2, .log2Cells = 2});
    auto writer = VcpWriter::create(path, made.pages.size());
    ASSERT_TRUE(writer.ok()) << writer.error().line();
    FileHeader header = made.dataset.header;
    header.flags = kFlagColour;
    for (size_t i = 0; i < made.pages.size(); ++i) {
        PageHeader page;
        std::memcpy(&page, made.pages[i].geometryBytes().data(), sizeof page);
        const std::vector<uint4> colour(colourPageBytes(page) / 16, uint4(0xff336699u));
        const StoredPage stored = compressPage(made.pages[i].geometryBytes(), std::as_bytes(std::span(colour)));
        ASSERT_TRUE((*writer)->append(entryOf(made.dataset, i), stored).ok());
    }
    const auto bytes = (*writer)->commit(header);
    ASSERT_TRUE(bytes.ok()) << bytes.error().line();
    EXPECT_EQ(*bytes, fs::file_size(path));
}

/// A file that can be changed and given valid hashes again.
struct Forgery {
    Bytes bytes;

    template <class T>
    T& at(uint64_t offset) {
        return *reinterpret_cast<T*>(bytes.data() + offset);
    }
    FileHeader& header() { return at<FileHeader>(0); }
    PageEntry& entry(uint64_t i) {
        return at<PageEntry>(kDirectoryOffset + i / kEntriesPerBlock * kBlockBytes +
                             i % kEntriesPerBlock * sizeof(PageEntry));
    }
    CommitRecord& commit() { return at<CommitRecord>(bytes.size() - sizeof(CommitRecord)); }

    void seal(uint64_t blocks = 1) {
        const std::span all(bytes);
        for (uint64_t b = 0; b < blocks; ++b) {
            const uint64_t begin = kDirectoryOffset + b * kBlockBytes;
            at<uint64_t>(begin + kBlockBytes - 8) = hashBytes(all.subspan(begin, kBlockBytes - 8));
        }
        header().hash = 0;
        header().hash = hashBytes(all.first(kDirectoryOffset));
        commit().headerHash = header().hash;
        commit().directoryHash = hashBytes(all.subspan(kDirectoryOffset, blocks * kBlockBytes));
        commit().hash = hashBytes(all.subspan(bytes.size() - sizeof(CommitRecord), offsetof(CommitRecord, hash)));
    }
};

class VcpFile : public ::testing::Test {
protected:
    void SetUp() override {
        writeSphere(path());
        if (!HasFatalFailure()) bytes_ = bytesOf(path());
    }
    fs::path path() const { return folder_ / "sphere.vcp"; }

    /// Changes a copy, seals it, and expects the reader to refuse it with `words`.
    template <class Change>
    void expectRefused(const std::string& words, const Change& change) const {
        Forgery forgery{bytes_};
        change(forgery);
        forgery.seal();
        const auto dataset = readDataset(MemoryFile(forgery.bytes));
        ASSERT_FALSE(dataset.ok()) << "accepted, but should say: " << words;
        EXPECT_NE(dataset.error().line().find(words), std::string::npos) << dataset.error().line();
        EXPECT_NE(dataset.error().line().find("memory.vcp"), std::string::npos);
        EXPECT_TRUE(dataset.error().byte.has_value());
        EXPECT_EQ(dataset.error().code, ErrorCode::InvalidInput);
    }

    TestFolder folder_{"vcp_file_test"};
    Bytes bytes_;
};

TEST_F(VcpFile, IsReadBack) {
    auto file = openFile(path());
    ASSERT_TRUE(file.ok());
    EXPECT_EQ((*file)->size(), bytes_.size());
    const auto dataset = readDataset(**file);
    ASSERT_TRUE(dataset.ok()) << dataset.error().line();
    ASSERT_EQ(dataset->header.levels, 2u);
    ASSERT_EQ(dataset->pages.size(), 9u);
    EXPECT_EQ(dataset->pages[0].childMask, 0xff);
    EXPECT_TRUE(dataset->hasColour());
    for (uint64_t i = 0; i < dataset->pages.size(); ++i) {
        const auto page = readPage(**file, *dataset, i, true);
        ASSERT_TRUE(page.ok()) << page.error().line();
        EXPECT_EQ(page->geometryBytes().size(), dataset->pages[i].pageBytes);
        EXPECT_EQ(page->colourBytes().size(), dataset->pages[i].colourBytes);
        const auto plain = readPage(**file, *dataset, i, false);
        ASSERT_TRUE(plain.ok());
        EXPECT_TRUE(plain->colour.empty());
        EXPECT_EQ(plain->geometry, page->geometry);
        const auto view = parsePage(page->geometryBytes(), page->colourBytes());
        ASSERT_TRUE(view.ok());
        EXPECT_EQ(view->header.softLeaves, dataset->pages[i].leaves);
    }
    EXPECT_TRUE(verifyFile(**file).ok());
}

TEST_F(VcpFile, PagesAreAlignedAndInOrder) {
    const auto dataset = readDataset(MemoryFile(bytes_));
    ASSERT_TRUE(dataset.ok());
    uint64_t end = kDirectoryOffset + kBlockBytes;
    for (const PageEntry& e : dataset->pages) {
        EXPECT_EQ(e.offset % kPageAlignment, 0u);
        EXPECT_GE(e.offset, end);
        EXPECT_GE(e.colourOffset, e.offset + e.storedBytes);
        end = e.colourOffset + e.colourStoredBytes;
    }
    EXPECT_LE(end, bytes_.size() - sizeof(CommitRecord));
}

TEST_F(VcpFile, OriginsAndEdges) {
    const auto dataset = readDataset(MemoryFile(bytes_));
    ASSERT_TRUE(dataset.ok());
    EXPECT_EQ(dataset->cellOf(0), 2);
    EXPECT_EQ(dataset->cellOf(1), 1);
    EXPECT_EQ(dataset->edgeOf(dataset->pages[0]), 8);
    EXPECT_EQ(dataset->originOf(dataset->pages[0]), glm::dvec3(-1));
    for (size_t i = 1; i < 9; ++i) {
        const int octant = int(i - 1);
        EXPECT_EQ(dataset->edgeOf(dataset->pages[i]), 4);
        EXPECT_EQ(dataset->originOf(dataset->pages[i]),
                  glm::dvec3(-1) + 4.0 * glm::dvec3(octant & 1, octant >> 1 & 1, octant >> 2));
    }
}

// The layout, byte by byte, of a file whose pages need no compressor. A failure here means that files written
// before can no longer be read: raise kFileVersion.
TEST(VcpFileLayout, GoldenBytes) {
    const TestFolder folder("vcp_golden_test");
    {
        auto writer = VcpWriter::create(folder / "golden.vcp", 2);
        ASSERT_TRUE(writer.ok());
        StoredPage page;
        page.geometry.resize(300);
        page.colour.resize(5);
        for (size_t i = 0; i < page.geometry.size(); ++i) page.geometry[i] = std::byte(i * 7);
        for (size_t i = 0; i < page.colour.size(); ++i) page.colour[i] = std::byte(200 + i);
        page.geometryBytes = 1024;
        page.colourBytes = 64;
        ASSERT_TRUE(
            (*writer)
                ->append({.firstChild = 1, .leaves = 3, .hardLeaves = 1, .certifiedError = 0.5f, .childMask = 0x20},
                         page)
                .ok());
        ASSERT_TRUE((*writer)
                        ->append({.morton = 5, .leaves = 2, .hardLeaves = 2, .certifiedError = 0.25f, .level = 1}, page)
                        .ok());
        FileHeader h;
        h.origin[0] = -3;
        h.origin[1] = 450000.25;
        h.cell = 0.125;
        h.errorTarget = 0.01;
        h.certifiedErrorMax = 0.25;
        h.boundsMax[2] = 7;
        h.levels = 2;
        h.log2Cells = 5;
        h.flags = kFlagColour;
        h.triangles = 123456789012;
        h.level[0] = {0, 1, 0.5};
        h.level[1] = {1, 1, 0.25};
        ASSERT_TRUE((*writer)->commit(h).ok());
    }
    const Bytes bytes = bytesOf(folder / "golden.vcp");
    const auto u32 = [&](size_t at) {
        uint32_t v;
        std::memcpy(&v, &bytes[at], 4);
        return v;
    };
    const auto u64 = [&](size_t at) {
        uint64_t v;
        std::memcpy(&v, &bytes[at], 8);
        return v;
    };
    ASSERT_EQ(bytes.size(), 9792u);
    EXPECT_EQ(std::memcmp(bytes.data(), "VCP\r\n\x1a\n\0", 8), 0);
    EXPECT_EQ(u32(8), 6u);
    EXPECT_EQ(u32(12), 4096u);
    EXPECT_EQ(u64(16), 9792u);
    EXPECT_EQ(u64(24), 2u);
    EXPECT_EQ(u64(32), 0xc008000000000000u);  // -3
    EXPECT_EQ(u32(128), 2u);
    EXPECT_EQ(u64(144), 123456789012u);
    EXPECT_EQ(u64(184 + 24), 1u);      // first entry of level 1
    EXPECT_EQ(u64(4096 + 8), 8192u);   // the first page
    EXPECT_EQ(u64(4096 + 24), 8704u);  // its colour: 300 bytes end on the second 256
    EXPECT_EQ(u32(4096 + 40), 300u);
    EXPECT_EQ(u64(4096 + 80), 5u);  // Morton code of the second
    EXPECT_EQ(u64(4096 + 80 + 8), 8960u);
    EXPECT_EQ(std::memcmp(&bytes[9728], "VCPcommt", 8), 0);
    EXPECT_EQ(fmt::format("{:016x}", hashBytes(bytes)), "3059bebac63681a7");
    EXPECT_TRUE(readDataset(MemoryFile(bytes)).ok());
    // Files of versions 5 and 3 differ in nothing else, and are read.
    Forgery older{bytes};
    older.header().version = 5;
    older.seal();
    EXPECT_EQ(fmt::format("{:016x}", hashBytes(older.bytes)), "5db7b605bec65f26");
    EXPECT_TRUE(readDataset(MemoryFile(older.bytes)).ok());
    older.header().version = 3;
    older.seal();
    EXPECT_EQ(fmt::format("{:016x}", hashBytes(older.bytes)), "dbd0f29632bee815");
    EXPECT_TRUE(readDataset(MemoryFile(older.bytes)).ok());
}

TEST_F(VcpFile, EveryTruncationIsFound) {
    for (size_t size = 0; size < bytes_.size(); ++size) {
        const auto result = verifyFile(MemoryFile(std::span(bytes_).first(size)));
        ASSERT_FALSE(result.ok()) << size;
        ASSERT_EQ(result.error().file, "memory.vcp");
        ASSERT_TRUE(result.error().byte.has_value());
    }
}

TEST_F(VcpFile, TruncatedFileOnDiskIsFound) {
    fs::resize_file(path(), bytes_.size() - 1);
    auto file = openFile(path());
    ASSERT_TRUE(file.ok());
    const auto dataset = readDataset(**file);
    ASSERT_FALSE(dataset.ok());
    EXPECT_NE(dataset.error().line().find("truncated"), std::string::npos) << dataset.error().line();
    EXPECT_NE(dataset.error().line().find(path().string()), std::string::npos);
}

TEST_F(VcpFile, EveryBitFlipIsFound) {
    // Two pages are enough: root and one child.
    writeSphere(path(), {1, 1, 1}, 0.9);
    bytes_ = bytesOf(path());
    ASSERT_EQ(readDataset(MemoryFile(bytes_))->pages.size(), 2u);
    std::atomic<uint64_t> next = 0;
    std::atomic<uint64_t> missed = MemoryFile::kIntact;
    const uint64_t bits = bytes_.size() * 8;
    const auto work = [&] {
        for (uint64_t byte; (byte = next++) * 8 < bits;)
            for (uint64_t bit = byte * 8; bit < byte * 8 + 8; ++bit)
                if (verifyFile(MemoryFile(bytes_, bit)).ok()) missed = bit;
    };
    std::vector<std::thread> threads;
    for (unsigned i = 1; i < std::min(4u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(missed.load(), MemoryFile::kIntact) << "a flip of this bit was not found";
    EXPECT_TRUE(verifyFile(MemoryFile(bytes_)).ok());
}

TEST_F(VcpFile, DamagedPageIsNamed) {
    const auto dataset = readDataset(MemoryFile(bytes_));
    ASSERT_TRUE(dataset.ok());
    const MemoryFile damaged(bytes_, (dataset->pages[3].offset + 7) * 8);
    EXPECT_TRUE(readPage(damaged, *dataset, 2, true).ok());
    const auto page = readPage(damaged, *dataset, 3, true);
    ASSERT_FALSE(page.ok());
    EXPECT_NE(page.error().line().find(fmt::format("memory.vcp: page 3: byte {}: hash", dataset->pages[3].offset)),
              std::string::npos)
        << page.error().line();
}

TEST_F(VcpFile, AppendedBytesAreFound) {
    for (const size_t more : {1, 64, 256}) {
        Bytes longer = bytes_;
        longer.resize(longer.size() + more);
        const auto result = verifyFile(MemoryFile(longer));
        ASSERT_FALSE(result.ok());
        EXPECT_NE(result.error().line().find("appended"), std::string::npos) << result.error().line();
    }
}

TEST_F(VcpFile, WrongMagicAndVersion) {
    Bytes magic = bytes_;
    magic[0] = std::byte{'X'};
    const auto notVcp = readDataset(MemoryFile(magic));
    ASSERT_FALSE(notVcp.ok());
    EXPECT_EQ(notVcp.error().line(), "memory.vcp: header: byte 0: not a .vcp file; of meshes, vcp build makes one");

    Bytes version = bytes_;
    version[8] = std::byte{17};
    const auto future = readDataset(MemoryFile(version));
    ASSERT_FALSE(future.ok());
    EXPECT_EQ(future.error().code, ErrorCode::Unsupported);
    EXPECT_NE(future.error().line().find("17"), std::string::npos) << future.error().line();
    EXPECT_NE(future.error().line().find(fmt::format("versions {} to {}", kOldestFileVersion, kNewestFileVersion)),
              std::string::npos);

    version[8] = std::byte{2};
    const auto past = readDataset(MemoryFile(version));
    ASSERT_FALSE(past.ok());
    EXPECT_EQ(past.error().code, ErrorCode::Unsupported);
    EXPECT_EQ(
        past.error().line(),
        "memory.vcp: header: byte 8: file version 2 is not known; this program reads versions 3 to 11: build it again");
}

TEST_F(VcpFile, HeaderLiesAreFound) {
    using F = Forgery;
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    expectRefused("truncated", [](F& f) { f.header().fileBytes += 256; });
    expectRefused("header size", [](F& f) { f.header().headerBytes = 8192; });
    expectRefused("levels or page size", [](F& f) { f.header().levels = 0; });
    expectRefused("levels or page size", [](F& f) { f.header().levels = kMaxLevels + 1; });
    expectRefused("levels or page size", [](F& f) { f.header().log2Cells = 0; });
    expectRefused("levels or page size", [](F& f) { f.header().log2Cells = 8; });
    for (const double cell : {0.0, -1.0, nan, infinity})
        expectRefused("not finite", [&](F& f) { f.header().cell = cell; });
    expectRefused("not finite", [&](F& f) { f.header().origin[1] = nan; });
    expectRefused("not finite", [&](F& f) { f.header().boundsMax[2] = infinity; });
    expectRefused("page count", [](F& f) { f.header().pages = 0; });
    expectRefused("level table", [](F& f) { f.header().pages = 10; });
    expectRefused("level table", [](F& f) { f.header().level[1].pages = 0; });
    expectRefused("level table", [](F& f) { f.header().level[1].pages = ~uint64_t{0}; });
    expectRefused("level table", [](F& f) { f.header().level[1].firstEntry = 2; });
    expectRefused("level table", [](F& f) { f.header().levels = 1; });
    expectRefused("level table", [](F& f) {
        f.header().level[0].pages = 2;
        f.header().level[1] = {2, 7, 0};
    });
    expectRefused("more pages than the level above", [](F& f) {
        f.header().levels = 3;
        f.header().pages = 18;
        f.header().level[1] = {1, 1, 0};
        f.header().level[2] = {2, 16, f.header().certifiedErrorMax};
    });
    for (const double error : {nan, infinity, -5.0, 0.0}) {
        expectRefused(fmt::format("byte {}: certified error", offsetof(FileHeader, level) + 24 + 16),
                      [&](F& f) { f.header().level[1].certifiedError = error == 0 ? nan : error; });
        expectRefused(fmt::format("byte {}: certified error", offsetof(FileHeader, certifiedErrorMax)),
                      [&](F& f) { f.header().certifiedErrorMax = error; });
        if (error != 0)
            expectRefused(fmt::format("byte {}: error target", offsetof(FileHeader, errorTarget)),
                          [&](F& f) { f.header().errorTarget = error; });
    }
    expectRefused("cell is too large", [](F& f) { f.header().cell = 1e308; });
    expectRefused("byte 80: the bounds end before they begin",
                  [](F& f) { f.header().boundsMin[0] = f.header().boundsMax[0] + 1; });
    expectRefused(fmt::format("byte {}: more hard leaves", offsetof(FileHeader, hardLeaves)),
                  [](F& f) { f.header().hardLeaves = f.header().leaves + 1; });
    expectRefused(fmt::format("byte {}: more triangles without area", offsetof(FileHeader, degenerateTriangles)),
                  [](F& f) { f.header().degenerateTriangles = 1; });
    expectRefused("byte 776: reserved", [](F& f) { f.bytes[offsetof(FileHeader, images)] = std::byte{1}; });
    expectRefused("byte 808: reserved", [](F& f) { f.header().images.channels = 1; });
    expectRefused("byte 816: reserved", [](F& f) { f.bytes[sizeof(FileHeader)] = std::byte{1}; });
    expectRefused("byte 4095: reserved", [](F& f) { f.bytes[4095] = std::byte{1}; });
    expectRefused("reserved", [](F& f) { f.header().paper.packing = 1; });
    expectRefused("rows behind the level table", [](F& f) { f.header().level[2].pages = 1; });
    Forgery flags{bytes_};
    flags.header().flags |= 8;
    flags.seal();
    const auto dataset = readDataset(MemoryFile(flags.bytes));
    ASSERT_FALSE(dataset.ok());
    EXPECT_EQ(dataset.error().code, ErrorCode::Unsupported);
    EXPECT_EQ(dataset.error().line(),
              "memory.vcp: header: byte 136: flags 0x8 are not known to this program: use a newer program");

    // Version 3 knows fewer flags.
    Forgery covering{bytes_};
    covering.header().flags |= kFlagCovering;
    covering.seal();
    const auto knows = readDataset(MemoryFile(covering.bytes));
    ASSERT_TRUE(knows.ok()) << knows.error().line();
    EXPECT_TRUE(knows->isCovering());
    covering.header().version = 3;
    covering.seal();
    EXPECT_FALSE(readDataset(MemoryFile(covering.bytes)).ok());
}

TEST_F(VcpFile, WhatIsSaidOfPartsIsChecked) {
    const auto say = [](Forgery& f) {
        f.header().flags |= kFlagParts;
        f.header().parts = 3, f.header().closedParts = 2, f.header().openEdges = 40;
        for (uint64_t i = 0; i < f.header().pages; ++i) f.entry(i).parts = kPageHasClosed | kPageHasOpen;
    };
    Forgery said{bytes_};
    say(said);
    said.seal();
    const auto knows = readDataset(MemoryFile(said.bytes));
    ASSERT_TRUE(knows.ok()) << knows.error().line();
    EXPECT_TRUE(knows->hasOpenParts());
    expectRefused("more closed parts", [&](Forgery& f) { say(f), f.header().closedParts = 4; });
    expectRefused("out of range", [&](Forgery& f) { say(f), f.entry(1).parts = 4; });
    expectRefused("parts are missing", [&](Forgery& f) { say(f), f.entry(1).parts = 0; });
    expectRefused("out of range", [](Forgery& f) { f.entry(1).parts = 1; });
    expectRefused("reserved", [](Forgery& f) { f.header().openEdges = 1; });
    // Version 5 knows nothing of parts.
    said.header().version = 5;
    said.seal();
    EXPECT_FALSE(readDataset(MemoryFile(said.bytes)).ok());
}

TEST_F(VcpFile, WhatIsSaidOfMarksIsChecked) {
    const auto say = [](Forgery& f, uint32_t version = kMarkedFileVersion) {
        f.header().version = version;
        f.header().flags |= kFlagParts | kFlagMarks;
        f.header().parts = 3, f.header().closedParts = 2, f.header().openEdges = 40;
        for (uint64_t i = 0; i < f.header().pages; ++i)
            f.entry(i).parts = uint8_t(i == 0 ? kPageHasClosed | kPageHasOpen | kPageHasMarks : kPageHasClosed);
    };
    Forgery said{bytes_};
    say(said);
    said.seal();
    const auto knows = readDataset(MemoryFile(said.bytes));
    ASSERT_TRUE(knows.ok()) << knows.error().line();
    EXPECT_EQ(knows->pages[0].parts, 7);
    // Marks tell two kinds apart: where there is one, there are none.
    for (const int parts : {4, 5, 6, 8, 15})
        expectRefused("kinds of parts out of range", [&](Forgery& f) { say(f), f.entry(1).parts = uint8_t(parts); });
    for (const uint32_t missing : {kFlagMarks, kFlagParts})
        expectRefused("nothing in the flags asks for this version",
                      [&](Forgery& f) { say(f), f.header().flags &= ~missing; });
    say(said, 6);
    said.seal();
    const auto older = readDataset(MemoryFile(said.bytes));
    ASSERT_FALSE(older.ok());
    EXPECT_NE(older.error().line().find("flags 0x8 are not known"), std::string::npos) << older.error().line();
}

TEST_F(VcpFile, MarksAskForTheNewerVersion) {
    const TestFolder folder("vcp_marks_version_test");
    for (const uint8_t parts : {kPageHasClosed, uint8_t{3}, uint8_t{7}}) {
        auto writer = VcpWriter::create(folder / "one.vcp", 1);
        ASSERT_TRUE(writer.ok());
        StoredPage page;
        page.geometry.resize(40);
        page.geometryBytes = 1024;
        ASSERT_TRUE((*writer)->append({.leaves = 3, .parts = parts}, page).ok());
        FileHeader h;
        h.levels = 1;
        h.log2Cells = 5;
        h.cell = 1;
        h.flags = kFlagParts;
        h.parts = 2, h.closedParts = 1;
        h.level[0] = {0, 1, 0};
        ASSERT_TRUE((*writer)->commit(h).ok());
        const auto read = readDataset(MemoryFile(bytesOf(folder / "one.vcp")));
        ASSERT_TRUE(read.ok()) << read.error().line();
        EXPECT_EQ(read->header.version, parts == 7 ? 7u : 6u);
        EXPECT_EQ(read->header.flags, parts == 7 ? kFlagParts | kFlagMarks : kFlagParts);
    }
}

TEST(ColourErrorCode, IsTheLeastThatIsEnough) {
    EXPECT_EQ(colourErrorCode(0), 0);
    EXPECT_EQ(colourErrorOf(0), 0);
    EXPECT_EQ(colourErrorOf(255), kMostColourError);
    for (uint32_t code = 1; code <= 255; ++code) {
        EXPECT_EQ(colourErrorCode(colourErrorOf(code)), code);
        EXPECT_EQ(colourErrorCode(std::nextafter(colourErrorOf(code - 1), 200)), code);
    }
    EXPECT_EQ(colourErrorCode(1000), 255);
}

/// Writes a file of one page with slabs, and reads its directory.
Result<Dataset> datasetOfSlabs(uint8_t p95, uint8_t max, uint32_t flags) {
    const TestFolder folder("vcp_colour_errors_test");
    VCP_TRY_ASSIGN(auto writer, VcpWriter::create(folder / "one.vcp", 1));
    StoredPage page{std::vector<std::byte>(40), {}, 1024, 0};
    if ((flags & kFlagColour) != 0) page.colour.resize(40), page.colourBytes = 1024;
    PageEntry entry{.leaves = 3, .slabLeaves = 3};
    entry.colourErrorP95 = p95, entry.colourErrorMax = max;
    VCP_TRY(writer->append(entry, page));
    FileHeader h;
    h.levels = 1;
    h.log2Cells = 5;
    h.cell = 1;
    h.flags = flags;
    h.level[0] = {0, 1, 0};
    VCP_TRY(writer->commit(h));
    return readDataset(MemoryFile(bytesOf(folder / "one.vcp")));
}

TEST(VcpFileVersion, FineSlabsAskForTheNewestVersion) {
    const auto fine = datasetOfSlabs(9, 20, kFlagColour | kFlagCovering | kFlagFineSlabs);
    ASSERT_TRUE(fine.ok()) << fine.error().line();
    EXPECT_EQ(fine->header.version, kFineSlabsFileVersion);
    EXPECT_EQ(fine->header.flags, kFlagColour | kFlagCovering | kFlagFineSlabs | kFlagColourErrors);
    EXPECT_EQ(fine->slabEdgeOf(0), 0.5);
    EXPECT_EQ(datasetOfSlabs(9, 20, kFlagColour | kFlagCovering)->slabEdgeOf(0), 1);
    const auto wrong = datasetOfSlabs(9, 20, kFlagColour | kFlagFineSlabs);
    ASSERT_FALSE(wrong.ok());
    EXPECT_NE(wrong.error().line().find("nothing in the flags"), std::string::npos) << wrong.error().line();
}

TEST(VcpFileVersion, ColourErrorsAskForTheirVersion) {
    const auto with = datasetOfSlabs(9, 20, kFlagColour);
    ASSERT_TRUE(with.ok()) << with.error().line();
    EXPECT_EQ(with->header.version, kColourErrorsFileVersion);
    EXPECT_EQ(with->header.flags, kFlagColour | kFlagColourErrors);
    EXPECT_EQ(with->pages[0].colourErrorP95, 9);
    EXPECT_EQ(with->pages[0].colourErrorMax, 20u);
    EXPECT_EQ(with->pages[0].slabLeaves, 3u);
    const auto without = datasetOfSlabs(0, 0, kFlagColour);
    ASSERT_TRUE(without.ok()) << without.error().line();
    EXPECT_EQ(without->header.version, kFileVersion);
    EXPECT_EQ(without->header.flags, kFlagColour);
    for (const auto& [wrong, words] : {std::pair(datasetOfSlabs(21, 20, kFlagColour), "of 95 % more than of all"),
                                       std::pair(datasetOfSlabs(9, 20, 0), "nothing in the flags")}) {
        ASSERT_FALSE(wrong.ok());
        EXPECT_NE(wrong.error().line().find(words), std::string::npos) << wrong.error().line();
    }
}

TEST_F(VcpFile, HugeCountsAllocateNothing) {
    const uint64_t before = test::peakBytes();
    for (const uint64_t pages : {uint64_t{1} << 20, uint64_t{1} << 31, uint64_t{1} << 40, ~uint64_t{0}})
        expectRefused("page count", [&](Forgery& f) { f.header().pages = f.header().level[1].pages = pages; });
    // The largest count that the file's size allows: the directory does not fit.
    expectRefused("directory does not fit", [&](Forgery& f) {
        FileHeader& h = f.header();
        h.pages = f.bytes.size() / sizeof(PageEntry);
        h.levels = 4;
        h.level[1].pages = 8;
        h.level[2] = {9, 64, 0};
        h.level[3] = {73, h.pages - 73, h.certifiedErrorMax};
    });
    EXPECT_LT(test::peakBytes() - before, 16u << 20);
}

TEST_F(VcpFile, DirectoryLiesAreFound) {
    using F = Forgery;
    expectRefused("overlaps", [](F& f) { f.entry(1).offset = f.entry(0).offset; });
    expectRefused("overlaps", [](F& f) { f.entry(2).colourOffset = f.entry(2).offset; });
    expectRefused("overlaps", [](F& f) { std::swap(f.entry(2).offset, f.entry(3).offset); });
    expectRefused("overlaps", [](F& f) { f.entry(0).offset = 0; });
    expectRefused("overlaps", [](F& f) { f.entry(0).offset = kDirectoryOffset; });
    expectRefused("outside", [](F& f) { f.entry(8).offset = (f.bytes.size() + 256) / 256 * 256; });
    expectRefused("outside", [](F& f) { f.entry(8).offset = ~uint64_t{255}; });
    expectRefused("outside", [](F& f) { f.entry(8).offset += 1; });
    expectRefused("outside", [](F& f) { f.entry(8).storedBytes = 0; });
    expectRefused("outside", [](F& f) { f.entry(8).storedBytes = 0xffffffff; });
    expectRefused("outside", [](F& f) { f.entry(8).colourStoredBytes = 0xffffffff; });
    expectRefused("page size", [](F& f) { f.entry(1).pageBytes = 0; });
    expectRefused("page size", [](F& f) { f.entry(1).pageBytes += 8; });
    expectRefused("page size", [](F& f) { f.entry(1).pageBytes = 0xfffffff0; });
    expectRefused("page size", [](F& f) { f.entry(1).colourBytes = 0xfffffff0; });
    expectRefused("colour is missing", [](F& f) { f.entry(1).colourStoredBytes = 0; });
    expectRefused("its colour does not follow it", [](F& f) { f.entry(1).colourOffset += 8192; });
    expectRefused("child pages do not match", [](F& f) { f.entry(1).level = 0; });
    expectRefused("wrong level", [](F& f) { f.entry(0).level = 1; });
    expectRefused("root is not at the origin", [](F& f) { f.entry(0).morton = 1; });
    expectRefused("certified error", [](F& f) { f.entry(1).certifiedError = -1; });
    expectRefused("certified error", [](F& f) { f.entry(1).certifiedError = std::numeric_limits<float>::quiet_NaN(); });
    expectRefused("counts", [](F& f) { f.entry(1).hardLeaves = f.entry(1).leaves + 1; });
    expectRefused("more slab leaves", [](F& f) { f.entry(1).slabLeaves = (f.entry(1).leaves + 1) & 0xffffffu; });
    expectRefused("more slab leaves", [](F& f) { f.entry(1).slabLeaves = 3, f.header().version = 3; });
    expectRefused("wrong child pages", [](F& f) { f.entry(0).firstChild = 2; });
    expectRefused("wrong child pages", [](F& f) { f.entry(0).firstChild = 0; });
    expectRefused("wrong child pages", [](F& f) { f.entry(4).childMask = 1; });
    expectRefused("child pages do not match", [](F& f) { std::swap(f.entry(1).morton, f.entry(2).morton); });
    expectRefused("child pages do not match", [](F& f) { f.entry(8).morton = 8; });
    expectRefused("without a parent", [](F& f) { f.entry(0).childMask = 0x7f; });
    expectRefused("without a parent", [](F& f) { f.entry(0).childMask = 0, f.entry(0).firstChild = 0; });
    expectRefused("a first one where there are none", [](F& f) { f.entry(0).childMask = 0; });
    const auto at = [](uint64_t entry, uint64_t field) {
        return fmt::format("directory entry {}: byte {}: ", entry,
                           kDirectoryOffset + entry * sizeof(PageEntry) + field);
    };
    expectRefused(at(1, offsetof(PageEntry, certifiedError)) + "certified error is larger",
                  [](F& f) { f.entry(1).certifiedError *= 2; });
    expectRefused(at(1, offsetof(PageEntry, certifiedError)) + "certified error is larger",
                  [](F& f) { f.header().level[1].certifiedError = f.header().certifiedErrorMax = 0; });
    expectRefused(at(2, offsetof(PageEntry, leaves)) + "leaf counts", [](F& f) { f.entry(2).leaves = 0xffffffff; });
    expectRefused(at(3, offsetof(PageEntry, colourErrorP95)) + "colour error: of 95 % more than of all",
                  [](F& f) { f.entry(3).colourErrorP95 = 1; });
    expectRefused(at(3, 79) + "a colour error where no slab can have one", [](F& f) { f.entry(3).colourErrorMax = 1; });
    expectRefused(at(0, offsetof(PageEntry, colourStoredBytes)) + "has colour", [](F& f) { f.header().flags = 0; });
    expectRefused(at(0, offsetof(PageEntry, colourOffset)) + "a place of colour", [](F& f) {
        f.header().flags = 0;
        f.entry(0).colourBytes = f.entry(0).colourStoredBytes = 0;
    });
    expectRefused("outside", [](F& f) { f.entry(8).colourOffset = f.bytes.size() - sizeof(CommitRecord); });
    // One block holds nine entries here; its bytes behind them are nobody's.
    expectRefused(fmt::format("directory block 0: byte {}: bytes behind", kDirectoryOffset + 9 * sizeof(PageEntry)),
                  [](F& f) { f.entry(9).leaves = 0, f.entry(9).morton = 1; });
    expectRefused("directory block 0: byte 8183: bytes behind", [](F& f) { f.bytes[8183] = std::byte{1}; });
    expectRefused(fmt::format("commit record: byte {}: reserved",
                              bytes_.size() - sizeof(CommitRecord) + offsetof(CommitRecord, reserved) + 8),
                  [](F& f) { f.commit().reserved[1] = 1; });
}

TEST_F(VcpFile, LyingPageSizesAllocateNothing) {
    const uint64_t before = test::peakBytes();
    Forgery forgery{bytes_};
    forgery.entry(1).pageBytes = 1u << 28;
    forgery.entry(2).colourBytes = 1u << 28;
    forgery.seal();
    const MemoryFile file(forgery.bytes);
    const auto dataset = readDataset(file);
    ASSERT_TRUE(dataset.ok()) << dataset.error().line();
    for (const uint64_t page : {1u, 2u}) {
        const auto read = readPage(file, *dataset, page, true);
        ASSERT_FALSE(read.ok());
        EXPECT_NE(read.error().line().find("does not decode"), std::string::npos) << read.error().line();
    }
    EXPECT_LT(test::peakBytes() - before, 64u << 20);
}

/// Puts other content, rightly hashed, where a page was.
void replacePage(Forgery& forgery, uint64_t page, std::span<const std::byte> stored, uint32_t pageBytes) {
    PageEntry& e = forgery.entry(page);
    ASSERT_LE(stored.size(), e.storedBytes);
    std::memcpy(&forgery.bytes[e.offset], stored.data(), stored.size());
    e.storedBytes = uint32_t(stored.size());
    e.pageBytes = pageBytes;
    e.hash = hashBytes(stored);
    forgery.seal();
}

TEST_F(VcpFile, PagesBehindValidHashesAreChecked) {
    PageHeader header;
    header.log2Cells = 2;
    header.root = emptyNode(0);
    const auto expectPage = [&](const char* words, uint32_t pageBytes, bool compressed) {
        Forgery forgery{bytes_};
        const auto raw = std::as_bytes(std::span(&header, 1));
        const StoredPage stored = compressPage(raw, {});
        replacePage(forgery, 1, compressed ? std::span<const std::byte>(stored.geometry) : raw, pageBytes);
        const MemoryFile file(forgery.bytes);
        const auto dataset = readDataset(file);
        ASSERT_TRUE(dataset.ok()) << dataset.error().line();
        const auto page = readPage(file, *dataset, 1, false);
        ASSERT_FALSE(page.ok()) << words;
        EXPECT_NE(page.error().line().find(words), std::string::npos) << page.error().line();
        EXPECT_NE(page.error().line().find("page 1"), std::string::npos) << page.error().line();
    };
    expectPage("does not decode", 128, true);
    expectPage("does not decode", 48, true);
    expectPage("does not decode", 64, false);
    header.groups = 1;
    expectPage("page counts", 64, true);
    header.groups = 0;
    header.log2Cells = 3;
    expectPage("page size differs", 64, true);
}

/// What only the whole file can contradict.
TEST_F(VcpFile, VerifyFindsContradictions) {
    const auto expectFound = [&](const std::string& words, const auto& change) {
        Forgery forgery{bytes_};
        change(forgery);
        forgery.seal();
        const auto verified = verifyFile(MemoryFile(forgery.bytes));
        ASSERT_FALSE(verified.ok()) << "intact, but should say: " << words;
        EXPECT_NE(verified.error().line().find(words), std::string::npos) << verified.error().line();
    };
    using F = Forgery;
    const auto header = [](uint64_t byte) { return fmt::format("memory.vcp: header: byte {}: ", byte); };
    expectFound(header(offsetof(FileHeader, leaves)) + "0 leaves, but the pages", [](F& f) { f.header().leaves = 0; });
    expectFound(header(offsetof(FileHeader, hardLeaves)) + "1 hard leaves, but the pages",
                [](F& f) { f.header().hardLeaves = 1; });
    expectFound(header(offsetof(FileHeader, level) + 16) + "certified error of level 0",
                [](F& f) { f.header().level[0].certifiedError *= 2; });
    expectFound(header(offsetof(FileHeader, level) + 24 + 16) + "certified error of level 1",
                [](F& f) { f.header().certifiedErrorMax = f.header().level[1].certifiedError *= 2; });
    expectFound(header(offsetof(FileHeader, boundsMin) + 8) + "the bounds begin outside",
                [](F& f) { f.header().boundsMin[1] = -1e9; });
    expectFound(header(offsetof(FileHeader, boundsMax) + 16) + "the bounds end outside",
                [](F& f) { f.header().boundsMax[2] = 1e9; });
    expectFound("page 3: ", [](F& f) { f.entry(3).certifiedError = 0; });
    expectFound("its directory entry says", [](F& f) { f.entry(3).certifiedError *= 0.5f; });
    expectFound("page 4: ", [](F& f) { f.header().leaves -= 1, f.entry(4).leaves -= 1; });
    expectFound("page 4: ", [](F& f) { f.header().hardLeaves += 1, f.entry(4).hardLeaves += 1; });
    expectFound("page 0: ", [](F& f) { f.header().cell *= 2; });
}

/// A field of the header or of an entry, and whether any value of its kind is one that nothing else in the file
/// contradicts.
struct Field {
    const char* name;
    uint64_t offset;
    char kind;  ///< 'd', 'f', or an integer of '1', '4', '8' bytes
    bool free = false;
};

template <class T>
void put(Bytes& bytes, uint64_t at, T value) {
    std::memcpy(&bytes[at], &value, sizeof value);
}

/// The hostile values of a field, each put there.
std::vector<Bytes> hostileCopies(const Bytes& bytes, uint64_t at, char kind) {
    std::vector<Bytes> copies;
    const auto add = [&](auto value) {
        Bytes copy = bytes;
        put(copy, at, value);
        if (copy != bytes) copies.push_back(std::move(copy));
    };
    constexpr double kDoubles[] = {std::numeric_limits<double>::quiet_NaN(),
                                   std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity(),
                                   -5,
                                   0,
                                   1e-300,
                                   1e300,
                                   -1e300};
    for (const double value : kDoubles) {
        if (kind == 'd') add(value);
        if (kind == 'f') add(float(value));
    }
    constexpr uint64_t kIntegers[] = {0,
                                      1,
                                      2,
                                      7,
                                      8,
                                      31,
                                      0x7f,
                                      0x80,
                                      0xff,
                                      4096,
                                      0x7fffffff,
                                      0x80000000,
                                      0xffffff00,
                                      0xffffffff,
                                      0x7fffffffffffffff,
                                      0x8000000000000000,
                                      0xffffffffffffff00,
                                      ~uint64_t{0}};
    for (const uint64_t value : kIntegers) {
        if (kind == '1') add(uint8_t(value));
        if (kind == '4') add(uint32_t(value));
        if (kind == '8') add(value);
    }
    return copies;
}

TEST_F(VcpFile, HostileFieldsAreRefused) {
    std::vector<Field> header = {{"version", 8, '4'},
                                 {"headerBytes", 12, '4'},
                                 {"fileBytes", 16, '8'},
                                 {"pages", 24, '8'},
                                 {"cell", 56, 'd'},
                                 {"errorTarget", 64, 'd', true},
                                 {"certifiedErrorMax", 72, 'd'},
                                 {"levels", 128, '4'},
                                 {"log2Cells", 132, '4'},
                                 {"flags", 136, '4'},
                                 {"method", 140, '4'},
                                 {"triangles", 144, '8', true},
                                 {"degenerateTriangles", 152, '8'},
                                 {"vertices", 160, '8', true},
                                 {"leaves", 168, '8'},
                                 {"hardLeaves", 176, '8'}};
    for (uint64_t i = 0; i < 3; ++i) {
        header.push_back({"origin", 32 + 8 * i, 'd', true});
        header.push_back({"boundsMin", 80 + 8 * i, 'd', true});
        header.push_back({"boundsMax", 104 + 8 * i, 'd', true});
    }
    for (uint64_t l = 0; l < kMaxLevels; ++l) {
        header.push_back({"level.firstEntry", 184 + 24 * l, '8'});
        header.push_back({"level.pages", 184 + 24 * l + 8, '8'});
        header.push_back({"level.certifiedError", 184 + 24 * l + 16, 'd'});
    }
    for (uint64_t byte = sizeof(FileHeader) - sizeof(PaperParameters); byte < kDirectoryOffset; byte += 200)
        header.push_back({"rest", byte, '8'});
    const std::vector<Field> entry = {
        {"morton", 0, '8'},          {"offset", 8, '8'},       {"hash", 16, '8'},      {"colourOffset", 24, '8'},
        {"colourHash", 32, '8'},     {"storedBytes", 40, '4'}, {"pageBytes", 44, '4'}, {"colourStoredBytes", 48, '4'},
        {"colourBytes", 52, '4'},    {"firstChild", 56, '4'},  {"leaves", 60, '4'},    {"hardLeaves", 64, '4'},
        {"certifiedError", 68, 'f'}, {"childMask", 72, '1'},   {"level", 73, '1'},     {"reserved", 74, '1'},
        {"colourErrorP95", 75, '1'}, {"slabLeaves", 76, '4'}};
    const uint64_t before = test::peakBytes();
    uint64_t tried = 0;
    const auto sweep = [&](const std::vector<Field>& fields, uint64_t base) {
        for (const Field& field : fields)
            for (Bytes& copy : hostileCopies(bytes_, base + field.offset, field.kind)) {
                Forgery forgery{std::move(copy)};
                forgery.seal();
                const auto verified = verifyFile(MemoryFile(forgery.bytes));
                ++tried;
                if (!verified.ok()) {
                    ASSERT_EQ(verified.error().file, "memory.vcp");
                    ASSERT_TRUE(verified.error().byte.has_value()) << verified.error().line();
                    continue;
                }
                EXPECT_TRUE(field.free) << field.name << " at byte " << base + field.offset << " was accepted";
                // What is free is a number still.
                const FileHeader& h = forgery.header();
                for (const double value :
                     {h.errorTarget, h.origin[0], h.origin[1], h.origin[2], h.boundsMin[0], h.boundsMax[0]})
                    EXPECT_TRUE(std::isfinite(value)) << field.name;
                EXPECT_GE(h.errorTarget, 0);
            }
    };
    sweep(header, 0);
    for (const uint64_t page : {0, 1, 8}) sweep(entry, kDirectoryOffset + page * sizeof(PageEntry));
    EXPECT_GT(tried, 1000u);
    if (test::kMemoryIsMeasured) {
        EXPECT_LT(test::peakBytes() - before, 64u << 20);
    }
}

TEST_F(VcpFile, VerifyReportsAndStops) {
    uint64_t last = 0;
    const auto grow = [](void* user, uint64_t done) {
        EXPECT_GE(done, *static_cast<uint64_t*>(user));
        *static_cast<uint64_t*>(user) = done;
        return true;
    };
    ASSERT_TRUE(verifyFile(MemoryFile(bytes_), grow, &last).ok());
    EXPECT_GT(last, bytes_.size() - 512);
    EXPECT_LE(last, bytes_.size());
    const auto stopped = verifyFile(MemoryFile(bytes_), [](void*, uint64_t) { return false; });
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
}

TEST_F(VcpFile, OpenNamesWhatIsWrong) {
    const auto missing = openFile(folder_ / "none.vcp");
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::Io);
    EXPECT_NE(missing.error().line().find("none.vcp"), std::string::npos);
    const auto folder = openFile(folder_.path());
    ASSERT_FALSE(folder.ok());
    EXPECT_NE(folder.error().line().find("is a folder"), std::string::npos);
    fs::resize_file(path(), 0);
    auto empty = openFile(path());
    ASSERT_TRUE(empty.ok());
    const auto dataset = readDataset(**empty);
    ASSERT_FALSE(dataset.ok());
    EXPECT_NE(dataset.error().line().find("empty"), std::string::npos);
}

TEST(Morton, RoundTrip) {
    std::mt19937 random(3);
    for (int i = 0; i < 100000; ++i) {
        const glm::u32vec3 cell(random() & 0x1fffff, random() & 0x1fffff, random() & 0x1fffff);
        ASSERT_EQ(mortonDecode(mortonEncode(cell)), cell);
    }
    EXPECT_EQ(mortonEncode({1, 0, 0}), 1u);
    EXPECT_EQ(mortonEncode({0, 1, 0}), 2u);
    EXPECT_EQ(mortonEncode({0, 0, 1}), 4u);
    EXPECT_EQ(mortonEncode({3, 5, 6}), 0b110'101'011u);
    EXPECT_EQ(mortonEncode(glm::u32vec3(0x1fffff)), 0x7fffffffffffffffu);
    EXPECT_EQ(mortonDecode(0x7fffffffffffffffu), glm::u32vec3(0x1fffff));
}

TEST(Morton, SlowReference) {
    std::mt19937 random(4);
    for (int i = 0; i < 1000; ++i) {
        const glm::u32vec3 cell(random() & 0x1fffff, random() & 0x1fffff, random() & 0x1fffff);
        uint64_t code = 0;
        for (int bit = 0; bit < 21; ++bit)
            for (int axis = 0; axis < 3; ++axis) code |= uint64_t{cell[axis] >> bit & 1} << (3 * bit + axis);
        ASSERT_EQ(mortonEncode(cell), code);
        // A child's code is its parent's with the octant behind it.
        ASSERT_EQ(mortonEncode(cell / 2u), code >> 3);
    }
}

TEST_F(VcpFile, SameInputSameBytes) {
    writeSphere(folder_ / "again.vcp");
    EXPECT_EQ(bytesOf(folder_ / "again.vcp"), bytes_);
}

TEST_F(VcpFile, AbandonedWriterLeavesNothing) {
    {
        auto writer = VcpWriter::create(path(), 1);
        ASSERT_TRUE(writer.ok());
        EXPECT_TRUE(fs::exists(folder_ / "sphere.vcp.partial"));
        EXPECT_EQ(bytesOf(path()), bytes_) << "the old file stays whole until the new one is";
    }
    EXPECT_FALSE(fs::exists(folder_ / "sphere.vcp.partial"));
    EXPECT_EQ(bytesOf(path()), bytes_);
}

TEST_F(VcpFile, CommitReplacesTheOldFile) {
    writeSphere(path(), {3, 3.2, 2.9}, 1.2);
    EXPECT_NE(bytesOf(path()), bytes_);
    EXPECT_TRUE(verifyFile(MemoryFile(bytesOf(path()))).ok());
    EXPECT_FALSE(fs::exists(folder_ / "sphere.vcp.partial"));
}

TEST_F(VcpFile, WriterRefusesWrongPlaces) {
    const auto inFolder = VcpWriter::create(folder_.path(), 1);
    ASSERT_FALSE(inFolder.ok());
    EXPECT_EQ(inFolder.error().code, ErrorCode::Io);
    EXPECT_NE(inFolder.error().line().find("is a folder"), std::string::npos);
    const auto noFolder = VcpWriter::create(folder_ / "none" / "out.vcp", 1);
    ASSERT_FALSE(noFolder.ok());
    EXPECT_NE(noFolder.error().line().find("No such file"), std::string::npos) << noFolder.error().line();
    const auto underFile = VcpWriter::create(path() / "out.vcp", 1);
    ASSERT_FALSE(underFile.ok());
    EXPECT_NE(underFile.error().line().find("sphere.vcp"), std::string::npos);
}

TEST_F(VcpFile, UnwritableFolder) {
    fs::create_directory(folder_ / "locked");
    fs::permissions(folder_ / "locked",
                    fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_exec | fs::perms::others_read);
    fs::permissions(folder_.path(), fs::perms::others_exec, fs::perm_options::add);
    // Root may write anywhere, so a child that is nobody tries.
    const pid_t child = fork();
    if (child == 0) {
        if (geteuid() == 0 && seteuid(65534) != 0) _exit(3);
        const auto writer = VcpWriter::create(folder_ / "locked" / "out.vcp", 1);
        const bool said = !writer.ok() && writer.error().code == ErrorCode::Io &&
                          writer.error().line().find("Permission denied") != std::string::npos &&
                          writer.error().line().find("out.vcp") != std::string::npos;
        _exit(said ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == 3) GTEST_SKIP() << "cannot become another user here";
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_TRUE(fs::is_empty(folder_ / "locked"));
}

/// A place for few bytes: a 64 KiB file system where one may be mounted, else a limit on the size of files.
class SmallDisk {
public:
    explicit SmallDisk(const fs::path& folder) : folder_(folder) {
        fs::create_directory(folder);
        mounted_ = mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=64k") == 0;
        if (!mounted_) limit_.emplace(64 << 10);
    }
    ~SmallDisk() {
        if (mounted_) umount(folder_.c_str());
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    [[nodiscard]] bool mounted() const { return mounted_; }

private:
    fs::path folder_;
    bool mounted_ = false;
    std::optional<test::FileSizeLimit> limit_;
};

TEST_F(VcpFile, FullDisk) {
    const fs::path out = folder_ / "small" / "out.vcp";
    const SmallDisk disk(folder_ / "small");
    // A first file fits and must survive the second, which does not.
    writeSphere(out);
    const Bytes before = bytesOf(out);
    {
        auto writer = VcpWriter::create(out, 100);
        ASSERT_TRUE(writer.ok()) << writer.error().line();
        std::mt19937 random(1);
        StoredPage page;
        page.geometry.resize(4000);
        for (std::byte& b : page.geometry) b = std::byte(random());
        page.geometryBytes = 4000;
        Result<void> result;
        for (int i = 0; i < 100 && result.ok(); ++i) result = (*writer)->append({}, page);
        ASSERT_FALSE(result.ok());
        EXPECT_EQ(result.error().code, ErrorCode::Io);
        EXPECT_NE(result.error().line().find("out.vcp: write failed"), std::string::npos) << result.error().line();
        if (disk.mounted()) {
            EXPECT_NE(result.error().line().find("free some space"), std::string::npos) << result.error().line();
        }
    }
    EXPECT_FALSE(fs::exists(out.string() + ".partial"));
    EXPECT_EQ(bytesOf(out), before);
}

}  // namespace
}  // namespace vcp
