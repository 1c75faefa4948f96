#include "builder/spill/record_bins.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include <oneapi/tbb/parallel_for.h>
#include <xxhash.h>
#include <zstd.h>

namespace vcp {

namespace {

struct BlockHeader {
    uint32_t magic = kMagic;
    uint32_t bin = 0;
    uint32_t records = 0;
    uint32_t storedBytes = 0;
    uint64_t payloadHash = 0;  ///< hash of what follows
    uint64_t hash = 0;         ///< hash of the above: the index is made of headers alone

    static constexpr uint32_t kMagic = 0x4c4c4256;
    [[nodiscard]] uint64_t hashOfHeader() const { return XXH3_64bits(this, offsetof(BlockHeader, hash)); }
};
static_assert(sizeof(BlockHeader) == 32);

constexpr size_t kMaxBlockRecords = 4096, kMinBlockRecords = 64;
constexpr uint32_t kMaxBins = 1u << 24;
constexpr int kFastCompression = 1;

/// Writes, word by word, the difference to the record before, folded so that small ones of either sign have high bytes
/// of zero, one byte plane after the other.
void toPlanes(const std::byte* records, size_t count, size_t recordBytes, std::byte* planes) {
    const size_t words = recordBytes / 4;
    for (size_t w = 0; w < words; ++w) {
        std::byte* plane = planes + w * 4 * count;
        uint32_t before = 0;
        for (size_t i = 0; i < count; ++i) {
            uint32_t word;
            std::memcpy(&word, records + i * recordBytes + w * 4, 4);
            const uint32_t difference = word - before;
            const uint32_t folded = difference << 1 ^ (0 - (difference >> 31));
            before = word;
            for (size_t b = 0; b < 4; ++b) plane[b * count + i] = std::byte(folded >> 8 * b);
        }
    }
}

void fromPlanes(const std::byte* planes, size_t count, size_t recordBytes, std::byte* records) {
    const size_t words = recordBytes / 4;
    for (size_t w = 0; w < words; ++w) {
        const std::byte* plane = planes + w * 4 * count;
        uint32_t before = 0;
        for (size_t i = 0; i < count; ++i) {
            uint32_t folded = 0;
            for (size_t b = 0; b < 4; ++b) folded |= uint32_t(plane[b * count + i]) << 8 * b;
            before += folded >> 1 ^ (0 - (folded & 1));
            std::memcpy(records + i * recordBytes + w * 4, &before, 4);
        }
    }
}

/// Codes records into a block, behind its header, and cuts it to size. Returns false where that saves nothing.
bool code(const std::vector<std::byte>& records, size_t count, size_t recordBytes, std::vector<std::byte>& block) {
    std::vector<std::byte> planes(records.size());
    toPlanes(records.data(), count, recordBytes, planes.data());
    const size_t stored = ZSTD_compress(block.data() + sizeof(BlockHeader), block.size() - sizeof(BlockHeader),
                                        planes.data(), planes.size(), kFastCompression);
    if (ZSTD_isError(stored) || stored == records.size()) return false;
    block.resize(sizeof(BlockHeader) + stored);
    return true;
}

}  // namespace

RawBins::RawBins(TempSpace& space, std::string name, size_t recordBytes, size_t bins, uint64_t bufferBytes)
    : space_(space),
      file_(space, name + ".spill"),
      recordBytes_(recordBytes),
      blockRecords_(std::clamp<size_t>(bufferBytes / std::max<size_t>(bins, 1) / recordBytes, kMinBlockRecords,
                                       kMaxBlockRecords)),
      open_(bins),
      blocks_(bins),
      counts_(bins, 0) {}

Result<void> RawBins::append(size_t bin, const std::byte* records, size_t count) {
    while (count > 0) {
        std::vector<std::byte> full;
        {
            const std::scoped_lock lock(mutex_);
            if (bin >= open_.size()) {
                open_.resize(bin + 1);
                blocks_.resize(bin + 1);
                counts_.resize(bin + 1, 0);
            }
            std::vector<std::byte>& open = open_[bin];
            if (open.empty()) open.reserve(blockRecords_ * recordBytes_);
            const size_t n = std::min(count, blockRecords_ - open.size() / recordBytes_);
            open.insert(open.end(), records, records + n * recordBytes_);
            counts_[bin] += n;
            records += n * recordBytes_;
            count -= n;
            if (open.size() == blockRecords_ * recordBytes_) full.swap(open);
        }
        if (!full.empty()) VCP_TRY(writeBlock(bin, full));
    }
    return {};
}

// Coding, which takes the time, runs outside of the lock.
Result<void> RawBins::writeBlock(size_t bin, const std::vector<std::byte>& records) {
    const size_t count = records.size() / recordBytes_;
    std::vector<std::byte> block(sizeof(BlockHeader) + records.size());
    if (space_.isAmple(records.size()) || !code(records, count, recordBytes_, block))
        std::memcpy(block.data() + sizeof(BlockHeader), records.data(), records.size());
    BlockHeader header;
    header.bin = uint32_t(bin);
    header.records = uint32_t(count);
    header.storedBytes = uint32_t(block.size() - sizeof header);
    header.payloadHash = XXH3_64bits(block.data() + sizeof header, header.storedBytes);
    header.hash = header.hashOfHeader();
    std::memcpy(block.data(), &header, sizeof header);
    VCP_TRY_ASSIGN(const auto offset, file_.append(block));
    const std::scoped_lock lock(mutex_);
    blocks_[bin].push_back({offset, header.records, header.storedBytes});
    return {};
}

Result<void> RawBins::flush(size_t bin) {
    if (bin >= open_.size()) return {};
    std::vector<std::byte> rest;
    rest.swap(open_[bin]);
    return rest.empty() ? Result<void>() : writeBlock(bin, rest);
}

Result<void> RawBins::flush() {
    for (size_t bin = 0; bin < open_.size(); ++bin) VCP_TRY(flush(bin));
    return {};
}

Result<void> RawBins::sync() {
    VCP_TRY(flush());
    return file_.sync();
}

Result<void> RawBins::reopen(uint64_t bytes) {
    VCP_TRY(file_.reopen(bytes));
    for (uint64_t at = 0; at < bytes;) {
        BlockHeader header;
        if (bytes - at < sizeof header) return damagedTempFile(file_.path(), at);
        VCP_TRY(file_.read(at, std::as_writable_bytes(std::span(&header, 1))));
        if (header.hash != header.hashOfHeader() || header.magic != BlockHeader::kMagic || header.bin > kMaxBins ||
            header.records > kMaxBlockRecords || header.storedBytes > bytes - at - sizeof header)
            return damagedTempFile(file_.path(), at);
        if (header.bin >= blocks_.size()) {
            open_.resize(header.bin + 1);
            blocks_.resize(header.bin + 1);
            counts_.resize(header.bin + 1, 0);
        }
        blocks_[header.bin].push_back({at, header.records, header.storedBytes});
        counts_[header.bin] += header.records;
        at += sizeof header + header.storedBytes;
    }
    return {};
}

void RawBins::remove() {
    file_.remove();
    for (auto& open : open_) std::vector<std::byte>().swap(open);
    for (auto& blocks : blocks_) blocks.clear();
    std::fill(counts_.begin(), counts_.end(), 0);
}

uint64_t RawBins::total() const { return std::accumulate(counts_.begin(), counts_.end(), uint64_t{0}); }

Result<void> RawBins::read(const Block& block, std::byte* out) const {
    std::vector<std::byte> coded(sizeof(BlockHeader) + block.storedBytes);
    VCP_TRY(file_.read(block.offset, coded));
    BlockHeader header;
    std::memcpy(&header, coded.data(), sizeof header);
    const std::span<const std::byte> payload = std::span<const std::byte>(coded).subspan(sizeof header);
    const bool isIntact = header.records == block.records && header.storedBytes == block.storedBytes &&
                          header.hash == header.hashOfHeader() &&
                          header.payloadHash == XXH3_64bits(payload.data(), payload.size());
    if (isIntact && isPlain(header.records, header.storedBytes)) {
        std::memcpy(out, payload.data(), payload.size());
        return {};
    }
    std::vector<std::byte> planes(block.records * recordBytes_);
    if (!isIntact || ZSTD_decompress(planes.data(), planes.size(), payload.data(), payload.size()) != planes.size())
        return damagedTempFile(file_.path(), block.offset);
    fromPlanes(planes.data(), block.records, recordBytes_, out);
    return {};
}

Result<void> RawBins::load(size_t bin, std::span<std::byte> out) const {
    const std::span<const Block> blocks = this->blocks(bin);
    std::vector<size_t> begin;
    size_t at = 0;
    for (const Block& block : blocks) {
        begin.push_back(at);
        at += block.records * recordBytes_;
    }
    std::vector<Result<void>> done(blocks.size());
    tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t i) { done[i] = read(blocks[i], out.data() + begin[i]); });
    // Of several damaged blocks the first is named.
    for (auto& each : done) VCP_TRY(std::move(each));
    return {};
}

}  // namespace vcp
