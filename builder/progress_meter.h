// Tells the caller how far a build is: never backwards, about ten times a second and whenever a stage begins.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "builder/build.h"

namespace vcp {

/// Any thread may report; the callback is called by one thread at a time.
class ProgressMeter {
public:
    explicit ProgressMeter(const std::function<bool(const BuildProgress&)>& callback) : callback_(callback) {}

    /// Says that so much of the build was done before this run; before the first report.
    void beginAt(double fraction) { begun_ = fraction_ = fraction; }

    /// `now`: stage, time and where the run began are filled in here. Returns false once the callback has cancelled.
    bool report(const std::string& stage, BuildProgress now) {
        if (!callback_) return true;
        const std::scoped_lock lock(mutex_);
        if (cancelled_) return false;
        const bool isNews = stage != stage_ || now.fraction >= 1;
        now.fraction = fraction_ = std::max(fraction_, std::min(now.fraction, 1.0));
        now.begun = begun_;
        now.seconds = seconds();
        if (now.seconds - lastSeconds_ < 0.1 && !isNews) return true;
        lastSeconds_ = now.seconds;
        now.stage = stage_ = stage;
        cancelled_ = !callback_(now);
        return !cancelled_;
    }

    /// Seconds since the build began.
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    const std::function<bool(const BuildProgress&)>& callback_;
    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::mutex mutex_;
    std::string stage_;  // the stage that was reported last
    double lastSeconds_ = -1, fraction_ = 0, begun_ = 0;
    bool cancelled_ = false;
};

}  // namespace vcp
