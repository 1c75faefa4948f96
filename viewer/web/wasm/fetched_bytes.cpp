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

Result<void> FetchedBytes::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (offset > size_ || bytes.size() > size_ - offset)
        return Error{
            .code = ErrorCode::Io, .message = "the file ends here; it was truncated", .file = name_, .byte = offset};
    const uint64_t end = offset + bytes.size();
    if (end > refusedBehind_)
        return Error{.code = ErrorCode::Limit,
                     .message = "the tables of its images are too large for a browser, which shows none of these",
                     .file = name_,
                     .byte = offset};
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
            missing_.push_back({at, next - at});
            isWhole = false;
            until = next;
        }
        at = until;
    }
    if (isWhole) return {};
    return Error::cancelled(name_);
}

void FetchedBytes::distrust(uint64_t offset, uint64_t bytes) const {
    pieces_.remove_if([&](const Piece& piece) {
        return piece.offset < offset + bytes && offset < piece.offset + piece.bytes.size();
    });
}

}  // namespace vcp
