// The manifest of a dataset that is kept in shards: which part of the one .vcp file, whose parts the shards are, is in
// which of them.
//
// A shard is a .vcp file of its own: a page and what is below it, up to where other shards begin. The page that it
// begins with is also in the shard above, where it has no children; the one file has it from there. Shard 0 begins with
// the coarsest page, and has the images.
//
//   0       ManifestHeader, zero up to byte 4096
//   4096    the header of the one file, as it stands there
//   8192    16 bytes for each block of runs: the page and the offset that it begins with; 8 bytes for each block of the
//           directory that is kept here, its number. Their hash is in the header
//   ...     the blocks of the directory that are kept here, as the one file has them
//   ...     blocks of 48-byte rows, each behind the one before it, with a hash: the shards, then the runs
//
// A run is of pages that follow each other in the one file and in a shard. Runs are in the order of the one file. Kept
// are the blocks of the directory that are read when a file is opened, and those that would have to be put together
// from several shards. So what a first picture needs is in front, however many shards there are, and readers fetch the
// rest as they need it. All numbers little endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"

namespace vcp {

/// The name that a manifest has in its folder.
inline constexpr const char* kManifestName = "manifest.vcps";
inline constexpr uint64_t kManifestRowBytes = 48;
inline constexpr uint64_t kManifestBlockRows = 341;
inline constexpr uint64_t kManifestTables = 8192;  ///< where the tables begin
/// Returns how many blocks of the directory are read when a file is opened, of so many.
constexpr uint64_t leadBlocks(uint64_t blocks) {
    return blocks * kBlockBytes <= wholeDirectoryBytes(kLeadBytes) ? blocks : kLeadBytes / kBlockBytes - 1;
}
/// Other blocks are kept where they have entries of more shards.
inline constexpr uint32_t kMostShardsOfBlock = 6;

struct ManifestHeader {
    char magic[8] = {'V', 'C', 'P', 's', 'h', 'r', 'd', '\n'};
    uint32_t version = 1;
    uint32_t reserved = 0;
    uint64_t shards = 0;       ///< at least 1
    uint64_t runs = 0;         ///< at least 1
    uint64_t keptBlocks = 0;   ///< of the directory
    uint64_t shardImages = 0;  ///< where the images of shard 0 begin in it; 0 where there are none
    uint64_t tileTable = 0;    ///< from there, where the table of tiles begins
    uint64_t tiles = 0;        ///< its rows
    CommitRecord commit;       ///< of the one file
    uint64_t fencesHash = 0;   ///< XXH3-64 of what stands before the kept blocks, from byte 8192
    uint64_t hash = 0;         ///< XXH3-64 of the first 8192 bytes with this field zero
};

struct ShardRow {
    uint64_t name[2] = {};  ///< XXH3-128 of its bytes, the low half first
    uint64_t bytes = 0;
    uint64_t pages = 0;
    uint64_t morton = 0;  ///< of the page that it begins with
    uint32_t level = 0;   ///< of that page
    uint32_t reserved = 0;
};
static_assert(sizeof(ShardRow) == kManifestRowBytes);

struct PageRun {
    uint64_t firstPage = 0;    ///< entry of its first page in the one file
    uint64_t offset = 0;       ///< of that page in the one file
    uint64_t shardOffset = 0;  ///< of that page in the shard
    /// Where childMask is zero, what is added to an entry's first child in the shard; else the page's first child.
    int64_t firstChild = 0;
    uint32_t shard = 0;
    uint32_t shardPage = 0;  ///< entry of the first page in the shard
    /// Not zero: the run is of one page, with which another shard begins, and which has these children there.
    uint8_t childMask = 0;
    uint8_t reserved[7] = {};
};
static_assert(sizeof(PageRun) == kManifestRowBytes);

/// Where a block of runs begins.
struct RunFence {
    uint64_t firstPage = 0, offset = 0;
};
static_assert(sizeof(RunFence) == 16);

/// The name of the file of a shard: 32 hexadecimal digits and ".vcp".
std::string shardName(const ShardRow& shard);
/// Whether a file's name is that of a shard.
bool isShardName(std::string_view name);

/// A run, and where it ends in the one file.
struct RunPlace {
    PageRun run;
    uint64_t endPage = 0, endOffset = 0;
};

/// A manifest whose rows are read as they are asked for; a bounded number of blocks stays in memory. Any thread.
class ShardManifest {
public:
    /// Reads the beginning and checks it. The rest may be hostile still: each row is checked as it is read. Errors:
    /// InvalidInput, Unsupported, Io.
    static Result<std::unique_ptr<ShardManifest>> open(std::shared_ptr<const ByteReader> reader);

    [[nodiscard]] const ManifestHeader& header() const { return header_; }
    /// The first 4096 bytes of the one file; checked.
    [[nodiscard]] std::span<const std::byte> fileHeaderBytes() const { return fileHeaderBytes_; }
    [[nodiscard]] const FileHeader& fileHeader() const { return fileHeader_; }
    /// Where the pages of the one file end.
    [[nodiscard]] uint64_t pagesEnd() const;
    [[nodiscard]] const ByteReader& reader() const { return *reader_; }
    /// Returns how many blocks of the directory, from `block` on and fewer than `most`, are kept here; or, negative,
    /// how many are not. Precondition: most > 0.
    [[nodiscard]] int64_t keptFrom(uint64_t block, uint64_t most) const;
    /// Reads blocks that are kept here. Errors: InvalidInput, Io.
    Result<void> readKept(uint64_t block, std::span<std::byte> bytes) const;

    /// Precondition: number < header().shards. Errors: InvalidInput, Io.
    [[nodiscard]] Result<ShardRow> shard(uint64_t number) const;
    /// Returns the run of a page, or of an offset among the pages. Precondition: there is such a page or offset.
    /// Errors: InvalidInput, Io.
    [[nodiscard]] Result<RunPlace> runOfPage(uint64_t page) const;
    [[nodiscard]] Result<RunPlace> runAt(uint64_t offset) const;

private:
    template <class Row>
    using Block = std::shared_ptr<const std::vector<Row>>;
    template <class Row>
    struct Table {
        uint64_t begin = 0, rows = 0;  ///< where it begins in the manifest, and how many rows it has
        mutable std::unordered_map<uint64_t, Block<Row>> blocks;

        [[nodiscard]] uint64_t blockCount() const { return (rows + kManifestBlockRows - 1) / kManifestBlockRows; }
        [[nodiscard]] uint64_t bytes() const { return rows * kManifestRowBytes + blockCount() * sizeof(uint64_t); }
    };

    explicit ShardManifest(std::shared_ptr<const ByteReader> reader) : reader_(std::move(reader)) {}
    Result<void> readStart();
    Result<void> readFences();
    [[nodiscard]] Error broken(std::string element, uint64_t byte, std::string message) const;
    template <class Row>
    Result<Block<Row>> block(const Table<Row>& table, uint64_t number) const;
    Result<void> check(uint64_t number, const std::vector<ShardRow>& rows) const;
    Result<void> check(uint64_t number, const std::vector<PageRun>& rows) const;
    template <uint64_t PageRun::*kPlace, uint64_t RunFence::*kFence>
    Result<RunPlace> runWith(uint64_t place) const;

    std::shared_ptr<const ByteReader> reader_;
    ManifestHeader header_;
    FileHeader fileHeader_;
    std::vector<std::byte> fileHeaderBytes_;
    std::vector<RunFence> fences_;
    std::vector<uint64_t> kept_;  // numbers, ascending
    uint64_t keptBegin_ = 0;      // where the blocks begin
    Table<ShardRow> shards_;
    Table<PageRun> runs_;
    mutable std::mutex mutex_;  // guards the blocks of both tables
};

struct KeptBlock {
    uint64_t number = 0;
    std::vector<std::byte> bytes;  ///< kBlockBytes
};
/// Returns the numbers of the blocks that a manifest keeps, ascending. `pages`: of the one file.
std::vector<uint64_t> blocksToKeep(const std::vector<PageRun>& runs, uint64_t pages);

/// Writes the bytes of a manifest. `header`: all but hashes and counts.
std::vector<std::byte> storedManifest(ManifestHeader header, std::span<const std::byte> fileHeader,
                                      const std::vector<ShardRow>& shards, const std::vector<PageRun>& runs,
                                      const std::vector<KeptBlock>& kept);

/// Whether the file behind a reader begins as manifests do. Errors: Io.
Result<bool> isManifest(const ByteReader& reader);

}  // namespace vcp
