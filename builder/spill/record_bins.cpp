#include "builder/spill/record_bins.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <oneapi/tbb/parallel_for.h>
#include <xxhash.h>

#include "builder/spill/record_coder.h"

namespace vcp {

struct RawBins::BlockHeader {
    uint32_t magic = kMagic;
    uint32_t bin = 0;
    uint32_t records = 0;
    uint32_t storedBytes = 0;
    uint64_t before = kNoBlock;  ///< offset of the bin's block before this one
    uint64_t payloadHash = 0;    ///< hash of what follows
    uint64_t hash = 0;           ///< hash of the above

    static constexpr uint32_t kMagic = 0x4d4c4256;
    [[nodiscard]] uint64_t hashOfHeader() const { return XXH3_64bits(this, offsetof(BlockHeader, hash)); }
};

namespace {

constexpr size_t kMaxBlockRecords = 4096, kLeastRoomRecords = 8;
constexpr size_t kHeaderBytes = 40;
constexpr uint32_t kMaxBins = 1u << 24;
}  // namespace

RawBins::RawBins(TempSpace& space, std::string name, size_t recordBytes, size_t bins, uint64_t bufferBytes)
    : space_(space), file_(space, name + ".spill"), recordBytes_(recordBytes), bufferBytes_(bufferBytes), bins_(bins) {
    static_assert(sizeof(BlockHeader) == kHeaderBytes);
}

RawBins::Bin& RawBins::binAt(size_t bin) {
    if (bin >= bins_.size()) bins_.resize(bin + 1);
    return bins_[bin];
}

/// Returns how much open blocks may hold. A third more is for those that are being written.
uint64_t RawBins::openLimit() const {
    const uint64_t bins = bins_.capacity() * kBinBytes;
    return (bufferBytes_ - std::min(bins, bufferBytes_ / 2)) * 3 / 4;
}

size_t RawBins::fill(Bin& bin, const std::byte* records, size_t count) {
    const size_t held = bin.open.size() / recordBytes_, n = std::min(count, kMaxBlockRecords - held);
    const size_t room = bin.open.capacity() / recordBytes_;
    if (held + n > room) {
        const size_t more = std::min(kMaxBlockRecords, std::max({held + n, 2 * room, kLeastRoomRecords}));
        open_ += (more - room) * recordBytes_;
        bin.open.reserve(more * recordBytes_);
    }
    bin.open.insert(bin.open.end(), records, records + n * recordBytes_);
    bin.count += n;
    return n;
}

Result<void> RawBins::append(size_t bin, const std::byte* records, size_t count) {
    while (count > 0) {
        std::vector<std::byte> full;
        bool isTooMuch = false;
        {
            const std::scoped_lock lock(mutex_);
            Bin& to = binAt(bin);
            const size_t n = fill(to, records, count);
            records += n * recordBytes_;
            count -= n;
            if (to.open.size() == kMaxBlockRecords * recordBytes_) {
                open_ -= to.open.capacity();
                full.swap(to.open);
            }
            isTooMuch = open_ > openLimit();
        }
        if (!full.empty()) VCP_TRY(writeBlock(bin, full));
        if (isTooMuch) VCP_TRY(makeRoom());
    }
    return {};
}

/// Takes the fullest open blocks, a quarter of all bytes or one block.
std::vector<RawBins::Leaving> RawBins::fullest() {
    std::vector<size_t> open;
    for (size_t bin = 0; bin < bins_.size(); ++bin)
        if (!bins_[bin].open.empty()) open.push_back(bin);
    std::sort(open.begin(), open.end(), [&](size_t a, size_t b) {
        return std::pair(bins_[b].open.size(), a) < std::pair(bins_[a].open.size(), b);
    });
    std::vector<Leaving> leaving;
    uint64_t bytes = 0;
    for (const size_t bin : open) {
        bytes += bins_[bin].open.capacity();
        leaving.push_back({bin, std::exchange(bins_[bin].open, {})});
        if (bytes >= open_ / 4) break;
    }
    open_ -= bytes;
    leaving_ += bytes;
    return leaving;
}

Result<void> RawBins::makeRoom() {
    std::vector<Leaving> leaving;
    uint64_t bytes = 0;
    {
        std::unique_lock lock(mutex_);
        // Several threads write at once, as far as memory allows.
        written_.wait(lock, [&] { return leaving_ == 0 || leaving_ + open_ / 4 <= openLimit() / 3; });
        if (open_ <= openLimit()) return {};
        leaving = fullest();
        for (const Leaving& each : leaving) bytes += each.records.capacity();
    }
    Result<void> result;
    for (Leaving& each : leaving) {
        if (result) result = writeBlock(each.bin, each.records);
        std::vector<std::byte>().swap(each.records);
    }
    {
        const std::scoped_lock lock(mutex_);
        leaving_ -= bytes;
    }
    written_.notify_all();
    return result;
}

// Coding, which takes the time, runs outside of the locks.
Result<void> RawBins::writeBlock(size_t bin, const std::vector<std::byte>& records) {
    const size_t count = records.size() / recordBytes_;
    std::vector<std::byte> block(kHeaderBytes);
    block.reserve(kHeaderBytes + records.size());
    if (space_.isAmple(records.size()) || !codeRecords(records, recordBytes_, block))
        block.insert(block.end(), records.begin(), records.end());
    BlockHeader header;
    header.bin = uint32_t(bin);
    header.records = uint32_t(count);
    header.storedBytes = uint32_t(block.size() - kHeaderBytes);
    header.payloadHash = XXH3_64bits(block.data() + kHeaderBytes, header.storedBytes);

    const std::scoped_lock chain(chainMutex_);
    {
        const std::scoped_lock lock(mutex_);
        header.before = bins_[bin].last;
    }
    header.hash = header.hashOfHeader();
    std::memcpy(block.data(), &header, sizeof header);
    VCP_TRY_ASSIGN(const auto offset, file_.append(block));
    const std::scoped_lock lock(mutex_);
    bins_[bin].last = offset;
    return {};
}

Result<void> RawBins::flush(size_t bin) {
    if (bin >= bins_.size() || bins_[bin].open.empty()) return {};
    open_ -= bins_[bin].open.capacity();
    return writeBlock(bin, std::exchange(bins_[bin].open, {}));
}

Result<void> RawBins::flush() {
    for (size_t bin = 0; bin < bins_.size(); ++bin) VCP_TRY(flush(bin));
    return {};
}

Result<void> RawBins::sync() {
    VCP_TRY(flush());
    return file_.sync();
}

Result<RawBins::BlockHeader> RawBins::headerAt(uint64_t offset) const {
    const uint64_t bytes = file_.size();
    BlockHeader header;
    if (offset > bytes || bytes - offset < sizeof header) return damagedTempFile(file_.path(), offset);
    VCP_TRY(file_.read(offset, std::as_writable_bytes(std::span(&header, 1))));
    const bool isIntact = header.hash == header.hashOfHeader() && header.magic == BlockHeader::kMagic &&
                          header.bin <= kMaxBins && header.records <= kMaxBlockRecords &&
                          header.storedBytes <= bytes - offset - sizeof header &&
                          (header.before == kNoBlock || header.before < offset);
    if (!isIntact) return damagedTempFile(file_.path(), offset);
    return header;
}

Result<RawBins::Block> RawBins::blockAt(uint64_t offset) const {
    VCP_TRY_ASSIGN(const BlockHeader header, headerAt(offset));
    return Block{offset, header.records, header.storedBytes, offset + sizeof header + header.storedBytes};
}

Result<std::vector<RawBins::Block>> RawBins::blocks(size_t bin) const {
    std::vector<Block> blocks;
    for (uint64_t at = bin < bins_.size() ? bins_[bin].last : kNoBlock; at != kNoBlock;) {
        VCP_TRY_ASSIGN(const BlockHeader header, headerAt(at));
        if (header.bin != bin) return damagedTempFile(file_.path(), at);
        blocks.push_back({at, header.records, header.storedBytes, at + sizeof header + header.storedBytes});
        at = header.before;
    }
    std::reverse(blocks.begin(), blocks.end());
    return blocks;
}

Result<void> RawBins::reopen(uint64_t bytes) {
    VCP_TRY(file_.reopen(bytes));
    for (uint64_t at = 0; at < bytes;) {
        VCP_TRY_ASSIGN(const BlockHeader header, headerAt(at));
        Bin& bin = binAt(header.bin);
        if (header.before != bin.last) return damagedTempFile(file_.path(), at);
        bin.last = at;
        bin.count += header.records;
        at += sizeof header + header.storedBytes;
    }
    return {};
}

RawBins::Index RawBins::index() const {
    Index index;
    for (const Bin& bin : bins_) {
        index.last.push_back(bin.last);
        index.counts.push_back(bin.count);
    }
    return index;
}

Result<void> RawBins::reopen(uint64_t bytes, const Index& index) {
    VCP_TRY(file_.reopen(bytes));
    for (size_t bin = 0; bin < std::min(index.last.size(), index.counts.size()); ++bin) {
        binAt(bin).last = index.last[bin];
        binAt(bin).count = index.counts[bin];
    }
    return {};
}

void RawBins::remove() {
    file_.remove();
    bins_.assign(bins_.size(), {});
    open_ = 0;
}

uint64_t RawBins::total() const {
    uint64_t total = 0;
    for (const Bin& bin : bins_) total += bin.count;
    return total;
}

Result<void> RawBins::read(const Block& block, std::byte* out) const {
    BlockHeader header;
    VCP_TRY(file_.read(block.offset, std::as_writable_bytes(std::span(&header, 1))));
    // What is not coded is read to where it goes.
    const bool plain = isPlain(block.records, block.storedBytes);
    std::vector<std::byte> coded(plain ? 0 : block.storedBytes);
    const std::span<std::byte> payload = plain ? std::span(out, block.storedBytes) : std::span(coded);
    VCP_TRY(file_.read(block.offset + sizeof header, payload));
    const bool isIntact = header.records == block.records && header.storedBytes == block.storedBytes &&
                          header.hash == header.hashOfHeader() &&
                          header.payloadHash == XXH3_64bits(payload.data(), payload.size());
    if (isIntact && plain) return {};
    if (!isIntact || !decodeRecords(payload, recordBytes_, std::span(out, block.records * recordBytes_)))
        return damagedTempFile(file_.path(), block.offset);
    return {};
}

Result<void> RawBins::load(size_t bin, std::span<std::byte> out) const {
    VCP_TRY_ASSIGN(const auto blocks, this->blocks(bin));
    std::vector<size_t> begin;
    size_t at = 0;
    for (const Block& block : blocks) {
        begin.push_back(at);
        at += block.records * recordBytes_;
    }
    if (at != out.size()) return damagedTempFile(file_.path());
    std::vector<Result<void>> done(blocks.size());
    tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t i) { done[i] = read(blocks[i], out.data() + begin[i]); });
    // The first of several damaged blocks is named.
    for (auto& each : done) VCP_TRY(std::move(each));
    return {};
}

}  // namespace vcp
