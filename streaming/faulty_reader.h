// A file that is slow or broken on purpose: wraps any reader, for tests and `vcp stress`.
//
// What happens to a read follows from the seed, its offset, and how often that offset was read before; the order and
// the threads do not matter. So the third attempt at a page has the same outcome in every run.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <unordered_map>
#include "octree/io/byte_reader.h"

namespace vcp {

struct Faults {
    double errorRate = 0;    ///< share of reads that fail with Io, 0 to 1
    double corruptRate = 0;  ///< share of reads that bring one wrong byte
    double stallRate = 0;    ///< share of reads that take stallSeconds longer
    double stallSeconds = 0;
    double latencySeconds = 0;  ///< delay of every read
    double spreadSeconds = 0;   ///< added to it, 0 to this by the seed: reads overtake each other
    double bytesPerSecond = 0;  ///< shared by all reads; 0: as fast as they come
    uint64_t seed = 1;

    bool operator==(const Faults&) const = default;
};

/// The time that FaultyReader sees; the steady clock where a function is not given.
struct FaultClock {
    std::function<double()> now;  ///< seconds
    std::function<void(double seconds)> sleep;
};

class FaultyReader final : public ByteReader {
public:
    FaultyReader(std::shared_ptr<const ByteReader> reader, const Faults& faults, FaultClock clock = {});
    ~FaultyReader() override;

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override { return reader_->size(); }
    [[nodiscard]] const std::string& name() const override { return reader_->name(); }
    void interrupt() const override;
    void distrust(uint64_t offset, uint64_t bytes) const override { reader_->distrust(offset, bytes); }

private:
    struct Sleep;
    double delayOf(uint64_t offset, uint64_t attempt, size_t bytes) const;

    std::shared_ptr<const ByteReader> reader_;
    Faults faults_;
    FaultClock clock_;
    std::unique_ptr<Sleep> sleep_;
    mutable std::mutex mutex_;
    mutable std::unordered_map<uint64_t, uint64_t> attempts_;  // for each offset, the reads so far
    mutable double busyUntil_ = 0;
};

}  // namespace vcp
