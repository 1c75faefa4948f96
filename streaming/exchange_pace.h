// How long an exchange with a server may take: a least rate over each stretch of time, and an end that follows from the
// bytes that were asked for. Pure: the clock is the caller's.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "streaming/http_reader.h"

namespace vcp {

class ExchangePace {
public:
    /// `mostBytes`: the most that the answer may have. `now`: seconds on any clock that never goes back.
    ExchangePace(const HttpOptions& options, uint64_t mostBytes, double now);

    /// Returns what is wrong, if anything. `bytes`: how many have come so far. `isConnected`: the server has the
    /// request; before that, only the overall end and the bound on connecting count.
    [[nodiscard]] std::optional<std::string> problem(double now, uint64_t bytes, bool isConnected);
    /// The longest that the exchange may take.
    [[nodiscard]] double mostSeconds() const { return mostSeconds_; }

private:
    double stallSeconds_, leastBytesPerSecond_, begun_, mostSeconds_;
    double since_;         // start of the stretch
    uint64_t before_ = 0;  // bytes that came before the stretch
};

}  // namespace vcp
