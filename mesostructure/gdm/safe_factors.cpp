#include "mesostructure/gdm/safe_factors.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

constexpr size_t kBoundHalf = 6, kLastHalf = 7;  ///< of the first quad

/// Returns where term k lies: the first quad has six.
size_t quadOf(int k) { return k < 6 ? 0 : 1 + size_t(k - 6) / 8; }
size_t halfOf(int k) { return k < 6 ? size_t(k) : size_t(k - 6) % 8; }

uint16_t halfAt(const std::vector<uint32_t>& words, size_t quad, size_t half) {
    return uint16_t(words[4 * quad + half / 2] >> (half % 2 * 16) & 0xffff);
}

void putHalf(std::vector<uint32_t>& words, size_t quad, size_t half, int value) {
    words[4 * quad + half / 2] |= uint32_t(uint16_t(value)) << (half % 2 * 16);
}

/// What single precision loses of a sum of up to 32 products is less than this part of their sizes.
constexpr double kSumSlack = 4e-6;

struct Sum {
    double value = 0, size = 0;
};

Sum sumOf(const SafeFactors& f, size_t row, size_t column) {
    const size_t cluster = halfAt(f.rows, row, kLastHalf), columns = f.columnCount() * size_t(f.clusters);
    column += cluster * f.columnCount();
    Sum sum;
    sum.value = double(int16_t(halfAt(f.columns, column, kLastHalf))) * double(f.unit);
    sum.size = std::abs(sum.value);
    for (int k = 0; k < 8 * f.quads - 2; ++k) {
        const size_t quad = quadOf(k), half = halfOf(k);
        const double term = double(int16_t(halfAt(f.rows, quad * f.rowCount() + row, half))) *
                            double(int16_t(halfAt(f.columns, quad * columns + column, half))) * double(f.product);
        sum.value += term, sum.size += std::abs(term);
    }
    return sum;
}

double greatestOf(const std::vector<float>& values) {
    float greatest = 0;
    for (const float v : values) greatest = std::max(greatest, std::abs(v));
    return double(greatest);
}

/// Returns the greatest length of a row of weights.
double longestRow(const std::vector<float>& weights, int rank) {
    double longest = 0;
    for (size_t row = 0; row < weights.size(); row += size_t(rank)) {
        double square = 0;
        for (size_t k = 0; k < size_t(rank); ++k) square += double(weights[row + k]) * double(weights[row + k]);
        longest = std::max(longest, square);
    }
    return std::sqrt(longest);
}

/// Reads lengths as rows; a cell without takes that of the next cell above that has one, or below.
RowSource sourceOf(const ConeLengths& lengths, size_t rows, size_t columns) {
    const auto fill = [&lengths, columns](size_t row, float* out) {
        const auto nz = size_t(lengths.cells.z);
        for (size_t column = 0; column < columns; column += nz)
            for (size_t z = 0; z < nz; ++z) {
                size_t from = z;
                while (from + 1 < nz && lengths.step(row, column + from) == lengths.unasked) ++from;
                while (from > 0 && lengths.step(row, column + from) == lengths.unasked) --from;
                const uint8_t step = lengths.step(row, column + from);
                out[column + z] = step == lengths.unasked ? 0 : float(step) * lengths.unit;
            }
    };
    return {rows, columns, [=](size_t first, size_t count, float* out) {
                for (size_t i = 0; i < count; ++i) fill(first + i, out + i * columns);
            }};
}

/// Sets the bounds of rows and columns: the most that the rounded factors say too much.
void setBounds(const ConeLengths& lengths, SafeFactors& f) {
    std::vector<double> ofRow(f.rowCount(), 0), ofColumn(f.columnCount() * size_t(f.clusters), 0);
    for (size_t row = 0; row < f.rowCount(); ++row) {
        const size_t base = size_t(halfAt(f.rows, row, kLastHalf)) * f.columnCount();
        for (size_t column = 0; column < f.columnCount(); ++column) {
            const uint8_t step = lengths.step(row, column);
            if (step == lengths.unasked) continue;
            const Sum said = sumOf(f, row, column);
            const double excess = said.value + kSumSlack * said.size - double(float(step) * lengths.unit) * (1 - 1e-6);
            ofRow[row] = std::max(ofRow[row], excess);
            ofColumn[base + column] = std::max(ofColumn[base + column], excess);
        }
    }
    // The product of a bound and the unit may round down in single precision.
    const auto stepsOf = [&](double bound) {
        return int(std::min(65535.0, std::ceil(bound * (1 + 1e-6) / double(f.unit))));
    };
    for (size_t row = 0; row < ofRow.size(); ++row) putHalf(f.rows, row, kBoundHalf, stepsOf(ofRow[row]));
    for (size_t i = 0; i < ofColumn.size(); ++i) putHalf(f.columns, i, kBoundHalf, stepsOf(ofColumn[i]));
}

}  // namespace

uint8_t ConeLengths::step(size_t row, size_t column) const {
    const auto plane = size_t(cells.x) * size_t(cells.y), nz = size_t(cells.z);
    const size_t cone = column / nz * size_t(azimuths) + row / plane;
    return steps[(cone * nz + column % nz) * plane + row % plane];
}

double SafeFactors::length(size_t row, size_t column) const {
    const size_t base = size_t(halfAt(rows, row, kLastHalf)) * columnCount();
    return sumOf(*this, row, column).value -
           double(std::min(halfAt(rows, row, kBoundHalf), halfAt(columns, base + column, kBoundHalf))) * double(unit);
}

Result<SafeFactors> makeSafeFactors(const ConeLengths& lengths, const SafeOptions& options,
                                    const FactorProgress& progress) {
    if (options.quads < 1 || options.quads > 4)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("guesses of {} x 16 bytes; there are 1 to 4", options.quads)};
    SafeFactors f{lengths.cells, lengths.azimuths, lengths.elevations, options.quads, options.clusters, 0, 0, {}, {}};
    const int rank = 8 * options.quads - 2;
    VCP_TRY_ASSIGN(const auto made, factorizeClusters(sourceOf(lengths, f.rowCount(), f.columnCount()), rank,
                                                      options.clusters, options.rounds, progress));
    const size_t columns = f.columnCount() * size_t(f.clusters);
    const double weightUnit = std::max(1e-12, greatestOf(made.weights) / 32767),
                 eigenUnit = std::max(1e-12, greatestOf(made.eigen) / 32767);
    f.product = float(weightUnit * eigenUnit);
    // A mean is at most the cap. No sum, and so no bound, is greater than the cap and the longest row of weights: a
    // column of a cluster's unit vectors is at most 1 long.
    const double cap = 255 * double(lengths.unit), longest = longestRow(made.weights, rank);
    f.unit = float(std::max(cap / 32767, (cap + longest) / 65535) * 1.01);
    f.rows.assign(f.rowCount() * size_t(f.quads) * 4, 0);
    f.columns.assign(columns * size_t(f.quads) * 4, 0);
    const auto put = [&](std::vector<uint32_t>& words, size_t count, size_t i, const float* values, double unit) {
        for (int k = 0; k < rank; ++k)
            putHalf(words, quadOf(k) * count + i, halfOf(k), int(std::lround(double(values[k]) / unit)));
    };
    for (size_t row = 0; row < f.rowCount(); ++row) {
        put(f.rows, f.rowCount(), row, made.weights.data() + row * size_t(rank), weightUnit);
        putHalf(f.rows, row, kLastHalf, made.cluster[row]);
    }
    for (size_t i = 0; i < columns; ++i) {
        put(f.columns, columns, i, made.eigen.data() + i * size_t(rank), eigenUnit);
        putHalf(f.columns, i, kLastHalf, int(std::lround(double(made.means[i]) / double(f.unit))));
    }
    setBounds(lengths, f);
    return f;
}

}  // namespace vcp::meso
