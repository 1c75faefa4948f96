// Bytes without a pattern, the same for the same seed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace vcp::test {

inline std::vector<std::byte> randomBytes(size_t count, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<std::byte> bytes(count);
    for (std::byte& b : bytes) b = std::byte(random());
    return bytes;
}

}  // namespace vcp::test
