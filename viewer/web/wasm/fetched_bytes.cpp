#include "viewer/web/wasm/fetched_bytes.h"

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
    for (const Piece& piece : pieces_) {
        if (offset < piece.offset || offset - piece.offset > piece.bytes.size() ||
            bytes.size() > piece.bytes.size() - (offset - piece.offset))
            continue;
        std::memcpy(bytes.data(), piece.bytes.data() + (offset - piece.offset), bytes.size());
        return {};
    }
    missing_.push_back({offset, bytes.size()});
    return Error::cancelled(name_);
}

void FetchedBytes::distrust(uint64_t offset, uint64_t bytes) const {
    pieces_.remove_if([&](const Piece& piece) {
        return piece.offset < offset + bytes && offset < piece.offset + piece.bytes.size();
    });
}

}  // namespace vcp
