#include "builder/texture/level_bands.h"

#include <algorithm>
#include <array>
#include <vector>

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "builder/texture/texel_light.h"
#include "octree/image/image_levels.h"

namespace vcp {
namespace {

constexpr uint32_t kBandRows = kLargeTileEdge;
// Rows of a band that the coarser level still needs when they were handed on: those of a texel that the next one
// shares.
constexpr uint32_t kRowsBefore = 2;

/// Which of the finer texels one texel of half as many covers.
struct Span {
    uint32_t first;
    std::array<double, 3> weights;  ///< weights of up to three texels; their sum is 1

    /// Returns the number of the last texel that counts.
    [[nodiscard]] uint32_t last() const {
        uint32_t i = 2;
        while (i > 0 && !(weights[i] > 0)) --i;
        return first + i;
    }
};

Span coverage(uint32_t coarse, uint32_t coarseSize, uint32_t size) {
    const double step = double(size) / coarseSize;
    const double begin = coarse * step, end = (coarse + 1) * step;
    Span span{std::min(uint32_t(begin), size - 1), {}};
    for (uint32_t i = 0; i < 3 && span.first + i < size; ++i) {
        const double covered = std::min(end, double(span.first + i + 1)) - std::max(begin, double(span.first + i));
        span.weights[i] = std::max(covered, 0.0) / step;
    }
    return span;
}

/// Sums of texels that are numbers.
using TexelNumbers = std::array<double, 4>;

void addNumbers(TexelNumbers& sum, Rgba8 texel, double weight) {
    for (int c = 0; c < 4; ++c) sum[size_t(c)] += weight * (texel >> (8 * c) & 0xFF);
}

/// Stores a sum of weights 1.
Rgba8 roundedNumbers(const TexelNumbers& sum) {
    Rgba8 texel = 0;
    for (int c = 0; c < 4; ++c) texel |= Rgba8(std::clamp(sum[size_t(c)] + 0.5, 0.0, 255.0)) << (8 * c);
    return texel;
}

/// `fine`: the rows that `rows` begins with. `add` and `coded`: how texels are summed up.
template <class Sum>
void halveRow(const Rgba8* fine, uint32_t width, const Span& rows, std::span<const Span> columns, Rgba8* coarse,
              void (*add)(Sum&, Rgba8, double), Rgba8 (*coded)(const Sum&)) {
    for (const Span& column : columns) {
        Sum sum{};
        for (uint32_t j = 0; j < 3; ++j)
            for (uint32_t i = 0; i < 3; ++i)
                if (const double weight = rows.weights[j] * column.weights[i]; weight > 0)
                    add(sum, fine[size_t{j} * width + column.first + i], weight);
        *coarse++ = coded(sum);
    }
}

/// The rows of a level that are in memory.
struct Band {
    glm::uvec2 size;
    uint32_t first = 0, end = 0;  ///< rows
    std::vector<Rgba8> texels;    ///< room for all that there are at a time

    explicit Band(glm::uvec2 of) : size(of), texels(size_t{of.x} * std::min(of.y, kBandRows + kRowsBefore)) {}

    [[nodiscard]] size_t at(uint32_t row) const { return size_t{row - first} * size.x; }
    [[nodiscard]] std::span<Rgba8> rows(uint32_t from, uint32_t to) {
        return std::span(texels).subspan(at(from), size_t{to - from} * size.x);
    }
    /// Returns how many rows are missing in the row of tiles that is being filled.
    [[nodiscard]] uint32_t missing() const { return std::min(kBandRows - end % kBandRows, size.y - end); }
    void drop(uint32_t before) {
        std::copy(texels.begin() + std::ptrdiff_t(at(before)), texels.begin() + std::ptrdiff_t(at(end)),
                  texels.begin());
        first = before;
    }
};

class LevelBands {
public:
    LevelBands(glm::uvec2 size, const TakeBand& take, TexelKind kind) : take_(take), kind_(kind) {
        bands_.emplace_back(size);
        for (; size != glm::uvec2(1); bands_.emplace_back(size)) size = halvedSize(size);
    }

    Result<void> read(ImageRows& image) {
        Band& finest = bands_.front();
        while (finest.end < finest.size.y) {
            const uint32_t rows = finest.missing();
            VCP_TRY(image.read(finest.rows(finest.end, finest.end + rows)));
            finest.end += rows;
            VCP_TRY(settle(0));
        }
        return {};
    }

private:
    /// Makes what rows of the coarser levels can be made of those of a level, and hands on a row of tiles that is
    /// complete.
    Result<void> settle(size_t level) {
        Band& band = bands_[level];
        uint32_t needed = band.end;
        if (level + 1 < bands_.size()) {
            VCP_TRY(halve(level));
            const Band& coarse = bands_[level + 1];
            if (coarse.end < coarse.size.y) needed = coverage(coarse.end, coarse.size.y, band.size.y).first;
        }
        if (band.end % kBandRows != 0 && band.end < band.size.y) return {};
        const uint32_t row = (band.end - 1) / kBandRows * kBandRows;
        VCP_TRY(take_(level, row, band.rows(row, band.end)));
        band.drop(std::min(needed, band.end));
        return {};
    }

    Result<void> halve(size_t level) {
        Band& band = bands_[level];
        Band& coarse = bands_[level + 1];
        for (;;) {
            uint32_t end = coarse.end;
            for (const uint32_t most = coarse.end + coarse.missing();
                 end < most && coverage(end, coarse.size.y, band.size.y).last() < band.end;)
                ++end;
            if (end == coarse.end) return {};
            halveRows(band.rows(band.first, band.end), band.first, band.size, coarse.rows(coarse.end, end), coarse.end,
                      kind_);
            coarse.end = end;
            VCP_TRY(settle(level + 1));
        }
    }

    const TakeBand& take_;
    const TexelKind kind_;
    std::vector<Band> bands_;  ///< the finest comes first
};

}  // namespace

glm::uvec2 halvedSize(glm::uvec2 size) { return {std::max(size.x / 2, 1u), std::max(size.y / 2, 1u)}; }

void halveRows(std::span<const Rgba8> fine, uint32_t firstFine, glm::uvec2 fineSize, std::span<Rgba8> coarse,
               uint32_t firstCoarse, TexelKind kind) {
    const glm::uvec2 size = halvedSize(fineSize);
    std::vector<Span> columns(size.x);
    for (uint32_t x = 0; x < size.x; ++x) columns[x] = coverage(x, size.x, fineSize.x);
    tbb::parallel_for(size_t{0}, coarse.size() / size.x, [&](size_t i) {
        const Span rows = coverage(firstCoarse + uint32_t(i), size.y, fineSize.y);
        const Rgba8* const from = fine.data() + size_t{rows.first - firstFine} * fineSize.x;
        Rgba8* const to = coarse.data() + i * size.x;
        if (kind == TexelKind::Colours)
            halveRow(from, fineSize.x, rows, columns, to, addTexel, encodedTexel);
        else
            halveRow(from, fineSize.x, rows, columns, to, addNumbers, roundedNumbers);
    });
}

Result<void> readLevels(ImageRows& image, const TakeBand& take, TexelKind kind) {
    return tbb::this_task_arena::isolate([&] { return LevelBands(image.size(), take, kind).read(image); });
}

uint64_t levelBandBytes(glm::uvec2 size) {
    uint64_t texels = 0;
    for (;; size = halvedSize(size)) {
        texels += uint64_t{size.x} * std::min(size.y, kBandRows + kRowsBefore);
        if (size == glm::uvec2(1)) return texels * sizeof(Rgba8);
    }
}

}  // namespace vcp
