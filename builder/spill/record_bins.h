// Bins of fixed-size records on a temporary file: written in any order, read back bin by bin.
//
// Each bin fills a block; a full block is coded (words as differences to the record before, byte planes, zstd
// at its fastest), or left as it is while there is ample memory, and appended with a header that names its bin, so that
// the index can be made again from the file after an interruption. Headers and blocks carry hashes: a temporary disk
// that returns wrong bytes is noticed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "builder/spill/temp_space.h"
#include "octree/io/result.h"

namespace vcp {

/// Untyped bins; see RecordBins. Any thread may append, and may call read; the rest is for one thread, while none
/// appends.
class RawBins {
public:
    /// `recordBytes`: a multiple of 4. `bins`: the expected number, more may come. `bufferBytes`: memory for all open
    /// blocks together.
    RawBins(TempSpace& space, std::string name, size_t recordBytes, size_t bins, uint64_t bufferBytes);

    Result<void> append(size_t bin, const std::byte* records, size_t count);
    /// Writes the open blocks: only then are their records read back. More records may follow.
    Result<void> flush();
    /// Writes one bin's open block.
    Result<void> flush(size_t bin);
    /// Flushes, durably.
    Result<void> sync();
    /// Makes the index again, from a file cut to `bytes`. Errors: Io; InvalidInput (damaged).
    Result<void> reopen(uint64_t bytes);
    void remove();

    [[nodiscard]] size_t bins() const { return blocks_.size(); }
    [[nodiscard]] uint64_t count(size_t bin) const { return bin < counts_.size() ? counts_[bin] : 0; }
    [[nodiscard]] uint64_t total() const;
    [[nodiscard]] uint64_t bytes() const { return file_.size(); }
    [[nodiscard]] const std::string& fileName() const { return file_.name(); }

    struct Block {
        uint64_t offset;  ///< offset of the header
        uint32_t records;
        uint32_t storedBytes;
    };
    [[nodiscard]] std::span<const Block> blocks(size_t bin) const {
        return bin < blocks_.size() ? std::span<const Block>(blocks_[bin]) : std::span<const Block>();
    }
    [[nodiscard]] size_t blockRecords() const { return blockRecords_; }
    /// Decodes a block to `out` (block.records records).
    Result<void> read(const Block& block, std::byte* out) const;
    /// Decodes all blocks of a bin, on the calling arena's threads. `out`: room for count(bin) records.
    Result<void> load(size_t bin, std::span<std::byte> out) const;

private:
    Result<void> writeBlock(size_t bin, const std::vector<std::byte>& records);
    /// Whether a block is not coded: it has as many bytes as its records.
    [[nodiscard]] bool isPlain(uint32_t records, uint32_t storedBytes) const {
        return storedBytes == uint64_t{records} * recordBytes_;
    }

    TempSpace& space_;
    TempFile file_;
    size_t recordBytes_, blockRecords_;
    std::vector<std::vector<std::byte>> open_;
    std::vector<std::vector<Block>> blocks_;
    std::vector<uint64_t> counts_;
    std::mutex mutex_;
};

template <class Record>
class RecordBins {
    static_assert(std::is_trivially_copyable_v<Record> && sizeof(Record) % 4 == 0);

public:
    RecordBins(TempSpace& space, std::string name, size_t bins, uint64_t bufferBytes)
        : raw_(space, std::move(name), sizeof(Record), bins, bufferBytes) {}

    Result<void> append(size_t bin, std::span<const Record> records) {
        return raw_.append(bin, reinterpret_cast<const std::byte*>(records.data()), records.size());
    }
    [[nodiscard]] RawBins& raw() { return raw_; }
    [[nodiscard]] const RawBins& raw() const { return raw_; }
    [[nodiscard]] uint64_t count(size_t bin) const { return raw_.count(bin); }

    /// Returns one block's records. Any thread.
    Result<std::vector<Record>> read(const RawBins::Block& block) const {
        std::vector<Record> records(block.records);
        VCP_TRY(raw_.read(block, reinterpret_cast<std::byte*>(records.data())));
        return records;
    }
    /// Returns all records of a bin. Uses the calling arena's threads.
    Result<std::vector<Record>> load(size_t bin) const {
        std::vector<Record> records(raw_.count(bin));
        VCP_TRY(raw_.load(bin, std::as_writable_bytes(std::span(records))));
        return records;
    }

private:
    RawBins raw_;
};

/// Collects records on their way into bins, so that each append has many. One thread; flush when done.
template <class Record>
class BinBatch {
public:
    explicit BinBatch(RecordBins<Record>& bins) : bins_(bins) {}

    Result<void> add(size_t bin, const Record& record) {
        held_.emplace_back(bin, record);
        return held_.size() < kHeldRecords ? Result<void>() : flush();
    }
    Result<void> flush() {
        std::stable_sort(held_.begin(), held_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
        for (size_t i = 0; i < held_.size();) {
            const size_t bin = held_[i].first;
            run_.clear();
            for (; i < held_.size() && held_[i].first == bin; ++i) run_.push_back(held_[i].second);
            VCP_TRY(bins_.append(bin, run_));
        }
        held_.clear();
        return {};
    }

private:
    static constexpr size_t kHeldRecords = 4096;

    RecordBins<Record>& bins_;
    std::vector<std::pair<size_t, Record>> held_;
    std::vector<Record> run_;
};

}  // namespace vcp
