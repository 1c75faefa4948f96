#include "streaming/shard/sharded_reader.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include <fmt/format.h>

#include "octree/directory_check.h"
#include "octree/image/image_tables.h"
#include "octree/io/content_hash.h"

namespace vcp {

/// A shard that was asked for.
struct ShardedReader::Shard {
    std::mutex opening;
    std::shared_ptr<const ByteReader> file;   ///< null until it is open; guarded by the reader's mutex
    uint64_t lastUse = 0;                     ///< guarded by the reader's mutex
    std::shared_ptr<std::atomic<bool>> stop;  ///< ends its opening; null while that is not under way; guarded likewise
};

/// Pages of a run whose entries are asked for.
struct ShardedReader::Segment {
    PageRun run;
    ShardRow shard;
    uint64_t firstPage = 0, pages = 0;  ///< in the one file

    [[nodiscard]] uint64_t firstInShard() const { return run.shardPage + (firstPage - run.firstPage); }
    [[nodiscard]] uint64_t firstBlock() const { return firstInShard() / kEntriesPerBlock; }
    [[nodiscard]] uint64_t endBlock() const { return blocksOf(firstInShard() + pages); }
};

namespace {

/// Returns an entry of a shard as it stands in the one file.
PageEntry entryInWhole(PageEntry entry, const PageRun& run, const ShardRow& shard) {
    const uint64_t moved = run.offset - run.shardOffset;
    entry.offset += moved;
    if (entry.colourStoredBytes != 0) entry.colourOffset += moved;
    entry.morton += shard.morton << (3 * std::min<uint32_t>(entry.level, 20));
    entry.level = uint8_t(entry.level + shard.level);
    if (run.childMask != 0) {
        entry.childMask = run.childMask;
        entry.firstChild = uint32_t(run.firstChild);
    } else if (entry.childMask != 0) {
        entry.firstChild = uint32_t(entry.firstChild + uint64_t(run.firstChild));
    }
    return entry;
}

/// Calls part(offset, bytes) for what of a stretch lies between two offsets, and takes it off the stretch.
template <class Part>
Result<void> within(uint64_t end, uint64_t& offset, std::span<std::byte>& bytes, Part&& part) {
    if (offset >= end || bytes.empty()) return {};
    const std::span now = bytes.first(std::min<uint64_t>(bytes.size(), end - offset));
    VCP_TRY(part(offset, now));
    offset += now.size();
    bytes = bytes.subspan(now.size());
    return {};
}

/// Copies what of `from`, which stands at offset `begin`, lies in the bytes at `offset`.
Result<void> copyFrom(std::span<const std::byte> from, uint64_t begin, uint64_t offset, std::span<std::byte> bytes) {
    std::memcpy(bytes.data(), from.data() + (offset - begin), bytes.size());
    return {};
}

/// Reads what a manifest says stands in a shard: of bytes behind a shard's end nobody asks a server.
Result<void> readShard(const ByteReader& file, uint64_t offset, std::span<std::byte> bytes,
                       const std::string& manifest) {
    if (offset <= file.size() && bytes.size() <= file.size() - offset) return file.read(offset, bytes);
    return brokenBytes(file.name(), "bytes", offset, fmt::format("end before what {} says is there", manifest));
}

Result<void> zeros(uint64_t, std::span<std::byte> bytes) {
    std::fill(bytes.begin(), bytes.end(), std::byte{0});
    return {};
}

}  // namespace

Result<std::shared_ptr<ShardedReader>> ShardedReader::open(std::shared_ptr<const ByteReader> manifest,
                                                           OpenShard openShard) {
    VCP_TRY_ASSIGN(auto opened, ShardManifest::open(std::move(manifest)));
    return std::shared_ptr<ShardedReader>(new ShardedReader(std::move(opened), std::move(openShard)));
}

std::shared_ptr<ShardedReader::Shard> ShardedReader::slotOf(uint64_t number) const {
    const std::lock_guard lock(mutex_);
    auto& slot = open_[number];
    if (!slot) slot = std::make_shared<Shard>();
    slot->lastUse = ++uses_;
    const auto found = slot;
    if (open_.size() <= kMostOpen) return found;
    // What is being opened stays, so that it is opened once and can be interrupted.
    const auto age = [](const auto& entry) { return entry.second->stop ? UINT64_MAX : entry.second->lastUse; };
    const auto oldest =
        std::min_element(open_.begin(), open_.end(), [&](const auto& a, const auto& b) { return age(a) < age(b); });
    if (!oldest->second->stop && oldest->second != found) open_.erase(oldest);
    return found;
}

Result<std::shared_ptr<const ByteReader>> ShardedReader::shardFile(uint64_t number) const {
    const auto slot = slotOf(number);
    const uint64_t interrupts = interrupts_;
    // Whoever comes while it is being opened waits; other shards do not.
    const std::lock_guard opening(slot->opening);
    const auto stop = std::make_shared<std::atomic<bool>>(false);
    {
        const std::lock_guard lock(mutex_);
        if (slot->file) return slot->file;
        if (interrupts_ != interrupts) return Error::cancelled(name());
        slot->stop = stop;
    }
    const auto file = openedShard(number, [stop] { return stop->load(); });
    const std::lock_guard lock(mutex_);
    slot->stop.reset();
    *stop = false;  // later reads of the file work
    if (!file) return file;
    slot->file = *file;
    if (interrupts_ != interrupts) return Error::cancelled(name());
    return file;
}

Result<std::shared_ptr<const ByteReader>> ShardedReader::openedShard(uint64_t number,
                                                                     const std::function<bool()>& cancelled) const {
    VCP_TRY_ASSIGN(const auto row, manifest_->shard(number));
    VCP_TRY_ASSIGN(auto file, openShard_(row, number == 0, cancelled));
    if (file->size() == row.bytes) return file;
    return Error{.code = ErrorCode::InvalidInput,
                 .message = fmt::format("has {} bytes, and {} says {}: it is another file, or was truncated",
                                        file->size(), name(), row.bytes),
                 .file = file->name()};
}

void ShardedReader::interrupt() const {
    manifest_->reader().interrupt();
    const std::lock_guard lock(mutex_);
    ++interrupts_;
    for (const auto& [number, slot] : open_) {
        if (slot->file) slot->file->interrupt();
        if (slot->stop) *slot->stop = true;
    }
}

Result<void> ShardedReader::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (offset > size() || bytes.size() > size() - offset)
        return Error{.code = ErrorCode::Io, .message = "the file ends here", .file = name(), .byte = offset};
    const FileHeader& header = manifest_->fileHeader();
    const uint64_t directoryEnd = blockOffset(blocksOf(header.pages)), commit = size() - sizeof(CommitRecord);
    const bool hasImages = (header.flags & kFlagImages) != 0;
    VCP_TRY(within(kDirectoryOffset, offset, bytes, [&](uint64_t at, std::span<std::byte> part) {
        return copyFrom(manifest_->fileHeaderBytes(), 0, at, part);
    }));
    VCP_TRY(within(directoryEnd, offset, bytes,
                   [&](uint64_t at, std::span<std::byte> part) { return readDirectory(at, part); }));
    if (bytes.empty()) return {};
    VCP_TRY_ASSIGN(const auto first, manifest_->runOfPage(0));
    VCP_TRY(within(first.run.offset, offset, bytes, zeros));
    VCP_TRY(within(manifest_->pagesEnd(), offset, bytes,
                   [&](uint64_t at, std::span<std::byte> part) { return readPages(at, part); }));
    if (hasImages)
        VCP_TRY(within(header.images.offset + header.images.bytes, offset, bytes,
                       [&](uint64_t at, std::span<std::byte> part) { return readImages(at, part); }));
    VCP_TRY(within(commit, offset, bytes, zeros));
    return within(size(), offset, bytes, [&](uint64_t at, std::span<std::byte> part) {
        return copyFrom(std::as_bytes(std::span(&manifest_->header().commit, 1)), commit, at, part);
    });
}

Result<void> ShardedReader::readPages(uint64_t offset, std::span<std::byte> bytes) const {
    while (!bytes.empty()) {
        VCP_TRY_ASSIGN(const auto place, manifest_->runAt(offset));
        VCP_TRY_ASSIGN(const auto file, shardFile(place.run.shard));
        VCP_TRY(within(place.endOffset, offset, bytes, [&](uint64_t at, std::span<std::byte> part) {
            return readShard(*file, place.run.shardOffset + (at - place.run.offset), part, name());
        }));
    }
    return {};
}

Result<void> ShardedReader::readImages(uint64_t offset, std::span<std::byte> bytes) const {
    const ManifestHeader& header = manifest_->header();
    const uint64_t begin = manifest_->fileHeader().images.offset, moved = begin - header.shardImages;
    const uint64_t table = begin + header.tileTable, tableEnd = table + header.tiles * sizeof(TileRow);
    VCP_TRY_ASSIGN(const auto file, shardFile(0));
    const auto asStored = [&](uint64_t at, std::span<std::byte> part) {
        return readShard(*file, at - moved, part, name());
    };
    // Tiles say where they are: whole rows are read, and what they say is moved.
    const auto asMoved = [&](uint64_t at, std::span<std::byte> part) -> Result<void> {
        const uint64_t firstRow = (at - table) / sizeof(TileRow),
                       endRow = (at - table + part.size() + sizeof(TileRow) - 1) / sizeof(TileRow);
        std::vector<TileRow> rows(endRow - firstRow);
        const uint64_t rowsAt = table + firstRow * sizeof(TileRow);
        VCP_TRY(asStored(rowsAt, std::as_writable_bytes(std::span(rows))));
        for (TileRow& row : rows) row.offset += moved;
        return copyFrom(std::as_bytes(std::span(rows)), rowsAt, at, part);
    };
    VCP_TRY(within(table, offset, bytes, asStored));
    VCP_TRY(within(tableEnd, offset, bytes, asMoved));
    return within(begin + manifest_->fileHeader().images.bytes, offset, bytes, asStored);
}

Result<void> ShardedReader::readDirectory(uint64_t offset, std::span<std::byte> bytes) const {
    const uint64_t first = (offset - kDirectoryOffset) / kBlockBytes,
                   end = (offset - kDirectoryOffset + bytes.size() + kBlockBytes - 1) / kBlockBytes;
    std::vector<std::byte> whole((end - first) * kBlockBytes);
    for (uint64_t block = first; block < end;) {
        const int64_t kept = manifest_->keptFrom(block, end - block);
        const auto count = uint64_t(std::abs(kept));
        const auto part = std::span(whole).subspan((block - first) * kBlockBytes, count * kBlockBytes);
        VCP_TRY(kept > 0 ? manifest_->readKept(block, part) : makeBlocks(block, part));
        block += count;
    }
    return copyFrom(whole, blockOffset(first), offset, bytes);
}

/// Makes blocks of the one file's directory from those of the shards.
Result<void> ShardedReader::makeBlocks(uint64_t first, std::span<std::byte> made) const {
    const uint64_t firstPage = first * kEntriesPerBlock,
                   endPage = std::min(firstPage + made.size() / kBlockBytes * kEntriesPerBlock,
                                      manifest_->fileHeader().pages);
    VCP_TRY_ASSIGN(const auto all, segments(firstPage, endPage));
    // What lies together in a shard is read together.
    for (size_t from = 0, to = 0; from < all.size(); from = to) {
        for (to = from + 1; to < all.size(); ++to)
            if (all[to].run.shard != all[from].run.shard || all[to].firstBlock() > all[to - 1].endBlock() ||
                all[to].firstBlock() + 1 < all[to - 1].endBlock())
                break;
        VCP_TRY(copyEntries(std::span(all).subspan(from, to - from), firstPage, made));
    }
    for (uint64_t at = 0; at < made.size(); at += kBlockBytes) {
        const uint64_t hash = hashBytes(made.subspan(at, kBlockBytes - sizeof hash));
        std::memcpy(made.data() + at + kBlockBytes - sizeof hash, &hash, sizeof hash);
    }
    return {};
}

Result<std::vector<ShardedReader::Segment>> ShardedReader::segments(uint64_t page, uint64_t endPage) const {
    std::vector<Segment> all;
    while (page < endPage) {
        VCP_TRY_ASSIGN(const auto place, manifest_->runOfPage(page));
        VCP_TRY_ASSIGN(const auto shard, manifest_->shard(place.run.shard));
        const uint64_t end = std::min(place.endPage, endPage);
        all.push_back({place.run, shard, page, end - page});
        if (all.back().firstInShard() + all.back().pages > shard.pages)
            return brokenBytes(name(), fmt::format("shard {}", place.run.shard), 0,
                               "a run names more pages than it has");
        page = end;
    }
    return all;
}

Result<void> ShardedReader::copyEntries(std::span<const Segment> segments, uint64_t firstPage,
                                        std::span<std::byte> made) const {
    VCP_TRY_ASSIGN(const auto file, shardFile(segments.front().run.shard));
    const ShardRow& shard = segments.front().shard;
    const uint64_t firstBlock = segments.front().firstBlock(), endBlock = segments.back().endBlock();
    std::vector<std::byte> stored((endBlock - firstBlock) * kBlockBytes);
    VCP_TRY(readShard(*file, blockOffset(firstBlock), stored, name()));
    for (uint64_t b = firstBlock; b < endBlock; ++b) {
        const auto block = std::span(stored).subspan((b - firstBlock) * kBlockBytes, kBlockBytes);
        const auto sound = checkBlock(file->name(), b,
                                      std::min<uint64_t>(kEntriesPerBlock, shard.pages - b * kEntriesPerBlock), block);
        if (sound) continue;
        file->distrust(blockOffset(b), kBlockBytes);
        return sound;
    }
    const auto entryAt = [](uint64_t page, uint64_t block) {
        return (page / kEntriesPerBlock - block) * kBlockBytes + page % kEntriesPerBlock * sizeof(PageEntry);
    };
    for (const Segment& segment : segments)
        for (uint64_t i = 0; i < segment.pages; ++i) {
            PageEntry entry;
            std::memcpy(&entry, stored.data() + entryAt(segment.firstInShard() + i, firstBlock), sizeof entry);
            entry = entryInWhole(entry, segment.run, shard);
            std::memcpy(made.data() + entryAt(segment.firstPage + i, firstPage / kEntriesPerBlock), &entry,
                        sizeof entry);
        }
    return {};
}

void ShardedReader::distrust(uint64_t offset, uint64_t bytes) const {
    // Blocks of directories are checked where they are read; what else proves wrong is among the pages and images.
    for (const uint64_t end = std::min(offset + bytes, manifest_->pagesEnd()); offset < end;) {
        const auto place = manifest_->runAt(offset);
        if (!place) return;
        const uint64_t now = std::min(end, place->endOffset) - offset;
        if (const auto file = shardFile(place->run.shard))
            (*file)->distrust(place->run.shardOffset + (offset - place->run.offset), now);
        offset += now;
        bytes -= now;
    }
    const FileHeader& header = manifest_->fileHeader();
    if (bytes == 0 || (header.flags & kFlagImages) == 0 || offset < header.images.offset) return;
    if (const auto file = shardFile(0))
        (*file)->distrust(manifest_->header().shardImages + (offset - header.images.offset), bytes);
}

}  // namespace vcp
