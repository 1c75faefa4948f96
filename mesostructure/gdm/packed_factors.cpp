#include "mesostructure/gdm/packed_factors.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

float greatestOf(const std::vector<float>& values, int stride, int rank) {
    float greatest = 0;
    for (size_t i = 0; i < values.size(); ++i)
        if (int(i % size_t(stride)) < rank) greatest = std::max(greatest, std::abs(values[i]));
    return greatest;
}

std::vector<uint32_t> packed(const std::vector<float>& values, size_t count, int stride, int rank, int bits,
                             float unit) {
    const size_t groups = size_t(rank + 3) / 4, words = size_t(bits) / 8;
    std::vector<uint32_t> result(groups * count * words, 0);
    const uint32_t mask = bits == 8 ? 0xffu : 0xffffu;
    for (size_t group = 0; group < groups; ++group)
        for (size_t i = 0; i < count; ++i)
            for (int k = 0; k < 4 && int(4 * group) + k < rank; ++k) {
                const float value = values[i * size_t(stride) + 4 * group + size_t(k)];
                const auto step = uint32_t(int(std::lround(unit > 0 ? value / unit : 0))) & mask;
                const size_t bit = size_t(k) * size_t(bits);
                result[(group * count + i) * words + bit / 32] |= step << (bit % 32);
            }
    return result;
}

int valueAt(const std::vector<uint32_t>& words, size_t texel, int k, int bits) {
    const size_t bit = size_t(k) * size_t(bits);
    const uint32_t value = words[texel * (size_t(bits) / 8) + bit / 32] >> (bit % 32);
    return bits == 8 ? int(int8_t(value & 0xff)) : int(int16_t(value & 0xffff));
}

}  // namespace

double PackedFactors::value(size_t row, size_t column) const {
    double sum = 0;
    for (int group = 0; group < rank / 4; ++group)
        for (int k = 0; k < 4; ++k)
            sum += double(valueAt(weights, size_t(group) * rows + row, k, bits)) *
                   double(valueAt(eigen, size_t(group) * columns + column, k, bits));
    return sum * double(unit);
}

Result<PackedFactors> packFactors(const Factors& factors, int rank, int bits) {
    if (bits != 8 && bits != 16)
        return Error{.code = ErrorCode::Usage, .message = fmt::format("factors of {} bits; there are 8 and 16", bits)};
    if (rank < 1 || rank > factors.rank)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a rank of {}; the factors have {}", rank, factors.rank)};
    const float most = bits == 8 ? 127 : 32767;
    const float weightUnit = greatestOf(factors.weights, factors.rank, rank) / most,
                eigenUnit = greatestOf(factors.eigen, factors.rank, rank) / most;
    return PackedFactors{factors.rows,
                         factors.columns,
                         (rank + 3) / 4 * 4,
                         bits,
                         weightUnit * eigenUnit,
                         packed(factors.weights, factors.rows, factors.rank, rank, bits, weightUnit),
                         packed(factors.eigen, factors.columns, factors.rank, rank, bits, eigenUnit)};
}

}  // namespace vcp::meso
