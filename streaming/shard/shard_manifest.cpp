#include "streaming/shard/shard_manifest.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>

#include "octree/header_check.h"
#include "octree/image/image_tables.h"
#include "octree/io/content_hash.h"

namespace vcp {

namespace {

constexpr uint64_t kHashBytes = sizeof(uint64_t);
constexpr uint64_t kBlockStride = kManifestBlockRows * kManifestRowBytes + kHashBytes;
// Blocks of a table that stay in memory: some 4 MiB.
constexpr size_t kMostBlocks = 256;

/// Returns the hash of what a manifest begins with, whose own hash is left out.
uint64_t hashOfStart(std::span<const std::byte> start) {
    std::vector<std::byte> unhashed(start.begin(), start.end());
    std::memset(unhashed.data() + offsetof(ManifestHeader, hash), 0, kHashBytes);
    return hashBytes(unhashed);
}

template <class Row>
void appendTable(std::vector<std::byte>& bytes, const std::vector<Row>& rows) {
    for (size_t first = 0; first < rows.size(); first += kManifestBlockRows) {
        const auto block =
            std::as_bytes(std::span(rows).subspan(first, std::min<size_t>(kManifestBlockRows, rows.size() - first)));
        const uint64_t hash = hashBytes(block);
        bytes.insert(bytes.end(), block.begin(), block.end());
        const auto hashed = std::as_bytes(std::span(&hash, 1));
        bytes.insert(bytes.end(), hashed.begin(), hashed.end());
    }
}

}  // namespace

std::string shardName(const ShardRow& shard) { return fmt::format("{:016x}{:016x}.vcp", shard.name[1], shard.name[0]); }

bool isShardName(std::string_view name) {
    constexpr size_t kDigits = 32;
    return name.size() == kDigits + 4 && name.ends_with(".vcp") &&
           name.find_first_not_of("0123456789abcdef") == kDigits;
}

Result<bool> isManifest(const ByteReader& reader) {
    constexpr ManifestHeader kHeader;
    if (reader.size() < kManifestTables) return false;
    char magic[sizeof kHeader.magic];
    VCP_TRY(reader.read(0, std::as_writable_bytes(std::span(magic))));
    return std::memcmp(magic, kHeader.magic, sizeof magic) == 0;
}

std::vector<std::byte> storedManifest(ManifestHeader header, std::span<const std::byte> fileHeader,
                                      const std::vector<ShardRow>& shards, const std::vector<PageRun>& runs,
                                      const std::vector<KeptBlock>& kept) {
    std::vector<std::byte> index;
    const auto addToIndex = [&](const auto& row) {
        const auto from = std::as_bytes(std::span(&row, 1));
        index.insert(index.end(), from.begin(), from.end());
    };
    for (size_t i = 0; i < runs.size(); i += kManifestBlockRows)
        addToIndex(RunFence{runs[i].firstPage, runs[i].offset});
    for (const KeptBlock& block : kept) addToIndex(block.number);
    header.shards = shards.size();
    header.runs = runs.size();
    header.keptBlocks = kept.size();
    header.fencesHash = hashBytes(index);
    header.hash = 0;
    std::vector<std::byte> bytes(kManifestTables);
    std::memcpy(bytes.data(), &header, sizeof header);
    std::copy(fileHeader.begin(), fileHeader.end(), bytes.begin() + kDirectoryOffset);
    header.hash = hashOfStart(bytes);
    std::memcpy(bytes.data(), &header, sizeof header);
    bytes.insert(bytes.end(), index.begin(), index.end());
    for (const KeptBlock& block : kept) bytes.insert(bytes.end(), block.bytes.begin(), block.bytes.end());
    appendTable(bytes, shards);
    appendTable(bytes, runs);
    return bytes;
}

std::vector<uint64_t> blocksToKeep(const std::vector<PageRun>& runs, uint64_t pages) {
    std::vector<uint64_t> kept;
    for (uint64_t block = 0; block < leadBlocks(blocksOf(pages)); ++block) kept.push_back(block);
    // Where the entries of another shard begin, of each block; the first ones are not counted.
    uint64_t block = 0;
    uint32_t changes = 0;
    for (size_t i = 1; i < runs.size(); ++i) {
        if (runs[i].shard == runs[i - 1].shard) continue;
        const uint64_t at = runs[i].firstPage / kEntriesPerBlock;
        changes = at != block ? 0 : changes;
        block = at;
        changes += runs[i].firstPage % kEntriesPerBlock != 0 ? 1 : 0;
        if (changes == kMostShardsOfBlock && at > kept.back()) kept.push_back(at);
    }
    return kept;
}

Result<std::unique_ptr<ShardManifest>> ShardManifest::open(std::shared_ptr<const ByteReader> reader) {
    std::unique_ptr<ShardManifest> manifest(new ShardManifest(std::move(reader)));
    VCP_TRY(manifest->readStart());
    VCP_TRY(manifest->readFences());
    return manifest;
}

Error ShardManifest::broken(std::string element, uint64_t byte, std::string message) const {
    return brokenBytes(reader_->name(), std::move(element), byte, std::move(message));
}

Result<void> ShardManifest::readStart() {
    const auto fail = [&](uint64_t byte, std::string message) { return broken("manifest", byte, std::move(message)); };
    VCP_TRY_ASSIGN(const bool begins, isManifest(*reader_));
    if (!begins) return fail(0, "not a manifest of shards");
    std::vector<std::byte> start(kManifestTables);
    VCP_TRY(reader_->read(0, start));
    std::memcpy(&header_, start.data(), sizeof header_);
    if (header_.version != ManifestHeader{}.version)
        return Error{
            .code = ErrorCode::Unsupported,
            .message = fmt::format("version {} of manifests is not known: use a newer program", header_.version),
            .file = reader_->name()};
    if (hashOfStart(start) != header_.hash) return fail(0, "its hash does not match: it was changed or damaged");
    fileHeaderBytes_.assign(start.begin() + kDirectoryOffset, start.end());
    std::memcpy(&fileHeader_, fileHeaderBytes_.data(), sizeof fileHeader_);
    VCP_TRY(checkHeader(reader_->name(), fileHeader_, fileHeaderBytes_, fileHeader_.fileBytes));
    const uint64_t directoryEnd = blockOffset(blocksOf(fileHeader_.pages)), end = pagesEnd();
    if (directoryEnd > end || fileHeader_.fileBytes < sizeof(CommitRecord))
        return fail(kDirectoryOffset, "the directory does not fit the file");
    // Each shard has a run at least, and each run a page.
    if (header_.shards < 1 || header_.shards > header_.runs || header_.runs > fileHeader_.pages ||
        header_.keptBlocks > blocksOf(fileHeader_.pages))
        return fail(offsetof(ManifestHeader, shards), "counts out of range");
    const bool hasImages = (fileHeader_.flags & kFlagImages) != 0;
    const uint64_t images = hasImages ? fileHeader_.images.bytes : 0;
    if ((header_.shardImages != 0) != hasImages || header_.tileTable > images ||
        header_.tiles > (images - header_.tileTable) / sizeof(TileRow))
        return fail(offsetof(ManifestHeader, shardImages), "the place of the images is out of range");
    return {};
}

Result<void> ShardManifest::readFences() {
    shards_.rows = header_.shards;
    runs_.rows = header_.runs;
    const uint64_t fences = runs_.blockCount() * sizeof(RunFence),
                   index = fences + header_.keptBlocks * sizeof(uint64_t);
    keptBegin_ = kManifestTables + index;
    shards_.begin = keptBegin_ + header_.keptBlocks * kBlockBytes;
    runs_.begin = shards_.begin + shards_.bytes();
    if (runs_.begin + runs_.bytes() != reader_->size())
        return broken("manifest", reader_->size(), "it is shorter or longer than its counts say");
    std::vector<std::byte> bytes;
    VCP_TRY(readInPieces(*reader_, kManifestTables, index, [&](std::span<const std::byte> piece) -> Result<void> {
        bytes.insert(bytes.end(), piece.begin(), piece.end());
        return {};
    }));
    if (hashBytes(bytes) != header_.fencesHash)
        return broken("manifest", kManifestTables, "a hash does not match: it was changed or damaged");
    fences_.resize(runs_.blockCount());
    std::memcpy(fences_.data(), bytes.data(), fences);
    kept_.resize(header_.keptBlocks);
    if (!kept_.empty()) std::memcpy(kept_.data(), bytes.data() + fences, bytes.size() - fences);
    for (size_t i = 0; i < kept_.size(); ++i)
        if (kept_[i] >= blocksOf(fileHeader_.pages) || (i > 0 && kept_[i] <= kept_[i - 1]))
            return broken("manifest", kManifestTables + fences + i * sizeof(uint64_t), "kept blocks are not in order");
    if (fences_.front().firstPage != 0)
        return broken("manifest", kManifestTables, "the first run is not the first page's");
    for (size_t i = 1; i < fences_.size(); ++i)
        if (fences_[i].firstPage <= fences_[i - 1].firstPage || fences_[i].offset <= fences_[i - 1].offset)
            return broken("manifest", kManifestTables + i * sizeof(RunFence), "blocks of runs are not in order");
    return {};
}

int64_t ShardManifest::keptFrom(uint64_t block, uint64_t most) const {
    const auto first = std::lower_bound(kept_.begin(), kept_.end(), block);
    if (first == kept_.end() || *first != block)
        return -int64_t(first == kept_.end() ? most : std::min(most, *first - block));
    uint64_t count = 1;
    while (count < most && first + std::ptrdiff_t(count) != kept_.end() &&
           first[std::ptrdiff_t(count)] == block + count)
        ++count;
    return int64_t(count);
}

Result<void> ShardManifest::readKept(uint64_t block, std::span<std::byte> bytes) const {
    const auto place = uint64_t(std::lower_bound(kept_.begin(), kept_.end(), block) - kept_.begin());
    const uint64_t begin = keptBegin_ + place * kBlockBytes;
    VCP_TRY(reader_->read(begin, bytes));
    for (uint64_t at = 0; at < bytes.size(); at += kBlockBytes) {
        uint64_t hash = 0;
        std::memcpy(&hash, bytes.data() + at + kBlockBytes - kHashBytes, kHashBytes);
        if (hashBytes(bytes.subspan(at, kBlockBytes - kHashBytes)) == hash) continue;
        reader_->distrust(begin + at, kBlockBytes);
        return broken(fmt::format("directory block {}", block + at / kBlockBytes), begin + at,
                      "a hash does not match: it was changed or damaged");
    }
    return {};
}

uint64_t ShardManifest::pagesEnd() const {
    const bool hasImages = (fileHeader_.flags & kFlagImages) != 0;
    return hasImages ? fileHeader_.images.offset : fileHeader_.fileBytes - sizeof(CommitRecord);
}

template <class Row>
Result<ShardManifest::Block<Row>> ShardManifest::block(const Table<Row>& table, uint64_t number) const {
    {
        const std::lock_guard lock(mutex_);
        if (const auto found = table.blocks.find(number); found != table.blocks.end()) return found->second;
    }
    const uint64_t first = number * kManifestBlockRows, rows = std::min(kManifestBlockRows, table.rows - first);
    const uint64_t at = table.begin + number * kBlockStride;
    std::vector<std::byte> bytes(rows * kManifestRowBytes + kHashBytes);
    VCP_TRY(reader_->read(at, bytes));
    const auto body = std::span<const std::byte>(bytes).first(rows * kManifestRowBytes);
    uint64_t hash = 0;
    std::memcpy(&hash, bytes.data() + body.size(), kHashBytes);
    if (hashBytes(body) != hash) {
        reader_->distrust(at, bytes.size());
        return broken("manifest", at, "a hash does not match: it was changed or damaged");
    }
    auto made = std::make_shared<std::vector<Row>>(rows);
    std::memcpy(made->data(), body.data(), body.size());
    VCP_TRY(check(number, *made));
    const std::lock_guard lock(mutex_);
    if (table.blocks.size() >= kMostBlocks) table.blocks.clear();
    table.blocks[number] = made;
    return Block<Row>(made);
}

Result<void> ShardManifest::check(uint64_t number, const std::vector<ShardRow>& rows) const {
    for (size_t i = 0; i < rows.size(); ++i) {
        const ShardRow& row = rows[i];
        const uint64_t at = shards_.begin + number * kBlockStride + i * kManifestRowBytes;
        // A shard has one page at least, and no more than the one file and the copies of pages that it begins with.
        if (row.pages < 1 || row.pages > fileHeader_.pages || blocksOf(row.pages) > row.bytes / kBlockBytes ||
            row.level >= fileHeader_.levels || row.morton >> (3 * row.level) != 0 || row.reserved != 0)
            return broken(fmt::format("shard {}", number * kManifestBlockRows + i), at, "its row is out of range");
    }
    return {};
}

Result<void> ShardManifest::check(uint64_t number, const std::vector<PageRun>& rows) const {
    const auto fail = [&](size_t i, const char* message) {
        return broken(fmt::format("run {}", number * kManifestBlockRows + i),
                      runs_.begin + number * kBlockStride + i * kManifestRowBytes, message);
    };
    const RunFence next = number + 1 < fences_.size() ? fences_[number + 1] : RunFence{fileHeader_.pages, pagesEnd()};
    for (size_t i = 0; i < rows.size(); ++i) {
        const PageRun& row = rows[i];
        const RunFence end = i + 1 < rows.size() ? RunFence{rows[i + 1].firstPage, rows[i + 1].offset} : next;
        if (i == 0 && (row.firstPage != fences_[number].firstPage || row.offset != fences_[number].offset))
            return fail(i, "it does not begin where its block does");
        if (row.firstPage >= end.firstPage || row.offset >= end.offset ||
            row.offset < blockOffset(blocksOf(fileHeader_.pages)))
            return fail(i, "runs are not in order");
        if (row.shard >= header_.shards || row.shardOffset % kPageAlignment != 0 || row.offset % kPageAlignment != 0)
            return fail(i, "its place is out of range");
        if (row.childMask != 0 && (end.firstPage != row.firstPage + 1 || uint64_t(row.firstChild) >= fileHeader_.pages))
            return fail(i, "a shard begins in the middle of it");
        if (std::any_of(std::begin(row.reserved), std::end(row.reserved), [](uint8_t b) { return b != 0; }))
            return fail(i, "reserved bytes must be zero");
    }
    return {};
}

template <uint64_t PageRun::*kPlace, uint64_t RunFence::*kFence>
Result<RunPlace> ShardManifest::runWith(uint64_t place) const {
    const auto after = std::upper_bound(fences_.begin(), fences_.end(), place,
                                        [](uint64_t at, const RunFence& fence) { return at < fence.*kFence; });
    if (after == fences_.begin()) return broken("manifest", kManifestTables, "no run has the first page");
    const auto number = uint64_t(after - fences_.begin() - 1);
    VCP_TRY_ASSIGN(const auto rows, block(runs_, number));
    const auto next = std::upper_bound(rows->begin(), rows->end(), place,
                                       [](uint64_t at, const PageRun& run) { return at < run.*kPlace; });
    RunPlace found{*(next - 1)};
    if (next != rows->end())
        found.endPage = next->firstPage, found.endOffset = next->offset;
    else if (number + 1 < fences_.size())
        found.endPage = fences_[number + 1].firstPage, found.endOffset = fences_[number + 1].offset;
    else
        found.endPage = fileHeader_.pages, found.endOffset = pagesEnd();
    return found;
}

Result<ShardRow> ShardManifest::shard(uint64_t number) const {
    VCP_TRY_ASSIGN(const auto rows, block(shards_, number / kManifestBlockRows));
    return (*rows)[number % kManifestBlockRows];
}

Result<RunPlace> ShardManifest::runOfPage(uint64_t page) const {
    return runWith<&PageRun::firstPage, &RunFence::firstPage>(page);
}

Result<RunPlace> ShardManifest::runAt(uint64_t offset) const {
    return runWith<&PageRun::offset, &RunFence::offset>(offset);
}

}  // namespace vcp
