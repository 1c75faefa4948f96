// The most memory that this process ever had, for tests of what must not be allocated.
#pragma once

#include <sys/resource.h>
#include <cstdint>

namespace vcp::test {

/// Sanitizers keep what is freed, and add shadows: what a process has says nothing of the code then.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kMemoryIsMeasured = false;
#else
inline constexpr bool kMemoryIsMeasured = true;
#endif

inline uint64_t peakBytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return uint64_t(usage.ru_maxrss) * 1024;
}

}  // namespace vcp::test
