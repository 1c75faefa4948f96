// How the heights of a filter level are found. The volume between a level and the map is measured at the map's texels,
// where the level is bilinear between its corners: a sum of absolute values of affine functions of the heights, which
// is convex, so that a least volume is the least.
#include <algorithm>
#include <cmath>
#include <limits>

#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

namespace {

/// Where the map's texels of a row lie between the corners of a level's row.
struct Places {
    std::vector<int> corner;
    std::vector<float> part;

    Places(int texels, int corners) : corner(size_t(texels)), part(size_t(texels)) {
        for (int i = 0; i < texels; ++i) {
            const double at = double(i) * corners / texels;
            corner[size_t(i)] = int(at);
            part[size_t(i)] = float(at - int(at));
        }
    }
};

/// By how much the map's texels count to the corners of a coarser grid, along one axis: as much as the corners count to
/// them. The shares of a corner add up to 1.
class Tents {
public:
    struct Share {
        int texel;
        float weight;
    };

    Tents(int texels, int corners) : shares_(size_t(corners)) {
        const Places places(texels, corners);
        for (int i = 0; i < texels; ++i) {
            const int corner = places.corner[size_t(i)];
            const float part = places.part[size_t(i)];
            shares_[size_t(corner)].push_back({i, 1 - part});
            if (part > 0) shares_[size_t((corner + 1) % corners)].push_back({i, part});
        }
        for (auto& shares : shares_) {
            double sum = 0;
            for (const Share& share : shares) sum += share.weight;
            for (Share& share : shares) share.weight = float(share.weight / sum);
        }
    }
    [[nodiscard]] const std::vector<Share>& of(int corner) const { return shares_[size_t(corner)]; }

private:
    std::vector<std::vector<Share>> shares_;
};

/// The bilinear map B from a level's heights to the map's texels.
class Interpolation {
public:
    Interpolation(glm::ivec2 map, glm::ivec2 level)
        : map_(map), level_(level), x_(map.x, level.x), y_(map.y, level.y) {}

    /// Calls `use(texel, corners, weights)` for each of the map's texels.
    template <class Use>
    void each(const Use& use) const {
        for (int j = 0; j < map_.y; ++j) {
            const auto row = size_t(level_.x) * size_t(y_.corner[size_t(j)]),
                       next = size_t(level_.x) * size_t((y_.corner[size_t(j)] + 1) % level_.y);
            const float v = y_.part[size_t(j)];
            for (int i = 0; i < map_.x; ++i) {
                const auto left = size_t(x_.corner[size_t(i)]), right = size_t((x_.corner[size_t(i)] + 1) % level_.x);
                const float u = x_.part[size_t(i)];
                const size_t corners[4] = {row + left, row + right, next + left, next + right};
                const float weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
                use(size_t(i) + size_t(map_.x) * size_t(j), corners, weights);
            }
        }
    }

private:
    glm::ivec2 map_, level_;
    Places x_, y_;
};

using Heights = std::vector<float>;

/// The map or a level of it, as it is fitted.
struct FloatMap {
    glm::ivec2 size;
    Heights heights;

    explicit FloatMap(const HeightLevel& of) : size(of.size), heights(of.texels.size()) {
        std::ranges::transform(of.texels, heights.begin(), [](uint16_t texel) { return float(texel / 65535.0); });
    }
};

float interpolated(const Heights& heights, const size_t (&corners)[4], const float (&weights)[4]) {
    return weights[0] * heights[corners[0]] + weights[1] * heights[corners[1]] + weights[2] * heights[corners[2]] +
           weights[3] * heights[corners[3]];
}

double volumeOf(const Interpolation& places, const FloatMap& map, const Heights& heights) {
    double sum = 0;
    places.each([&](size_t texel, const size_t(&corners)[4], const float(&weights)[4]) {
        sum += std::abs(double(interpolated(heights, corners, weights)) - map.heights[texel]);
    });
    return sum / double(map.heights.size());
}

/// The method as printed (4.2). Heights are in units of 16-bit texels, epsilon is 10^-4 of them, lambda falls from 2^6
/// to 2^-2; eq. 12 divides by the influenced area, so that a step is at most lambda. A lambda is left where the volume
/// no longer falls.
int fitAsPrinted(const Interpolation& places, const FloatMap& map, int mostIterations, Heights& heights) {
    constexpr double kUnits = 65535, kEpsilon = 1e-4;
    double volume = volumeOf(places, map, heights);
    int iterations = 0;
    std::vector<double> difference(heights.size()), area(heights.size());
    for (double lambda = 64; lambda >= 0.25; lambda /= 2)
        for (; iterations < mostIterations; ++iterations) {
            std::ranges::fill(difference, 0), std::ranges::fill(area, 0);
            places.each([&](size_t texel, const size_t(&corners)[4], const float(&weights)[4]) {
                const double off = kUnits * (double(interpolated(heights, corners, weights)) - map.heights[texel]);
                for (int k = 0; k < 4; ++k) {
                    difference[corners[k]] += std::abs(off + kEpsilon * weights[k]) - std::abs(off);
                    area[corners[k]] += weights[k] > 0 ? 1 : 0;
                }
            });
            Heights moved = heights;
            for (size_t i = 0; i < moved.size(); ++i)
                if (area[i] > 0) moved[i] -= float(lambda * difference[i] / (kEpsilon * area[i]) / kUnits);
            const double next = volumeOf(places, map, moved);
            if (!(next < volume)) break;
            volume = next, heights = std::move(moved);
        }
    return iterations;
}

/// Least volume within boxes, by the primal-dual method with diagonal steps (Pock and Chambolle 2011): the primal
/// heights h, and y in [-1, 1] for each texel of the map m. For any y, -y.m + sum of the least h (B^T y) within the
/// boxes is below the least volume: the bound.
class LeastVolume {
public:
    LeastVolume(const Interpolation& places, const FloatMap& map, Heights start)
        : places_(places),
          map_(map),
          heights_(std::move(start)),
          ahead_(heights_),
          least_(heights_.size(), 1),
          most_(heights_.size(), 0),
          step_(heights_.size(), 0),
          dual_(map.heights.size(), 0),
          pull_(heights_.size()) {
        places_.each([&](size_t texel, const size_t(&corners)[4], const float(&weights)[4]) {
            for (int k = 0; k < 4; ++k) {
                if (weights[k] <= 0) continue;
                float &least = least_[corners[k]], &most = most_[corners[k]];
                least = std::min(least, map_.heights[texel]), most = std::max(most, map_.heights[texel]);
                step_[corners[k]] += weights[k];
            }
        });
        for (size_t i = 0; i < heights_.size(); ++i) heights_[i] = std::clamp(heights_[i], least_[i], most_[i]);
        ahead_ = best_ = heights_;
        volume_ = volumeOf(places_, map_, heights_);
        scale_ = std::max(volume_, 1e-6);
    }

    void iterate(int count) {
        for (int i = 0; i < count; ++i) {
            std::ranges::fill(pull_, 0.0f);
            places_.each([&](size_t texel, const size_t(&corners)[4], const float(&weights)[4]) {
                float& y = dual_[texel];
                const float off = interpolated(ahead_, corners, weights) - map_.heights[texel];
                y = std::clamp(y + off / float(scale_), -1.0f, 1.0f);
                for (int k = 0; k < 4; ++k) pull_[corners[k]] += weights[k] * y;
            });
            for (size_t k = 0; k < heights_.size(); ++k) {
                const float before = heights_[k];
                heights_[k] = std::clamp(before - float(scale_) * pull_[k] / step_[k], least_[k], most_[k]);
                ahead_[k] = 2 * heights_[k] - before;
            }
        }
        if (const double now = volumeOf(places_, map_, heights_); now < volume_) volume_ = now, best_ = heights_;
        double dual = 0;
        for (size_t i = 0; i < dual_.size(); ++i) dual -= double(dual_[i]) * map_.heights[i];
        for (size_t k = 0; k < heights_.size(); ++k)
            dual += std::min(double(least_[k]) * pull_[k], double(most_[k]) * pull_[k]);
        bound_ = std::max(bound_, dual / double(dual_.size()));
    }

    [[nodiscard]] double volume() const { return volume_; }
    [[nodiscard]] double bound() const { return bound_; }
    [[nodiscard]] Heights takeBest() { return std::move(best_); }

private:
    const Interpolation& places_;
    const FloatMap& map_;
    Heights heights_, ahead_, best_, least_, most_, step_, dual_, pull_;
    double volume_ = 0, bound_ = 0, scale_ = 1;
};

constexpr int kIterationsBetweenBounds = 20;

}  // namespace

double levelVolume(const HeightLevel& map, const HeightLevel& level) {
    return volumeOf(Interpolation(map.size, level.size), FloatMap(map), FloatMap(level).heights);
}

Result<HeightLevel> averagedLevel(const HeightLevel& from, glm::ivec2 size, const HeightStore& store) {
    constexpr int kLetGo = 64;  // rows
    const Tents x(from.size.x, size.x), y(from.size.y, size.y);
    VCP_TRY_ASSIGN(auto rows, HeightRows::create(size, store));
    std::vector<uint16_t> made(size_t(size.x));
    Heights column(size_t(from.size.x));
    for (int j = 0; j < size.y; ++j) {
        std::ranges::fill(column, 0.0f);
        for (const Tents::Share& share : y.of(j)) {
            const uint16_t* row = &from.texels[size_t(share.texel) * column.size()];
            for (size_t i = 0; i < column.size(); ++i) column[i] += share.weight * float(row[i]);
        }
        for (int i = 0; i < size.x; ++i) {
            float sum = 0;
            for (const Tents::Share& share : x.of(i)) sum += share.weight * column[size_t(share.texel)];
            made[size_t(i)] = uint16_t(std::min(sum + 0.5f, 65535.0f));
        }
        VCP_TRY(rows.write(j, made));
        if (j % kLetGo == 0) from.texels.letGo();
    }
    return HeightLevel{size, std::move(rows).take()};
}

Result<HeightLevel> fitLevel(const HeightLevel& map, glm::ivec2 size, const LevelFitOptions& options,
                             LevelVolume& volume) {
    const Interpolation places(map.size, size);
    const FloatMap heights(map);
    VCP_TRY_ASSIGN(const auto averaged, averagedLevel(map, size));
    Heights fitted = FloatMap(averaged).heights;
    volume = {.averaged = volumeOf(places, heights, fitted)};
    if (options.fit == LevelFit::Printed) {
        volume.iterations = fitAsPrinted(places, heights, options.mostIterations, fitted);
    } else {
        LeastVolume fit(places, heights, std::move(fitted));
        while (volume.iterations < options.mostIterations && fit.volume() - fit.bound() > options.gap * fit.volume()) {
            fit.iterate(kIterationsBetweenBounds);
            volume.iterations += kIterationsBetweenBounds;
        }
        volume.bound = fit.bound();
        fitted = fit.takeBest();
    }
    volume.fitted = volumeOf(places, heights, fitted);
    // The range's ends are multiples of the step, so that nothing overshoots for being rounded.
    std::vector<uint16_t> rounded(fitted.size());
    std::ranges::transform(fitted, rounded.begin(),
                           [](float height) { return uint16_t(std::lround(65535 * std::clamp(height, 0.0f, 1.0f))); });
    return HeightLevel{size, std::move(rounded)};
}

}  // namespace vcp::meso
