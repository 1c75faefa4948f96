// The clock by which streaming measures how long something takes.
#pragma once

#include <chrono>

namespace vcp {

/// Returns the seconds since some time in the past, which is the same for the whole process. Any thread.
inline double steadySeconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace vcp
