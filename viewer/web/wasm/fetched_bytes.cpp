#include "viewer/web/wasm/fetched_bytes.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace vcp {

void FetchedBytes::supply(uint64_t offset, std::vector<std::byte> bytes) {
    pieces_.push_back({offset, std::move(bytes)});
    uint64_t kept = 0;
    for (const Piece& piece : pieces_) kept += piece.bytes.size();
    while (pieces_.size() > 1 && kept > mostBytes_) {
        kept -= pieces_.front().bytes.size();
        pieces_.pop_front();
    }
}

std::vector<Stretch> FetchedBytes::takeMissing() { return std::exchange(missing_, {}); }

bool FetchedBytes::read(uint64_t offset, std::span<std::byte> bytes) {
    const uint64_t end = offset + bytes.size();
    bool isWhole = true;
    for (uint64_t at = offset; at < end;) {
        // The bytes may lie in several pieces, with or without gaps between them.
        uint64_t until = at, next = end;
        for (const Piece& piece : pieces_) {
            const uint64_t pieceEnd = piece.offset + piece.bytes.size();
            if (piece.offset > at) next = std::min(next, piece.offset);
            if (piece.offset > at || pieceEnd <= at || until > at) continue;
            until = std::min(end, pieceEnd);
            std::memcpy(bytes.data() + (at - offset), piece.bytes.data() + (at - piece.offset), until - at);
        }
        if (until == at) {
            if (whyLost(at) == nullptr) missing_.push_back({at, next - at});
            isWhole = false;
            until = next;
        }
        at = until;
    }
    return isWhole;
}

void FetchedBytes::forget(uint64_t offset, uint64_t bytes) {
    pieces_.remove_if([&](const Piece& piece) {
        return piece.offset < offset + bytes && offset < piece.offset + piece.bytes.size();
    });
}

Result<void> FetchedFile::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (offset > size_ || bytes.size() > size_ - offset)
        return Error{
            .code = ErrorCode::Io, .message = "the file ends here; it was truncated", .file = name_, .byte = offset};
    if (bytes_->read(begin_ + offset, bytes)) return {};
    const std::string* const why = bytes_->whyLost(begin_ + offset);
    return why != nullptr ? Error{.code = ErrorCode::Io, .message = *why} : Error::cancelled(name_);
}

Result<std::shared_ptr<FetchedDataset>> FetchedDataset::open(const std::shared_ptr<FetchedBytes>& bytes, uint64_t size,
                                                             const std::string& name) {
    std::shared_ptr<FetchedDataset> opened(new FetchedDataset());
    auto file = std::make_shared<const FetchedFile>(bytes, 0, size, name);
    VCP_TRY_ASSIGN(const bool inShards, isManifest(*file));
    if (!inShards) {
        opened->dataset_ = std::move(file);
        return opened;
    }
    opened->isSharded_ = true;
    const auto openShard = [bytes, files = opened->files_](
                               const ShardRow& shard, bool,
                               const std::function<bool()>&) -> Result<std::shared_ptr<const ByteReader>> {
        // A shard that was let go keeps its number.
        const std::string named = shardName(shard);
        const auto known = std::find(files->begin(), files->end(), named);
        const auto number = uint64_t(known - files->begin());
        if (known == files->end()) files->push_back(named);
        if (shard.bytes > kFileSpan)
            return Error{.code = ErrorCode::Limit, .message = "is too large for a browser", .file = named};
        return std::shared_ptr<const ByteReader>(
            std::make_shared<const FetchedFile>(bytes, number, shard.bytes, named));
    };
    VCP_TRY_ASSIGN(opened->dataset_, ShardedReader::open(std::move(file), openShard));
    return opened;
}

Result<void> FetchedDataset::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (offset + bytes.size() > refusedBehind_)
        return Error{.code = ErrorCode::Limit,
                     .message = "the tables of its images are too large for a browser, which shows none of these",
                     .file = name(),
                     .byte = offset};
    return dataset_->read(offset, bytes);
}

}  // namespace vcp
