#include "mesostructure/base/texel_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, glm::ivec2;
using Places = std::array<dvec2, 3>;

/// A block of two halves with n steps has n + kAround texels an edge: around the block lies one texel, and between the
/// two hypotenuses five diagonals, two of which are each one's own.
constexpr int kAround = 6;

double twiceAreaOf(const Places& p) {
    const dvec2 a = p[1] - p[0], b = p[2] - p[0];
    return a.x * b.y - a.y * b.x;
}

/// Which corner is opposite to the longest edge.
int rightAngleOf(const BaseSurface& surface, size_t triangle) {
    const auto& t = surface.triangles[triangle];
    int best = 0;
    double longest = -1;
    for (int k = 0; k < 3; ++k) {
        const double length = glm::distance(surface.positions[t[(k + 1) % 3]], surface.positions[t[(k + 2) % 3]]);
        if (length > longest) longest = length, best = k;
    }
    return best;
}

/// Lays blocks of falling size in rows from the lower left. Returns the corners of the blocks, or none where they do
/// not fit.
std::vector<ivec2> rowsOf(const std::vector<int>& edges, int size) {
    std::vector<ivec2> corners;
    ivec2 at(0);
    int high = 0;
    for (const int edge : edges) {
        if (at.x + edge > size) at = {0, at.y + high}, high = 0;
        if (at.x + edge > size || at.y + edge > size) return {};
        high = std::max(high, edge);
        corners.push_back(at);
        at.x += edge;
    }
    return corners;
}

class AtlasMaker {
public:
    AtlasMaker(const BaseSurface& surface, int size) : surface_(surface), size_(size) {
        for (size_t i = 0; i < surface.triangles.size(); ++i) edges_.push_back(std::sqrt(areaOf(surface, i)));
    }

    /// Lays the charts with so many steps a world unit of an edge. Returns whether they fit.
    bool lay(double perUnit) {
        std::vector<int> steps;
        for (const double edge : edges_) {
            int n = kLeastChartSteps;
            while (n < kMostChartSteps && n * std::sqrt(2.0) < edge * perUnit) n *= 2;
            steps.push_back(n);
        }
        std::vector<uint32_t> order(steps.size());
        std::iota(order.begin(), order.end(), 0u);
        std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return steps[a] > steps[b]; });
        std::vector<std::pair<uint32_t, uint32_t>> blocks;
        std::vector<int> blockEdges;
        for (size_t i = 0; i < order.size();) {
            const bool isPair = i + 1 < order.size() && steps[order[i + 1]] == steps[order[i]];
            blocks.emplace_back(order[i], isPair ? order[i + 1] : kNoTriangle);
            blockEdges.push_back(steps[order[i]] + kAround);
            i += isPair ? 2 : 1;
        }
        const std::vector<ivec2> corners = rowsOf(blockEdges, size_);
        if (corners.size() != blocks.size()) return false;
        map_ = {.size = size_, .places = std::vector<Places>(steps.size()), .steps = std::move(steps)};
        for (size_t i = 0; i < blocks.size(); ++i) {
            place(blocks[i].first, corners[i] + 1, 1);
            if (blocks[i].second != kNoTriangle) place(blocks[i].second, corners[i] + blockEdges[i] - 2, -1);
        }
        return true;
    }

    TexelMap take() { return std::move(map_); }
    [[nodiscard]] double longest() const { return *std::max_element(edges_.begin(), edges_.end()); }

private:
    void place(uint32_t triangle, ivec2 rightAngle, int direction) {
        const int corner = rightAngleOf(surface_, triangle), n = direction * map_.steps[triangle];
        Places& at = map_.places[triangle];
        at[corner] = rightAngle;
        at[(corner + 1) % 3] = rightAngle + ivec2(n, 0);
        at[(corner + 2) % 3] = rightAngle + ivec2(0, n);
    }

    const BaseSurface& surface_;
    int size_;
    std::vector<double> edges_;
    TexelMap map_;
};

double distanceToSegment(dvec2 p, dvec2 a, dvec2 b) {
    const dvec2 along = b - a;
    const double square = glm::dot(along, along);
    const double s = square > 0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0;
    return glm::distance(p, a + s * along);
}

Error wrong(size_t triangle, std::string message) {
    return {.code = ErrorCode::InvalidInput,
            .message = std::move(message),
            .element = fmt::format("triangle {}", triangle)};
}

/// Moves all corners to the nearest texels, where that changes no triangle much.
void moveToTexels(TexelMap& map) {
    constexpr double kMostChanged = 0.1;  // of its area
    std::vector<Places> moved = map.places;
    for (size_t i = 0; i < moved.size(); ++i) {
        for (dvec2& p : moved[i]) p = glm::floor(p + 0.5);
        const double area = twiceAreaOf(map.places[i]);
        if (std::abs(twiceAreaOf(moved[i]) - area) > kMostChanged * std::abs(area)) return;
    }
    map.places = std::move(moved);
}

}  // namespace

double areaOf(const BaseSurface& surface, size_t triangle) {
    const auto& t = surface.triangles[triangle];
    const dvec3 a = surface.positions[t[0]];
    return 0.5 * glm::length(glm::cross(surface.positions[t[1]] - a, surface.positions[t[2]] - a));
}

std::vector<Places> TexelMap::tileUvs() const {
    std::vector<Places> uvs = places;
    for (Places& p : uvs)
        for (dvec2& uv : p) uv /= double(size);
    return uvs;
}

ivec2 TexelMap::onEdge(size_t triangle, int k, int s) const {
    const ivec2 from(places[triangle][k]), to(places[triangle][(k + 1) % 3]);
    return from + (to - from) / steps[triangle] * s;
}

Result<TexelMap> makeAtlas(const BaseSurface& surface, int size) {
    AtlasMaker maker(surface, size);
    const auto tooMany = [&] {
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("an atlas of {} triangles does not fit {} x {} texels; take larger maps or "
                                            "fewer triangles",
                                            surface.triangles.size(), size, size)};
    };
    // Each triangle has some 25 texels at least.
    if (surface.triangles.size() > size_t(size) * size_t(size) / 16 || !maker.lay(0)) return tooMany();
    // The greatest scale that fits, by halving.
    const double longest = maker.longest();
    double fits = 0, most = longest > 0 ? 2.0 * kMostChartSteps / longest : 0;
    for (int i = 0; i < 40 && most > 0; ++i) {
        const double middle = 0.5 * (fits + most);
        (maker.lay(middle) ? fits : most) = middle;
    }
    maker.lay(fits);
    return maker.take();
}

Result<TexelMap> givenMap(const BaseSurface& surface, int size) {
    TexelMap map{.size = size, .places = surface.uvs, .steps = {}};
    if (surface.uvs.size() != surface.triangles.size())
        return Error{.message = "not every triangle has texture coordinates"};
    for (size_t i = 0; i < map.places.size(); ++i) {
        for (dvec2& p : map.places[i]) {
            if (!std::isfinite(p.x) || !std::isfinite(p.y)) return wrong(i, "a texture coordinate is not finite");
            if (!(std::min(p.x, p.y) >= -kOnEdge && std::max(p.x, p.y) <= 1 + kOnEdge))
                return wrong(i, fmt::format("the texture coordinates ({:.6g}, {:.6g}) are outside of 0 to 1; move the "
                                            "map there, or have a new one made",
                                            p.x, p.y));
            p = p * double(size) - 0.5;
        }
        if (!(std::abs(twiceAreaOf(map.places[i])) > 1e-9) && areaOf(surface, i) > 0)
            return wrong(i, "its texture coordinates have no area; unwrap it, or have a new map made");
        for (dvec2& p : map.places[i]) p = glm::clamp(p, 0.0, double(size - 1));
    }
    moveToTexels(map);
    return map;
}

dvec3 weightsAt(const Places& corners, dvec2 at) {
    const double whole = twiceAreaOf(corners);
    if (whole == 0) return {1, 0, 0};
    const double second = twiceAreaOf({corners[0], at, corners[2]}) / whole,
                 third = twiceAreaOf({corners[0], corners[1], at}) / whole;
    return {1 - second - third, second, third};
}

Result<std::vector<uint32_t>> ownersOf(const TexelMap& map, double guard) {
    std::vector<uint32_t> owners(map.texels(), kNoTriangle);
    std::vector<float> away(map.texels(), std::numeric_limits<float>::infinity());  // below 0: inside
    for (uint32_t i = 0; i < map.places.size(); ++i) {
        const Places& p = map.places[i];
        if (twiceAreaOf(p) == 0) continue;
        const dvec2 low = glm::min(glm::min(p[0], p[1]), p[2]) - guard,
                    high = glm::max(glm::max(p[0], p[1]), p[2]) + guard;
        const int last = map.size - 1;
        for (int y = std::max(0, int(std::ceil(low.y))); y <= std::min(last, int(std::floor(high.y))); ++y)
            for (int x = std::max(0, int(std::ceil(low.x))); x <= std::min(last, int(std::floor(high.x))); ++x) {
                const dvec2 at(x, y);
                const dvec3 w = weightsAt(p, at);
                const double least = std::min({w.x, w.y, w.z});
                const size_t texel = size_t(x) + size_t(map.size) * size_t(y);
                double distance = -1;
                if (least < 1e-6)
                    distance = least >= -kOnEdge
                                   ? 0
                                   : std::min({distanceToSegment(at, p[0], p[1]), distanceToSegment(at, p[1], p[2]),
                                               distanceToSegment(at, p[2], p[0])});
                if (distance < 0 && away[texel] < 0)
                    return wrong(owners[texel],
                                 fmt::format("it and triangle {} overlap in the texture map, at ({:.6g}, {:.6g}); "
                                             "unwrap them, or have a new map made",
                                             i, (x + 0.5) / map.size, (y + 0.5) / map.size));
                if (distance > guard || float(distance) >= away[texel]) continue;
                away[texel] = float(distance), owners[texel] = i;
            }
    }
    return owners;
}

std::vector<uint32_t> chartsOf(const BaseSurface& surface, const TexelMap& map) {
    std::vector<uint32_t> charts(surface.triangles.size());
    std::iota(charts.begin(), charts.end(), 0u);
    if (map.isAtlas()) return charts;
    const auto rootOf = [&](uint32_t i) {
        while (charts[i] != i) i = charts[i] = charts[charts[i]];
        return i;
    };
    using End = std::array<double, 2>;
    std::map<std::tuple<uint32_t, uint32_t, End, End>, uint32_t> first;
    for (uint32_t i = 0; i < surface.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            uint32_t a = surface.triangles[i][k], b = surface.triangles[i][next];
            End p{map.places[i][k].x, map.places[i][k].y}, q{map.places[i][next].x, map.places[i][next].y};
            if (a > b) std::swap(a, b), std::swap(p, q);
            const auto [at, isNew] = first.try_emplace({a, b, p, q}, i);
            if (!isNew) charts[rootOf(i)] = rootOf(at->second);
        }
    for (uint32_t i = 0; i < charts.size(); ++i) charts[i] = rootOf(i);
    return charts;
}

}  // namespace vcp::meso
