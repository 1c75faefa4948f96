#include "streaming/faulty_reader.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>

#include "octree/io/content_hash.h"
#include "streaming/steady_seconds.h"

namespace vcp {

namespace {

enum class Draw : uint64_t { Error, Corrupt, Place, Stall, Spread };

uint64_t drawn(const Faults& faults, uint64_t offset, uint64_t attempt, Draw draw) {
    const std::array<uint64_t, 4> key = {faults.seed, offset, attempt, uint64_t(draw)};
    return hashBytes(std::as_bytes(std::span(key)));
}

/// Returns a number from 0 to below 1.
double fraction(uint64_t random) { return double(random >> 11) * 0x1p-53; }

}  // namespace

/// Sleeps until the time is over or interrupt() is called.
struct FaultyReader::Sleep {
    std::mutex mutex;
    std::condition_variable changed;
    uint64_t epoch = 0;
    bool isReal = true;

    /// Returns false when it was interrupted.
    bool wait(double seconds) {
        std::unique_lock lock(mutex);
        const uint64_t begun = epoch;
        return !changed.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return epoch != begun; });
    }
};

FaultyReader::FaultyReader(std::shared_ptr<const ByteReader> reader, const Faults& faults, FaultClock clock)
    : reader_(std::move(reader)), faults_(faults), clock_(std::move(clock)), sleep_(std::make_unique<Sleep>()) {
    sleep_->isReal = !clock_.sleep;
    if (!clock_.now) clock_.now = steadySeconds;
}

FaultyReader::~FaultyReader() = default;

void FaultyReader::interrupt() const {
    {
        const std::lock_guard lock(sleep_->mutex);
        ++sleep_->epoch;
    }
    sleep_->changed.notify_all();
    reader_->interrupt();
}

double FaultyReader::delayOf(uint64_t offset, uint64_t attempt, size_t bytes) const {
    double delay =
        faults_.latencySeconds + faults_.spreadSeconds * fraction(drawn(faults_, offset, attempt, Draw::Spread));
    if (fraction(drawn(faults_, offset, attempt, Draw::Stall)) < faults_.stallRate) delay += faults_.stallSeconds;
    if (faults_.bytesPerSecond > 0) {
        const std::lock_guard lock(mutex_);
        const double now = clock_.now();
        busyUntil_ = std::max(busyUntil_, now) + double(bytes) / faults_.bytesPerSecond;
        delay += busyUntil_ - now;
    }
    return delay;
}

Result<void> FaultyReader::read(uint64_t offset, std::span<std::byte> bytes) const {
    uint64_t attempt = 0;
    {
        const std::lock_guard lock(mutex_);
        attempt = attempts_[offset]++;
    }
    if (const double delay = delayOf(offset, attempt, bytes.size()); delay > 0) {
        if (!sleep_->isReal)
            clock_.sleep(delay);
        else if (!sleep_->wait(delay))
            return Error{.code = ErrorCode::Cancelled, .message = "cancelled", .file = name(), .byte = offset};
    }
    if (fraction(drawn(faults_, offset, attempt, Draw::Error)) < faults_.errorRate)
        return Error{.code = ErrorCode::Io,
                     .message = "read failed (a fault that was asked for)",
                     .file = name(),
                     .byte = offset};
    VCP_TRY(reader_->read(offset, bytes));
    if (!bytes.empty() && fraction(drawn(faults_, offset, attempt, Draw::Corrupt)) < faults_.corruptRate) {
        const uint64_t place = drawn(faults_, offset, attempt, Draw::Place);
        bytes[place % bytes.size()] ^= std::byte{1} << (place >> 60 & 7);
    }
    return {};
}

}  // namespace vcp
