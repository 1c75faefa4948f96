// The most memory that this process ever had, for tests of what must not be allocated.
#pragma once

#include <sys/resource.h>

namespace vcp::test {

/// Sanitizers keep what is freed, and add shadows: what a process has says nothing of the code then.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kMemoryIsMeasured = false;
#else
inline constexpr bool kMemoryIsMeasured = true;
#endif

inline long peakMiB() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss >> 10;
}

}  // namespace vcp::test
