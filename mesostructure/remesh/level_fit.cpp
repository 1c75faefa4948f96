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

float interpolated(const Heights& heights, const size_t (&corners)[4], const float (&weights)[4]) {
    return weights[0] * heights[corners[0]] + weights[1] * heights[corners[1]] + weights[2] * heights[corners[2]] +
           weights[3] * heights[corners[3]];
}

double volumeOf(const Interpolation& places, const HeightLevel& map, const Heights& heights) {
    double sum = 0;
    places.each([&](size_t texel, const size_t(&corners)[4], const float(&weights)[4]) {
        sum += std::abs(double(interpolated(heights, corners, weights)) - map.heights[texel]);
    });
    return sum / double(map.heights.size());
}

Heights sampled(const HeightLevel& map, glm::ivec2 size) {
    Heights made;
    for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i)
            made.push_back(map.at(int(int64_t{i} * map.size.x / size.x), int(int64_t{j} * map.size.y / size.y)));
    return made;
}

/// Returns the means of the map around the corners, by the weights with which they count.
Heights averaged(const Interpolation& places, const HeightLevel& map, size_t corners) {
    std::vector<double> sums(corners, 0), weights(corners, 0);
    places.each([&](size_t texel, const size_t(&at)[4], const float(&weight)[4]) {
        for (int k = 0; k < 4; ++k) sums[at[k]] += weight[k] * map.heights[texel], weights[at[k]] += weight[k];
    });
    Heights made(corners);
    for (size_t i = 0; i < corners; ++i) made[i] = float(sums[i] / weights[i]);
    return made;
}

/// The method as printed (4.2). Heights are in units of 16-bit texels, epsilon is 10^-4 of them, lambda falls from 2^6
/// to 2^-2; eq. 12 divides by the influenced area, so that a step is at most lambda. A lambda is left where the volume
/// no longer falls.
int fitAsPrinted(const Interpolation& places, const HeightLevel& map, int mostIterations, Heights& heights) {
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
    LeastVolume(const Interpolation& places, const HeightLevel& map, Heights start)
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
    const HeightLevel& map_;
    Heights heights_, ahead_, best_, least_, most_, step_, dual_, pull_;
    double volume_ = 0, bound_ = 0, scale_ = 1;
};

constexpr int kIterationsBetweenBounds = 20;

}  // namespace

double levelVolume(const HeightLevel& map, const HeightLevel& level) {
    return volumeOf(Interpolation(map.size, level.size), map, level.heights);
}

HeightLevel fitLevel(const HeightLevel& map, glm::ivec2 size, const LevelFitOptions& options, LevelVolume& volume) {
    const Interpolation places(map.size, size);
    HeightLevel level{size, averaged(places, map, size_t(size.x) * size_t(size.y))};
    volume = {.averaged = volumeOf(places, map, level.heights)};
    if (options.fit == LevelFit::Sampled) level.heights = sampled(map, size);
    if (options.fit == LevelFit::Printed)
        volume.iterations = fitAsPrinted(places, map, options.mostIterations, level.heights);
    if (options.fit == LevelFit::Least) {
        LeastVolume fit(places, map, std::move(level.heights));
        while (volume.iterations < options.mostIterations && fit.volume() - fit.bound() > options.gap * fit.volume()) {
            fit.iterate(kIterationsBetweenBounds);
            volume.iterations += kIterationsBetweenBounds;
        }
        volume.bound = fit.bound();
        level.heights = fit.takeBest();
    }
    volume.fitted = volumeOf(places, map, level.heights);
    return level;
}

}  // namespace vcp::meso
