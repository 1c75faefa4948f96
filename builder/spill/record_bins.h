// Bins of fixed-size records on a temporary file: written in any order, read back bin by bin.
//
// Each bin fills a block. A full block, and the fullest ones where all together hold too much, is coded
// (record_coder.h), or left as it is while there is ample memory, and appended with a header that names its bin and the
// bin's block before it. So a bin costs a few bytes of memory however many blocks it has, and everything is found again
// after an interruption. Headers and blocks carry hashes: a temporary disk that returns wrong bytes is noticed.
#pragma once

#include <algorithm>
#include <condition_variable>
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
    /// `recordBytes`: a multiple of 4. `bins`: the expected number, more may come. `bufferBytes`: memory for all bins
    /// together; half of it can hold bufferBytes / 2 / kBinBytes bins.
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
    /// What is known of each bin: where its last block is, and how many records it has.
    struct Index {
        std::vector<uint64_t> last, counts;
    };
    /// Returns the index of bins that are flushed.
    [[nodiscard]] Index index() const;
    /// Takes the index over, without a walk through the file. Errors: Io; InvalidInput (shorter than `bytes`).
    Result<void> reopen(uint64_t bytes, const Index& index);
    void remove();

    [[nodiscard]] size_t bins() const { return bins_.size(); }
    [[nodiscard]] uint64_t count(size_t bin) const { return bin < bins_.size() ? bins_[bin].count : 0; }
    [[nodiscard]] uint64_t total() const;
    [[nodiscard]] uint64_t bytes() const { return file_.size(); }
    [[nodiscard]] const std::string& fileName() const { return file_.name(); }

    struct Block {
        uint64_t offset;  ///< offset of the header
        uint32_t records;
        uint32_t storedBytes;
        uint64_t end;  ///< offset of the block behind it in the file
    };
    /// Returns a bin's blocks, oldest first. Errors: Io; InvalidInput (damaged).
    Result<std::vector<Block>> blocks(size_t bin) const;
    /// Returns the block of any bin at an offset: from 0, each begins where the one before it ends, up to bytes().
    /// Errors: Io; InvalidInput (damaged).
    Result<Block> blockAt(uint64_t offset) const;
    /// Decodes a block to `out` (block.records records).
    Result<void> read(const Block& block, std::byte* out) const;
    /// Decodes all blocks of a bin, on the calling arena's threads. `out`: room for count(bin) records.
    Result<void> load(size_t bin, std::span<std::byte> out) const;

    /// Memory of a bin without an open block.
    static constexpr uint64_t kBinBytes = 40;

private:
    static constexpr uint64_t kNoBlock = ~uint64_t{0};

    struct Bin {
        std::vector<std::byte> open;
        uint64_t last = kNoBlock;  ///< offset of its last block
        uint64_t count = 0;
    };
    static_assert(sizeof(Bin) == kBinBytes);
    struct BlockHeader;
    /// What is on its way to the file: a bin's open block.
    struct Leaving {
        size_t bin;
        std::vector<std::byte> records;
    };

    Bin& binAt(size_t bin);
    /// Appends what fits the bin's open block; returns how many records that are.
    size_t fill(Bin& bin, const std::byte* records, size_t count);
    /// Writes the fullest open blocks where all together hold too much.
    Result<void> makeRoom();
    std::vector<Leaving> fullest();
    Result<void> writeBlock(size_t bin, const std::vector<std::byte>& records);
    Result<BlockHeader> headerAt(uint64_t offset) const;
    /// Whether a block is not coded: it has as many bytes as its records.
    [[nodiscard]] bool isPlain(uint32_t records, uint32_t storedBytes) const {
        return storedBytes == uint64_t{records} * recordBytes_;
    }
    [[nodiscard]] uint64_t openLimit() const;

    TempSpace& space_;
    TempFile file_;
    size_t recordBytes_;
    uint64_t bufferBytes_;
    std::vector<Bin> bins_;
    uint64_t open_ = 0, leaving_ = 0;  ///< bytes of open blocks, and of those that makeRoom is writing
    std::mutex mutex_;                 ///< of the above
    std::condition_variable written_;
    std::mutex chainMutex_;  ///< held while a block is appended and becomes its bin's last
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

    [[nodiscard]] Result<std::vector<RawBins::Block>> blocks(size_t bin) const { return raw_.blocks(bin); }
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
        order_.push_back(uint64_t{bin} << kLog2HeldRecords | held_.size());
        held_.push_back(record);
        return held_.size() < size_t{1} << kLog2HeldRecords ? Result<void>() : flush();
    }
    Result<void> flush() {
        // The places within the batch are sorted with the bins, so a bin's records keep their order.
        std::sort(order_.begin(), order_.end());
        for (size_t i = 0; i < order_.size();) {
            const uint64_t bin = order_[i] >> kLog2HeldRecords;
            run_.clear();
            for (; i < order_.size() && order_[i] >> kLog2HeldRecords == bin; ++i)
                run_.push_back(held_[order_[i] % (1u << kLog2HeldRecords)]);
            VCP_TRY(bins_.append(size_t(bin), run_));
        }
        order_.clear();
        held_.clear();
        return {};
    }

private:
    static constexpr unsigned kLog2HeldRecords = 12;

    RecordBins<Record>& bins_;
    std::vector<uint64_t> order_;  ///< of each record its bin, then its place in held_
    std::vector<Record> held_;
    std::vector<Record> run_;
};

}  // namespace vcp
