// A sum of doubles that does not depend on their order.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace vcp {

/// Sums finite doubles that are not negative, up to 2^64 of them, exactly: integers by exponent. Used by one thread.
class ExactSum {
public:
    void add(double value) {
        const uint64_t bits = std::bit_cast<uint64_t>(value);
        const uint64_t exponent = bits >> 52 & 0x7ff;
        const uint64_t fraction = bits & ((uint64_t{1} << 52) - 1);
        parts_[exponent] += exponent == 0 ? fraction : fraction | uint64_t{1} << 52;
    }
    void add(const ExactSum& other) {
        for (size_t e = 0; e < parts_.size(); ++e) parts_[e] += other.parts_[e];
    }
    /// Adds the words of another sum.
    void add(std::span<const uint64_t> words) {
        for (size_t i = 0; i + 3 <= words.size(); i += 3)
            parts_[words[i] % parts_.size()] += static_cast<unsigned __int128>(words[i + 1]) << 64 | words[i + 2];
    }
    /// Returns the sum, exactly: of each exponent that occurs three words.
    [[nodiscard]] std::vector<uint64_t> words() const {
        std::vector<uint64_t> words;
        for (size_t e = 0; e < parts_.size(); ++e)
            if (parts_[e] != 0) words.insert(words.end(), {e, uint64_t(parts_[e] >> 64), uint64_t(parts_[e])});
        return words;
    }
    /// Returns the rounded sum; the same for the same numbers in any order.
    [[nodiscard]] double value() const {
        double sum = 0;
        for (size_t e = 0; e < parts_.size(); ++e)
            if (parts_[e] != 0) sum += std::ldexp(double(parts_[e]), int(e == 0 ? 1 : e) - 1075);
        return sum;
    }

private:
    std::array<unsigned __int128, 2048> parts_{};
};

}  // namespace vcp
