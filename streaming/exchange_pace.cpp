#include "streaming/exchange_pace.h"

#include <algorithm>

#include <fmt/format.h>

namespace vcp {

ExchangePace::ExchangePace(const HttpOptions& options, uint64_t mostBytes, double now)
    : stallSeconds_(options.stallSeconds),
      leastBytesPerSecond_(double(std::max<uint64_t>(options.leastBytesPerSecond, 1))),
      begun_(now),
      mostSeconds_(options.connectSeconds + options.stallSeconds + double(mostBytes) / leastBytesPerSecond_),
      since_(now) {}

std::optional<std::string> ExchangePace::problem(double now, uint64_t bytes, bool isConnected) {
    if (now - begun_ > mostSeconds_)
        return fmt::format("time-out: the answer has not come within {:.3g} s", mostSeconds_);
    if (!isConnected) since_ = now;
    const double seconds = now - since_;
    if (seconds < stallSeconds_) return std::nullopt;
    const uint64_t came = bytes - before_;
    if (came == 0) return fmt::format("time-out: no byte for {:.3g} s", seconds);
    if (double(came) < leastBytesPerSecond_ * seconds)
        return fmt::format("time-out: only {} bytes in {:.3g} s, where {:.0f} a second are needed", came, seconds,
                           leastBytesPerSecond_);
    since_ = now;
    before_ = bytes;
    return std::nullopt;
}

}  // namespace vcp
