// The bytes of a file that a page in a browser has fetched so far.
#pragma once

#include <cstdint>
#include <list>
#include <string>
#include <vector>

#include "octree/io/byte_reader.h"

namespace vcp {

/// A stretch of a file.
struct Stretch {
    uint64_t offset = 0, bytes = 0;
};

/// Reads what was fetched. Where bytes have not come it notes them as missing and returns Cancelled.
class FetchedBytes final : public ByteReader {
public:
    /// `mostBytes`: what was fetched first goes where more is kept; whoever still needs it misses it again.
    FetchedBytes(uint64_t size, std::string name, uint64_t mostBytes)
        : size_(size), mostBytes_(mostBytes), name_(std::move(name)) {}

    void supply(uint64_t offset, std::vector<std::byte> bytes);
    /// Reads that end behind `end` fail as Limit, from now on.
    void refuseBehind(uint64_t end) { refusedBehind_ = end; }
    /// Returns what was missing since the last call.
    std::vector<Stretch> takeMissing();

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override { return size_; }
    [[nodiscard]] const std::string& name() const override { return name_; }
    /// Forgets the bytes, so that they are fetched anew.
    void distrust(uint64_t offset, uint64_t bytes) const override;

private:
    struct Piece {
        uint64_t offset;
        std::vector<std::byte> bytes;
    };
    uint64_t size_, mostBytes_, refusedBehind_ = UINT64_MAX;
    std::string name_;
    mutable std::list<Piece> pieces_;  // the oldest first
    mutable std::vector<Stretch> missing_;
};

}  // namespace vcp
