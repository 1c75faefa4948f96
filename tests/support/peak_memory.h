// The most memory that this process ever had, for tests of what must not be allocated.
#pragma once

#include <sys/resource.h>
#include <cstdint>

namespace vcp::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VCP_TEST_SANITIZED  // by GCC
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VCP_TEST_SANITIZED  // by Clang
#endif
#endif

/// Sanitizers keep what is freed, and add shadows: what a process has says nothing of the code then.
#ifdef VCP_TEST_SANITIZED
inline constexpr bool kMemoryIsMeasured = false;
#else
inline constexpr bool kMemoryIsMeasured = true;
#endif
#undef VCP_TEST_SANITIZED

inline uint64_t peakBytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return uint64_t(usage.ru_maxrss) * 1024;
}

}  // namespace vcp::test
