// Tells the caller how far a build is: never backwards, and about ten times a second.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "builder/build.h"

namespace vcp {

/// Any thread; the callback is called by one at a time.
class ProgressMeter {
public:
    explicit ProgressMeter(const std::function<bool(const BuildProgress&)>& callback) : callback_(callback) {}

    /// `now`: stage and time are filled in here. Returns false once the callback has cancelled.
    bool report(const std::string& stage, BuildProgress now) {
        if (!callback_) return true;
        const std::scoped_lock lock(mutex_);
        const bool isEnd = now.fraction >= 1;
        now.fraction = fraction_ = std::max(fraction_, std::min(now.fraction, 1.0));
        now.seconds = seconds();
        now.stage = stage.c_str();
        if (now.seconds - lastSeconds_ < 0.1 && !isEnd) return !cancelled_;
        lastSeconds_ = now.seconds;
        if (!callback_(now)) cancelled_ = true;
        return !cancelled_;
    }

    /// Since the build began.
    [[nodiscard]] double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

private:
    const std::function<bool(const BuildProgress&)>& callback_;
    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::mutex mutex_;
    double lastSeconds_ = -1, fraction_ = 0;
    bool cancelled_ = false;
};

}  // namespace vcp
