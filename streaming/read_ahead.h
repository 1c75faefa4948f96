// Reads a file from front to back in large pieces: wraps a reader whose every read takes long, for one thread that
// goes through all of it in many small steps.
#pragma once

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>
#include "octree/io/byte_reader.h"

namespace vcp {

/// Used by one thread at a time.
class ReadAhead final : public ByteReader {
public:
    explicit ReadAhead(std::shared_ptr<const ByteReader> reader, uint64_t pieceBytes = 4 << 20)
        : reader_(std::move(reader)), pieceBytes_(pieceBytes) {}

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        const auto isHeld = [&] {
            return offset >= begin_ && bytes.size() <= piece_.size() && offset - begin_ <= piece_.size() - bytes.size();
        };
        if (!isHeld()) {
            if (offset > size() || bytes.size() > size() - offset || bytes.size() >= pieceBytes_)
                return reader_->read(offset, bytes);
            std::vector<std::byte> piece(std::min(pieceBytes_, size() - offset));
            VCP_TRY(reader_->read(offset, piece));
            begin_ = offset;
            piece_ = std::move(piece);
        }
        if (!bytes.empty()) std::memcpy(bytes.data(), piece_.data() + (offset - begin_), bytes.size());
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return reader_->size(); }
    [[nodiscard]] const std::string& name() const override { return reader_->name(); }
    void interrupt() const override { reader_->interrupt(); }

private:
    std::shared_ptr<const ByteReader> reader_;
    uint64_t pieceBytes_;
    mutable uint64_t begin_ = 0;
    mutable std::vector<std::byte> piece_;
};

}  // namespace vcp
