// Datasets in shards: the one file comes back byte for byte, whatever is read of it; opening does not depend on how
// many shards there are; what is damaged or does not belong together is named.
#include "streaming/shard/sharded_reader.h"

#include <atomic>
#include <cstring>
#include <fstream>
#include <random>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "octree/io/content_hash.h"
#include "octree/vcp_writer.h"
#include "streaming/shard/shard_folder.h"
#include "streaming/web_address.h"
#include "tests/support/directory_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::byte>;

/// A file around a random tree; its pages are noise, with right hashes.
Bytes fileOf(uint64_t seed, uint32_t levels, double density) {
    Dataset tree = test::randomTree(seed, levels, density, 6000);
    Bytes bytes = test::directoryFile(tree);
    std::mt19937_64 random(seed);
    const auto fill = [&](uint64_t offset, uint32_t size) {
        for (uint64_t i = 0; i < size; ++i) bytes[offset + i] = std::byte(random() & 255u);
        return hashBytes(std::span(bytes).subspan(offset, size));
    };
    for (PageEntry* e = &tree.pages[0]; e != &tree.pages[0] + tree.pages.size(); ++e) {
        e->hash = fill(e->offset, e->storedBytes);
        if (e->colourStoredBytes != 0) e->colourHash = fill(e->colourOffset, e->colourStoredBytes);
        const auto i = uint64_t(e - &tree.pages[0]);
        std::memcpy(&bytes[blockOffset(i / kEntriesPerBlock) + i % kEntriesPerBlock * sizeof(PageEntry)], e, sizeof *e);
    }
    test::sealFile(bytes);
    return bytes;
}

Bytes contentBytes(const fs::path& path) {
    const std::string text = contentOf(path);
    Bytes bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

Bytes allOf(const ByteReader& reader) {
    Bytes bytes(reader.size());
    const auto read = reader.read(0, bytes);
    EXPECT_TRUE(read.ok()) << read.error().line();
    return bytes;
}

class Shards : public ::testing::Test {
protected:
    ShardReport split(const Bytes& file, uint64_t shardBytes, const std::string& name = "shards") const {
        const auto report = writeShards(test::CountedFile(file), {.folder = folder_ / name, .shardBytes = shardBytes});
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? *report : ShardReport{};
    }
    std::shared_ptr<const ByteReader> opened(const std::string& name = "shards") const {
        auto reader = openDatasetFile(folder_ / name);
        EXPECT_TRUE(reader.ok()) << reader.error().line();
        return reader ? *reader : nullptr;
    }
    std::vector<fs::path> shardFiles(const std::string& name = "shards") const {
        std::vector<fs::path> files;
        for (const auto& entry : fs::directory_iterator(folder_ / name))
            if (isShardName(entry.path().filename().string())) files.push_back(entry.path());
        std::sort(files.begin(), files.end());
        return files;
    }

    TestFolder folder_{"vcp_shards"};
};

TEST_F(Shards, AreReadAsTheOneFile) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
        const Bytes file = fileOf(seed, 2 + uint32_t(seed % 5), seed % 3 == 0 ? 0.5 : 0.35);
        const uint64_t shardBytes = file.size() / (1 + 3 * seed) + 5000;
        const ShardReport report = split(file, shardBytes);
        const auto reader = opened();
        ASSERT_NE(reader, nullptr);
        ASSERT_TRUE(allOf(*reader) == file) << "seed " << seed << ", " << report.shards << " shards";
        std::mt19937_64 random(seed);
        for (int i = 0; i < 500; ++i) {
            const uint64_t from = random() % file.size();
            Bytes part(random() % std::min<uint64_t>(file.size() - from, 1 + (random() % 2 == 0 ? 300 : 60000)));
            ASSERT_TRUE(reader->read(from, part).ok());
            ASSERT_TRUE(std::equal(part.begin(), part.end(), file.begin() + std::ptrdiff_t(from))) << from;
        }
        std::byte behind;
        EXPECT_FALSE(reader->read(file.size(), {&behind, 1}).ok());
    }
}

TEST_F(Shards, AreFilesOfTheirOwnAndNoLargerThanAskedFor) {
    const Bytes file = fileOf(5, 6, 0.45);
    const auto whole = readDataset(test::CountedFile(file));
    ASSERT_TRUE(whole.ok());
    const uint64_t shardBytes = file.size() / 20;
    const ShardReport report = split(file, shardBytes);
    EXPECT_GT(report.shards, 20u);
    uint64_t pages = 0, bytes = 0;
    for (const fs::path& path : shardFiles()) {
        const auto shard = readDataset(**openFile(path));
        ASSERT_TRUE(shard.ok()) << shard.error().line();
        pages += shard->header.pages;
        bytes += fs::file_size(path);
        // Header, blocks and commit record come on top.
        EXPECT_LE(fs::file_size(path), shardBytes + 3 * kBlockBytes);
        EXPECT_EQ(shard->cellOf(0), shard->edgeOf(shard->pages[0]) / 32);
    }
    EXPECT_EQ(pages, whole->header.pages + report.shards - 1) << "a page is twice where a shard begins with it";
    EXPECT_EQ(bytes + fs::file_size(folder_ / "shards/manifest.vcps"), report.bytes);
    const auto reader = opened();
    const auto* sharded = dynamic_cast<const ShardedReader*>(reader.get());
    ASSERT_NE(sharded, nullptr);
    EXPECT_TRUE(verifyShards(*sharded, [](double) { return true; }).ok());
    EXPECT_EQ(verifyShards(*sharded, [](double) { return false; }).error().code, ErrorCode::Cancelled);
}

TEST_F(Shards, OneShardIsTheFileItself) {
    const Bytes file = fileOf(3, 3, 0.4);
    EXPECT_EQ(split(file, file.size()).shards, 1u);
    EXPECT_TRUE(contentBytes(shardFiles().at(0)) == file);
    EXPECT_TRUE(allOf(*opened()) == file);
}

TEST_F(Shards, AreKeptWhereTheyStayTheSame) {
    Bytes file = fileOf(5, 6, 0.45);
    const uint64_t shards = split(file, file.size() / 20).shards;
    EXPECT_EQ(split(file, file.size() / 20).shardsKept, shards);
    // Another page at the end of the file: its shard is another one, and so are the first, which has the counts.
    auto whole = readDataset(test::CountedFile(file));
    PageEntry last = whole->pages[whole->header.pages - 1];
    file[last.offset] ^= std::byte{1};
    last.hash = hashBytes(std::span(file).subspan(last.offset, last.storedBytes));
    const uint64_t i = whole->header.pages - 1;
    std::memcpy(&file[blockOffset(i / kEntriesPerBlock) + i % kEntriesPerBlock * sizeof last], &last, sizeof last);
    test::sealFile(file);
    const ShardReport again = split(file, file.size() / 20);
    EXPECT_EQ(again.shards, shards);
    EXPECT_EQ(again.shardsKept, shards - 1);
    EXPECT_EQ(shardFiles().size(), shards);
    EXPECT_TRUE(allOf(*opened()) == file);
}

TEST_F(Shards, ADamagedShardIsWrittenAnew) {
    const Bytes file = fileOf(5, 5, 0.45);
    const uint64_t shards = split(file, file.size() / 8).shards;
    const fs::path damaged = shardFiles().at(2);
    std::string content = contentOf(damaged);
    content[content.size() / 2] = char(content[content.size() / 2] ^ 1);
    std::ofstream(damaged, std::ios::binary) << content;
    EXPECT_EQ(split(file, file.size() / 8).shardsKept, shards - 1);
    EXPECT_TRUE(allOf(*opened()) == file);
}

TEST_F(Shards, AFolderWithSomethingElseIsNotReplaced) {
    const Bytes file = fileOf(3, 3, 0.4);
    split(file, file.size());
    std::ofstream(folder_ / "shards/notes.txt") << "mine";
    const auto report = writeShards(test::CountedFile(file), {.folder = folder_ / "shards"});
    ASSERT_FALSE(report.ok());
    EXPECT_NE(report.error().line().find("notes.txt"), std::string::npos) << report.error().line();
    EXPECT_EQ(contentOf(folder_ / "shards/notes.txt"), "mine");
}

TEST_F(Shards, CancellingLeavesNothing) {
    const Bytes file = fileOf(3, 4, 0.4);
    int calls = 0;
    const auto report = writeShards(test::CountedFile(file), {.folder = folder_ / "shards",
                                                              .shardBytes = file.size() / 4,
                                                              .progress = [&](double) { return ++calls < 20; }});
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::Cancelled);
    EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(Shards, DamageIsNamed) {
    // So large that its manifest does not keep all of the directory.
    const Bytes file = fileOf(5, 7, 0.5);
    split(file, file.size() / 10);
    const auto files = shardFiles();
    const auto shard = *std::max_element(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        return fs::file_size(a) < fs::file_size(b);
    });
    const uint64_t blocks = readDataset(**openFile(shard))->pages.blocks();
    const auto said = [&]() -> std::string {
        const auto reader = openDatasetFile(folder_ / "shards");
        if (!reader) return reader.error().line();
        Bytes bytes((*reader)->size());
        if (const auto read = (*reader)->read(0, bytes); !read) return read.error().line();
        const auto* sharded = dynamic_cast<const ShardedReader*>(reader->get());
        const auto checked = verifyShards(*sharded, [](double) { return true; });
        return checked ? "intact" : checked.error().line();
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    };
    EXPECT_EQ(said(), "intact");
    const std::string content = contentOf(shard);
    const auto put = [](const fs::path& path, const std::string& text) {
        std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
    };
    put(shard, content + "x");
    EXPECT_TRUE(has(said(), shard.string()) && has(said(), "another file")) << said();
    std::string changed = content;
    changed[blockOffset(blocks - 1)] = char(changed[blockOffset(blocks - 1)] ^ 1);
    put(shard, changed);
    EXPECT_TRUE(has(said(), shard.string()) && has(said(), fmt::format("directory block {}", blocks - 1))) << said();
    changed = content;
    changed[5] = char(changed[5] ^ 1);
    put(shard, changed);
    EXPECT_TRUE(has(said(), shard.string()) && has(said(), "its name stands for")) << said();
    fs::remove(shard);
    EXPECT_TRUE(has(said(), shard.string())) << said();
    put(shard, content);
    EXPECT_EQ(said(), "intact");
    const fs::path manifest = folder_ / "shards/manifest.vcps";
    const std::string rows = contentOf(manifest);
    put(manifest, rows.substr(0, rows.size() - 1));
    EXPECT_TRUE(has(said(), "manifest.vcps") && has(said(), "shorter or longer")) << said();
}

// As on a server that does not answer: opening lasts until it is cancelled, and whoever waits for it is told, too.
TEST_F(Shards, OpeningIsInterruptedAndLaterReadsWork) {
    const Bytes file = fileOf(3, 4, 0.4);
    split(file, file.size() / 5);
    std::atomic<int> opening = 0;
    std::atomic<bool> isStalled = true;
    const auto openShard = [&](const ShardRow& row, bool,
                               const std::function<bool()>& cancelled) -> Result<std::shared_ptr<const ByteReader>> {
        ++opening;
        while (isStalled && !cancelled()) std::this_thread::yield();
        if (cancelled()) return Error::cancelled(shardName(row));
        VCP_TRY_ASSIGN(auto shard, openFile(folder_ / "shards" / shardName(row)));
        return std::shared_ptr<const ByteReader>(shard);
    };
    const auto reader = ShardedReader::open(*openFile(folder_ / "shards/manifest.vcps"), openShard);
    ASSERT_TRUE(reader.ok()) << reader.error().line();
    std::vector<Result<void>> ends(4, Result<void>());
    std::vector<std::thread> threads;
    for (Result<void>& end : ends)
        threads.emplace_back([&] {
            Bytes whole(file.size());
            end = (*reader)->read(0, whole);
        });
    while (opening == 0) std::this_thread::yield();
    // A read that has not come so far is not under way; it is interrupted in its turn.
    std::atomic<bool> done = false;
    std::thread interrupting([&] {
        while (!done) {
            (*reader)->interrupt();
            std::this_thread::yield();
        }
    });
    for (std::thread& thread : threads) thread.join();
    done = true;
    interrupting.join();
    for (const Result<void>& end : ends) {
        ASSERT_FALSE(end.ok());
        EXPECT_EQ(end.error().code, ErrorCode::Cancelled);
    }
    isStalled = false;
    EXPECT_TRUE(allOf(**reader) == file);
}

TEST_F(Shards, EveryBitOfAManifestCounts) {
    const Bytes file = fileOf(2, 4, 0.4);
    split(file, file.size() / 5);
    const fs::path manifest = folder_ / "shards/manifest.vcps";
    const Bytes intact = contentBytes(manifest);
    for (size_t bit = 0; bit < 8 * intact.size(); bit += 7) {
        Bytes bytes = intact;
        bytes[bit / 8] ^= std::byte{1} << int(bit % 8);
        auto reader = ShardedReader::open(
            std::make_shared<test::CountedFile>(bytes),
            [&](const ShardRow& row, bool, const std::function<bool()>&) -> Result<std::shared_ptr<const ByteReader>> {
                VCP_TRY_ASSIGN(auto shard, openFile(folder_ / "shards" / shardName(row)));
                return std::shared_ptr<const ByteReader>(shard);
            });
        if (!reader) continue;
        Bytes whole((*reader)->size());
        EXPECT_FALSE((*reader)->read(0, whole).ok()) << "bit " << bit;
    }
}

/// Lies behind right hashes: whatever rows say, reading ends in an error or in bytes, and reads no byte that is not
/// there.
TEST_F(Shards, HostileRowsReadNothingThatIsNotThere) {
    const Bytes file = fileOf(2, 4, 0.4);
    split(file, file.size() / 5);
    const Bytes intact = contentBytes(folder_ / "shards/manifest.vcps");
    ManifestHeader header;
    std::memcpy(&header, intact.data(), sizeof header);
    std::vector<ShardRow> shards(header.shards);
    std::vector<PageRun> runs(header.runs);
    // Nothing is kept, so that the directory is made from the rows.
    const std::vector<KeptBlock> kept;
    const uint64_t rows = kManifestTables + sizeof(RunFence) + header.keptBlocks * (sizeof(uint64_t) + kBlockBytes);
    ASSERT_LE(header.runs, kManifestBlockRows);
    std::memcpy(shards.data(), &intact[rows], shards.size() * sizeof(ShardRow));
    std::memcpy(runs.data(), &intact[rows + shards.size() * sizeof(ShardRow) + 8], runs.size() * sizeof(PageRun));
    std::mt19937_64 random(1);
    const auto hostile = [&](void* row) {
        uint64_t words[kManifestRowBytes / 8];
        std::memcpy(words, row, sizeof words);
        uint64_t& word = words[random() % std::size(words)];
        const uint64_t values[] = {0,        1,          ~uint64_t{0},    random(), word + 1,
                                   word - 1, word + 256, random() % 4096, word << 1};
        word = values[random() % std::size(values)];
        std::memcpy(row, words, sizeof words);
    };
    std::map<std::string, std::shared_ptr<test::CountedFile>> files;
    for (const ShardRow& row : shards)
        files[shardName(row)] = std::make_shared<test::CountedFile>(contentBytes(folder_ / "shards" / shardName(row)));
    int opened = 0;
    for (int round = 0; round < 3000; ++round) {
        auto manyShards = shards;
        auto manyRuns = runs;
        for (int i = 0; i < 1 + round % 3; ++i)
            if (random() % 2 == 0)
                hostile(&manyShards[random() % manyShards.size()]);
            else
                hostile(&manyRuns[random() % manyRuns.size()]);
        const Bytes bytes = storedManifest(header, std::span(intact).subspan(kDirectoryOffset, kDirectoryOffset),
                                           manyShards, manyRuns, kept);
        auto reader = ShardedReader::open(
            std::make_shared<test::CountedFile>(bytes),
            [&](const ShardRow& row, bool, const std::function<bool()>&) -> Result<std::shared_ptr<const ByteReader>> {
                const auto shard = files.find(shardName(row));
                if (shard == files.end()) return Error{.code = ErrorCode::Io, .message = "is not there", .file = "x"};
                return std::shared_ptr<const ByteReader>(shard->second);
            });
        if (!reader) continue;
        ++opened;
        // The pages are read also where the directory is refused.
        static_cast<void>(readDataset(**reader));
        const uint64_t begin = blockOffset(blocksOf((*reader)->manifest().fileHeader().pages));
        Bytes rest((*reader)->size() - begin);
        const auto read = (*reader)->read(begin, rest);
        EXPECT_TRUE(read.ok() || read.error().message != "past the end") << round;
        (*reader)->distrust(0, (*reader)->size());
    }
    EXPECT_GT(opened, 1000);
}

/// A tree of four children a page that is so large that nobody has it: its shards make what is read of them.
class EndlessShards {
public:
    /// `levels` in all; shards begin at the pages of every `step`th level.
    EndlessShards(uint32_t levels, uint32_t step) : levels_(levels), step_(step) {
        for (uint32_t level = 0; level < levels; ++level) pages_ += count(level);
    }

    [[nodiscard]] uint64_t pages() const { return pages_; }
    [[nodiscard]] uint64_t shards() const { return shardCount_; }

    Bytes manifest() {
        FileHeader header;
        header.levels = levels_;
        header.log2Cells = 5;
        header.cell = 1;
        for (int axis = 0; axis < 3; ++axis) header.boundsMax[axis] = 1;
        header.pages = pages_;
        uint64_t next = 0;
        for (uint32_t level = 0; level < levels_; ++level) {
            header.level[level] = {next, count(level), 1};
            next += count(level);
        }
        header.certifiedErrorMax = 1;
        const uint64_t pagesBegin = alignPage(blockOffset(blocksOf(pages_)));
        header.fileBytes = pagesBegin + pages_ * kPageAlignment + sizeof(CommitRecord);
        Bytes first(kDirectoryOffset);
        std::memcpy(first.data(), &header, sizeof header);
        header.hash = hashBytes(first);
        std::memcpy(first.data(), &header, sizeof header);
        ManifestHeader manifest;
        manifest.commit.fileBytes = header.fileBytes;
        manifest.commit.headerHash = header.hash;
        seal(manifest.commit);

        // The shard of a page is that of its ancestor on the last level before its own on which shards begin.
        std::vector<ShardRow> shards;
        std::vector<uint64_t> firstShardOf(levels_, 0);
        for (uint32_t level = 0; level + 1 < levels_; level += step_) {
            firstShardOf[level] = shards.size();
            for (uint64_t i = 0; i < count(level); ++i) shards.push_back(shardRow(level, i));
        }
        std::vector<PageRun> runs;
        uint64_t page = 0;
        for (uint32_t level = 0; level < levels_; ++level) {
            const uint32_t from = level == 0 ? 0 : (level - 1) / step_ * step_;
            const uint64_t ofShard = level == 0 ? 1 : count(level - from);
            const bool isCut = level > 0 && level % step_ == 0 && level + 1 < levels_;
            for (uint64_t i = 0; i < count(level); i += isCut ? 1 : ofShard) {
                PageRun run;
                run.firstPage = page + i;
                run.offset = pagesBegin + run.firstPage * kPageAlignment;
                run.shard = uint32_t(firstShardOf[from] + i / ofShard);
                run.shardPage = uint32_t(before(level - from) + i % ofShard);
                run.shardOffset = offsetIn(shards[run.shard], run.shardPage);
                const uint64_t firstChild = page + count(level) + 4 * i;
                run.childMask = isCut ? 0x0f : 0;
                run.firstChild = isCut ? int64_t(firstChild)
                                       : int64_t(firstChild) - int64_t(before(level - from + 1) + 4 * (i % ofShard));
                runs.push_back(run);
            }
            page += count(level);
        }
        // What is kept is what a reader puts together without it.
        const auto plain =
            *ShardedReader::open(std::make_shared<test::CountedFile>(storedManifest(manifest, first, shards, runs, {})),
                                 [&](const ShardRow& row, bool, const std::function<bool()>&) { return open(row); });
        std::vector<KeptBlock> kept;
        for (const uint64_t block : blocksToKeep(runs, pages_)) {
            kept.push_back({block, Bytes(kBlockBytes)});
            EXPECT_TRUE(plain->read(blockOffset(block), kept.back().bytes).ok());
        }
        if (kept.size() == blocksOf(pages_)) {
            Bytes directory;
            for (const KeptBlock& block : kept)
                directory.insert(directory.end(), block.bytes.begin(), block.bytes.end());
            manifest.commit.directoryHash = hashBytes(directory);
            seal(manifest.commit);
        }
        return storedManifest(manifest, first, shards, runs, kept);
    }

    [[nodiscard]] Result<std::shared_ptr<const ByteReader>> open(const ShardRow& row) const {
        return std::shared_ptr<const ByteReader>(std::make_shared<Shard>(*this, row));
    }

    /// Entries of a shard, made as they are read.
    class Shard final : public ByteReader {
    public:
        Shard(const EndlessShards& all, ShardRow row) : all_(all), row_(row) {}
        Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
            ++all_.reads;
            std::fill(bytes.begin(), bytes.end(), std::byte{0});
            if (offset < kDirectoryOffset || offset % kBlockBytes != 0 || bytes.size() % kBlockBytes != 0) return {};
            for (uint64_t at = 0; at < bytes.size(); at += kBlockBytes)
                fill((offset + at) / kBlockBytes - 1, &bytes[at]);
            return {};
        }
        [[nodiscard]] uint64_t size() const override { return row_.bytes; }
        [[nodiscard]] const std::string& name() const override { return name_; }

    private:
        void fill(uint64_t block, std::byte* to) const {
            const uint32_t levels = all_.levelsFrom(row_.level);
            for (uint64_t i = 0; i < kEntriesPerBlock; ++i) {
                const uint64_t page = block * kEntriesPerBlock + i;
                if (page >= row_.pages) break;
                PageEntry entry;
                while (page >= before(entry.level + 1u)) ++entry.level;
                const uint64_t inLevel = page - before(entry.level);
                for (uint32_t digit = 0; digit < entry.level; ++digit)
                    entry.morton |= (inLevel >> 2 * digit & 3u) << 3 * digit;
                entry.offset = offsetIn(row_, page);
                entry.storedBytes = kPageAlignment;
                entry.pageBytes = 1024;
                entry.certifiedError = 1;
                if (entry.level + 1u < levels) {
                    entry.childMask = 0x0f;
                    entry.firstChild = uint32_t(before(entry.level + 1u) + 4 * inLevel);
                }
                std::memcpy(to + i * sizeof entry, &entry, sizeof entry);
            }
            const uint64_t hash = hashBytes({to, kBlockBytes - 8});
            std::memcpy(to + kBlockBytes - 8, &hash, 8);
        }
        const EndlessShards& all_;
        ShardRow row_;
        std::string name_ = "endless";
    };

    mutable uint64_t reads = 0;

private:
    static void seal(CommitRecord& commit) {
        commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    }
    static uint64_t count(uint32_t level) { return uint64_t{1} << 2 * level; }
    static uint64_t before(uint32_t level) { return (count(level) - 1) / 3; }
    static uint64_t offsetIn(const ShardRow& row, uint64_t page) {
        return alignPage(blockOffset(blocksOf(row.pages))) + page * kPageAlignment;
    }
    /// Levels of a shard that begins on one: its first page's, and those up to where the next shards begin.
    [[nodiscard]] uint32_t levelsFrom(uint32_t level) const { return std::min(step_ + 1, levels_ - level); }
    [[nodiscard]] ShardRow shardRow(uint32_t level, uint64_t number) {
        ShardRow row;
        row.name[0] = shardCount_++;
        row.pages = before(levelsFrom(level));
        row.bytes = offsetIn(row, row.pages) + sizeof(CommitRecord);
        for (uint32_t digit = 0; digit < level; ++digit) row.morton |= (number >> 2 * digit & 3u) << 3 * digit;
        row.level = level;
        return row;
    }

    uint32_t levels_, step_;
    uint64_t pages_ = 0, shardCount_ = 0;
};

struct FirstPicture {
    uint64_t pages, shards, manifestReads, manifestBytes, shardReads;
};

/// Reads what a first picture needs, and follows one branch to its end.
FirstPicture firstPictureOf(uint32_t levels) {
    EndlessShards endless(levels, 4);
    const auto manifest = std::make_shared<test::CountedFile>(endless.manifest());
    uint64_t shardsOpened = 0;
    const auto reader = *ShardedReader::open(manifest, [&](const ShardRow& row, bool, const std::function<bool()>&) {
        ++shardsOpened;
        return endless.open(row);
    });
    endless.reads = 0;
    const auto dataset = readDatasetStart(*reader);
    EXPECT_TRUE(dataset.ok()) << dataset.error().line();
    Bytes page(kPageAlignment);
    EXPECT_TRUE(reader->read(dataset->pages[0].offset, page).ok());
    EXPECT_EQ(shardsOpened, 1u);
    const FirstPicture first{endless.pages(), endless.shards(), manifest->reads, manifest->bytesRead, endless.reads};

    // Down one branch, block by block.
    uint64_t at = 0;
    for (uint32_t level = 0; level + 1 < levels; ++level) {
        at = childIn(dataset->pages[at], level % 4);
        const uint64_t block = at / kEntriesPerBlock;
        Bytes bytes(kBlockBytes);
        EXPECT_TRUE(reader->read(blockOffset(block), bytes).ok());
        const auto admitted = admitBlock(*dataset, reader->name(), block, bytes);
        EXPECT_TRUE(admitted.ok()) << admitted.error().line();
        if (!admitted) break;
        EXPECT_EQ(dataset->pages[at].level, level + 1);
    }
    EXPECT_EQ(dataset->pages[at].childMask, 0);
    EXPECT_LE(shardsOpened, 1 + 2 * levels);
    return first;
}

TEST(EndlessShards, AFirstPictureTakesTheSameHoweverManyThereAre) {
    const FirstPicture few = firstPictureOf(9), many = firstPictureOf(13);
    // Directories that are read whole: of 341 and of 1365 pages.
    for (const uint32_t levels : {5u, 6u}) EXPECT_LE(firstPictureOf(levels).shardReads, few.shardReads);
    EXPECT_GT(few.pages, 80'000u);
    EXPECT_GT(many.pages, 20'000'000u);
    EXPECT_GT(many.shards, 60'000u);
    EXPECT_EQ(many.manifestReads, few.manifestReads);
    EXPECT_EQ(many.shardReads, few.shardReads);
    // The places of blocks of runs, and the numbers of what is kept.
    EXPECT_LT(many.manifestBytes, few.manifestBytes + many.shards);
}

TEST(AddressBeside, ReplacesTheNameAndKeepsTheQuery) {
    EXPECT_EQ(addressBeside("https://host/scan/manifest.vcps", "a.vcp"), "https://host/scan/a.vcp");
    EXPECT_EQ(addressBeside("https://u:p@host/manifest.vcps?key=a/b#c", "a.vcp"), "https://u:p@host/a.vcp?key=a/b#c");
    EXPECT_EQ(addressBeside("http://host", "a.vcp"), "http://host/a.vcp");
    EXPECT_EQ(addressBeside("http://host?key=/", "a.vcp"), "http://host/a.vcp?key=/");
}

TEST_F(Shards, ManyThreadsReadAtOnce) {
    const Bytes file = fileOf(5, 6, 0.45);
    const ShardReport report = split(file, file.size() / 60);
    EXPECT_GT(report.shards, ShardedReader::kMostOpen);
    const auto reader = opened();
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (uint64_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            std::mt19937_64 random(t);
            for (int i = 0; i < 300; ++i) {
                const uint64_t from = random() % file.size();
                Bytes part(random() % std::min<uint64_t>(file.size() - from, 20000));
                if (i % 50 == 0) reader->interrupt();
                const auto read = reader->read(from, part);
                // Another thread's interruption may end it.
                const bool isRight = read ? std::equal(part.begin(), part.end(), file.begin() + std::ptrdiff_t(from))
                                          : read.error().code == ErrorCode::Cancelled;
                if (!isRight) ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace vcp
