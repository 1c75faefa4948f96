#include "builder/mask/alpha_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "builder/texture/image.h"
#include "builder/texture/texel_wrap.h"

namespace vcp {

namespace {

constexpr uint32_t kBlockEdge = 8;
// At a coarser level a mask would be a mean of things that have nothing to do with each other.
constexpr uint32_t kLeastEdge = 8;

/// The texels along an edge that an interval shows, as one or two ranges.
struct Shown {
    struct Range {
        uint32_t first, last;
    };
    std::array<Range, 2> ranges;
    size_t count = 1;
};

Shown shownBetween(double low, double high, uint32_t size, Wrap wrap) {
    const double last = double(size) - 1, period = wrap == Wrap::Mirror ? 2.0 * size : size;
    double a = std::floor(low - 0.5), b = std::floor(high - 0.5) + 1;
    const auto one = [](double from, double to) { return Shown{{{{uint32_t(from), uint32_t(to)}, {}}}, 1}; };
    if (wrap == Wrap::Clamp) return one(std::clamp(a, 0.0, last), std::clamp(b, 0.0, last));
    if (!(b - a < last)) return one(0, last);
    const double base = std::floor(a / period) * period;
    a -= base;
    b -= base;
    if (b < size) return one(a, b);
    if (wrap == Wrap::Repeat) return {{{{uint32_t(a), size - 1}, {0, uint32_t(b - size)}}}, 2};
    if (a < size) return one(std::min(a, period - 1 - b), last);
    if (b < period) return one(period - 1 - b, period - 1 - a);
    return one(0, std::max(period - 1 - a, b - period));
}

/// Returns the first texel of `fine` that texel `at` of `coarse` covers, and the one after the last.
std::pair<uint32_t, uint32_t> covered(uint32_t at, uint32_t coarse, uint32_t fine) {
    return {uint32_t(uint64_t{at} * fine / coarse), uint32_t((uint64_t{at + 1} * fine + coarse - 1) / coarse)};
}

/// A channel of a coarser image, made while rows come: each texel is a mean of those that it covers.
class ChannelRows {
public:
    ChannelRows(glm::uvec2 fine, glm::uvec2 coarse) : fine_(fine), coarse_{coarse.x, coarse.y, {}} {
        coarse_.values.reserve(size_t{coarse.x} * coarse.y);
    }

    /// Takes the next row.
    void add(std::span<const uint8_t> row) {
        most_ = std::max(most_, *std::max_element(row.begin(), row.end()));
        rows_.insert(rows_.end(), row.begin(), row.end());
        const auto made = uint32_t(coarse_.values.size() / coarse_.width);
        const auto [first, end] = covered(made, coarse_.height, fine_.y);
        if (++count_ < end) return;
        addMeans(end - first);
        // The next may cover this one's last row, too.
        if (made + 1 < coarse_.height)
            rows_.erase(rows_.begin(),
                        rows_.end() - ptrdiff_t(end - covered(made + 1, coarse_.height, fine_.y).first) * fine_.x);
    }
    [[nodiscard]] uint8_t most() const { return most_; }
    ByteImage take() { return std::move(coarse_); }

private:
    void addMeans(uint32_t rows) {
        for (uint32_t x = 0; x < coarse_.width; ++x) {
            const auto columns = covered(x, coarse_.width, fine_.x);
            uint64_t sum = 0;
            for (uint32_t j = 0; j < rows; ++j)
                for (uint32_t i = columns.first; i < columns.second; ++i) sum += rows_[size_t{j} * fine_.x + i];
            const uint64_t count = uint64_t{columns.second - columns.first} * rows;
            coarse_.values.push_back(uint8_t((sum + count / 2) / count));
        }
    }

    glm::uvec2 fine_;
    ByteImage coarse_;
    std::vector<uint8_t> rows_;  // the last that were read, and that are not done with
    uint32_t count_ = 0;         // of the rows read
    uint8_t most_ = 0;
};

/// Returns an image of half the edges, whose texels are means.
ByteImage halved(const ByteImage& fine) {
    ChannelRows coarse({fine.width, fine.height}, {std::max(fine.width / 2, 1u), std::max(fine.height / 2, 1u)});
    const std::span<const uint8_t> values(fine.values);
    for (uint32_t y = 0; y < fine.height; ++y) coarse.add(values.subspan(size_t{y} * fine.width, fine.width));
    return coarse.take();
}

bool mayBeHalved(glm::uvec2 size) { return std::min(size.x, size.y) >= 2 * kLeastEdge; }

uint8_t bitOf(uint8_t alpha, double cutoff) { return alpha < cutoff ? AlphaMask::kCut : AlphaMask::kKept; }

/// Returns an image whose bits say what blocks of `edge` x `edge` values have. `bitsOf`: of a value.
template <class BitsOf>
ByteImage blocksOf(const ByteImage& fine, uint32_t edge, BitsOf bitsOf) {
    ByteImage coarse{(fine.width + edge - 1) / edge, (fine.height + edge - 1) / edge, {}};
    coarse.values.assign(size_t{coarse.width} * coarse.height, 0);
    for (uint32_t y = 0; y < fine.height; ++y)
        for (uint32_t x = 0; x < fine.width; ++x)
            coarse.values[size_t{y / edge} * coarse.width + x / edge] |=
                bitsOf(fine.values[size_t{y} * fine.width + x]);
    return coarse;
}

}  // namespace

AlphaMask::AlphaMask(ByteImage alpha, double cutoff, Wrap wrapU, Wrap wrapV)
    : cutoff_(cutoff), wrapU_(wrapU), wrapV_(wrapV) {
    contents_.push_back(blocksOf(alpha, kBlockEdge, [&](uint8_t value) { return bitOf(value, cutoff); }));
    while (contents_.back().values.size() > 1)
        contents_.push_back(blocksOf(contents_.back(), 2, [](uint8_t content) { return content; }));
    levels_.push_back(std::move(alpha));
    while (mayBeHalved({levels_.back().width, levels_.back().height})) levels_.push_back(halved(levels_.back()));
}

uint64_t AlphaMask::bytes() const {
    uint64_t bytes = 0;
    for (const auto* levels : {&levels_, &contents_})
        for (const ByteImage& level : *levels) bytes += level.values.size();
    return bytes;
}

double AlphaMask::marginAt(glm::dvec2 at, uint32_t number) const {
    const ByteImage& level = levels_[number];
    const double x = at.x * (level.width / size().x) - 0.5, y = at.y * (level.height / size().y) - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const uint32_t columns[2] = {wrappedTexel(left, level.width, wrapU_), wrappedTexel(left + 1, level.width, wrapU_)};
    double rows[2];
    for (int j = 0; j < 2; ++j) {
        const uint8_t* const row = &level.values[size_t{wrappedTexel(top + j, level.height, wrapV_)} * level.width];
        // Between equal values this is their value, to the last bit.
        rows[j] = row[columns[0]] + (x - left) * (double(row[columns[1]]) - row[columns[0]]);
    }
    return rows[0] + (y - top) * (rows[1] - rows[0]) - cutoff_;
}

AlphaMask::Content AlphaMask::contentOf(glm::dvec2 low, glm::dvec2 high) const {
    const Shown columns = shownBetween(low.x, high.x, levels_[0].width, wrapU_);
    const Shown rows = shownBetween(low.y, high.y, levels_[0].height, wrapV_);
    uint32_t longest = 0;
    for (const Shown* each : {&columns, &rows})
        for (size_t r = 0; r < each->count; ++r)
            longest = std::max(longest, each->ranges[r].last - each->ranges[r].first);
    const auto contentIn = [&](const ByteImage& image, uint32_t edge, auto bitsOf) {
        uint8_t content = kNothing;
        for (size_t r = 0; r < rows.count; ++r)
            for (size_t c = 0; c < columns.count; ++c)
                for (uint32_t y = rows.ranges[r].first / edge; y <= rows.ranges[r].last / edge; ++y)
                    for (uint32_t x = columns.ranges[c].first / edge; x <= columns.ranges[c].last / edge; ++x)
                        content |= bitsOf(image.values[size_t{y} * image.width + x]);
        return Content(content);
    };
    constexpr uint32_t kMost = 4;  // texels or blocks that are looked at along an edge
    if (longest <= kMost) return contentIn(levels_[0], 1, [&](uint8_t value) { return bitOf(value, cutoff_); });
    uint32_t level = 0;
    while (level + 1 < contents_.size() && longest / (kBlockEdge << level) >= kMost) ++level;
    return contentIn(contents_[level], kBlockEdge << level, [](uint8_t content) { return content; });
}

bool mayCut(const Material& material) {
    const MaskRule& rule = material.mask;
    if (rule.cutoff > 1) return true;
    return rule.image.exists() && (rule.mayBeGrey || mayBeTransparent(rule.image));
}

namespace {

// Larger masks are read at a coarser level; not for lack of memory, so that what is cut does not depend on it.
constexpr uint64_t kMostTexels = uint64_t{4096} * 4096;

uint8_t greyOf(Rgba8 c) {
    return uint8_t((299 * (c & 255u) + 587 * (c >> 8 & 255u) + 114 * (c >> 16 & 255u) + 500) / 1000);
}

}  // namespace

Result<AlphaMask> loadMask(const Material& material, uint64_t mostBytes) {
    const MaskRule& rule = material.mask;
    VCP_TRY_ASSIGN(const auto image, openImage(rule.image));
    if (image->heldBytes() > mostBytes)
        return namedImageError(
            rule.image,
            {.code = ErrorCode::Limit,
             .message = fmt::format("a mask that takes {} MiB while it is read, and {} MiB are there for it; let the "
                                    "memory cap be larger",
                                    (image->heldBytes() >> 20) + 1, mostBytes >> 20)});
    const glm::uvec2 size = image->size();
    glm::uvec2 kept = size;
    while (uint64_t{kept.x} * kept.y > kMostTexels && mayBeHalved(kept)) kept = glm::max(kept / 2u, glm::uvec2(1));
    ChannelRows alpha(size, kept), grey(size, rule.mayBeGrey ? kept : glm::uvec2(1));
    std::vector<Rgba8> texels(size.x);
    std::vector<uint8_t> row(size.x);
    bool isOpaque = true;
    for (uint32_t y = 0; y < size.y; ++y) {
        if (const auto read = image->read(texels); !read) return namedImageError(rule.image, read.error());
        std::transform(texels.begin(), texels.end(), row.begin(), [](Rgba8 texel) { return uint8_t(texel >> 24); });
        isOpaque = isOpaque && std::all_of(row.begin(), row.end(), [](uint8_t a) { return a == 255; });
        alpha.add(row);
        if (!rule.mayBeGrey) continue;
        std::transform(texels.begin(), texels.end(), row.begin(), greyOf);
        grey.add(row);
    }
    ChannelRows& counts = rule.mayBeGrey && isOpaque ? grey : alpha;
    double cutoff = 255 * rule.cutoff;
    if (rule.sparesGlass && counts.most() < cutoff) cutoff = 0;
    return AlphaMask(counts.take(), cutoff, material.wrapU, material.wrapV);
}

}  // namespace vcp
