// The bytes of files that a page in a browser has fetched so far: of a .vcp file, or of a manifest and its shards.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "octree/io/byte_reader.h"
#include "streaming/shard/sharded_reader.h"

namespace vcp {

/// A stretch of what is fetched.
struct Stretch {
    uint64_t offset = 0, bytes = 0;
};

/// Files have their bytes in one row of numbers: where there are shards, those of file k begin at k * kFileSpan.
inline constexpr uint64_t kFileSpan = uint64_t{1} << 36;

/// Keeps what was fetched, and notes what is missing.
class FetchedBytes {
public:
    /// `mostBytes`: what was fetched first goes where more is kept; whoever still needs it misses it again.
    explicit FetchedBytes(uint64_t mostBytes) : mostBytes_(mostBytes) {}

    void supply(uint64_t offset, std::vector<std::byte> bytes);
    /// Returns what was missing since the last call.
    std::vector<Stretch> takeMissing();
    /// Returns whether all came; what has not is noted as missing.
    bool read(uint64_t offset, std::span<std::byte> bytes);
    /// Forgets the bytes, so that they are fetched anew.
    void forget(uint64_t offset, uint64_t bytes);
    /// Notes that the file with this byte cannot be had, for this reason: what is missing of it is asked for no more.
    void lose(uint64_t offset, std::string why) { lost_.insert_or_assign(offset / kFileSpan, std::move(why)); }
    /// Returns the reason, or null.
    [[nodiscard]] const std::string* whyLost(uint64_t offset) const {
        const auto found = lost_.find(offset / kFileSpan);
        return found != lost_.end() ? &found->second : nullptr;
    }

private:
    struct Piece {
        uint64_t offset;
        std::vector<std::byte> bytes;
    };
    uint64_t mostBytes_;
    std::list<Piece> pieces_;  // the oldest first
    std::vector<Stretch> missing_;
    std::map<uint64_t, std::string> lost_;  // by the file's number
};

/// Reads a file of those that are fetched. Where bytes have not come, reads are Cancelled; of a file that cannot be
/// had, Io.
class FetchedFile final : public ByteReader {
public:
    FetchedFile(std::shared_ptr<FetchedBytes> bytes, uint64_t number, uint64_t size, std::string name)
        : bytes_(std::move(bytes)), begin_(number * kFileSpan), size_(size), name_(std::move(name)) {}

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override { return size_; }
    [[nodiscard]] const std::string& name() const override { return name_; }
    void distrust(uint64_t offset, uint64_t bytes) const override { bytes_->forget(begin_ + offset, bytes); }

private:
    std::shared_ptr<FetchedBytes> bytes_;
    uint64_t begin_, size_;
    std::string name_;
};

/// Reads the dataset that file 0 is, or whose manifest it is.
class FetchedDataset final : public ByteReader {
public:
    /// Errors: Cancelled, until the beginning of file 0 has come; those of ShardedReader::open.
    static Result<std::shared_ptr<FetchedDataset>> open(const std::shared_ptr<FetchedBytes>& bytes, uint64_t size,
                                                        const std::string& name);

    /// Reads that end behind `end` fail as Limit, from now on.
    void refuseBehind(uint64_t end) { refusedBehind_ = end; }
    /// Returns the number of the file that has the byte at an offset of what is fetched.
    [[nodiscard]] uint64_t fileAt(uint64_t offset) const { return isSharded_ ? offset / kFileSpan : 0; }
    /// Returns the name of the file that has a number: beside file 0, whose own is empty.
    [[nodiscard]] const std::string& fileNamed(uint64_t number) const { return (*files_)[number]; }

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override { return dataset_->size(); }
    [[nodiscard]] const std::string& name() const override { return dataset_->name(); }
    void distrust(uint64_t offset, uint64_t bytes) const override { dataset_->distrust(offset, bytes); }

private:
    FetchedDataset() = default;
    std::shared_ptr<const ByteReader> dataset_;
    std::shared_ptr<std::vector<std::string>> files_ = std::make_shared<std::vector<std::string>>(1);  // by number
    bool isSharded_ = false;
    uint64_t refusedBehind_ = UINT64_MAX;
};

}  // namespace vcp
