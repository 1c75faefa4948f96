// The most memory that this process ever had, for tests of what must not be allocated.
#pragma once

#include <sys/resource.h>

namespace vcp::test {

inline long peakMiB() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss >> 10;
}

}  // namespace vcp::test
