#include "mesostructure/base/texel_values.h"

#include <algorithm>
#include <limits>
#include <map>

#include <glm/geometric.hpp>

namespace vcp::meso {

namespace {

using glm::ivec2;

template <class Value>
void fill(const TexelCharts& of, std::span<Value> values) {
    const int size = of.map.size;
    std::vector<size_t> missing;
    for (size_t i = 0; i < values.size(); ++i)
        if (of.owners[i] != kNoTriangle && isMissing(values[i])) missing.push_back(i);
    std::vector<std::pair<size_t, Value>> found;
    do {
        found.clear();
        std::vector<size_t> left;
        for (const size_t texel : missing) {
            const int x = int(texel % size_t(size)), y = int(texel / size_t(size));
            Value sum(0);
            int count = 0;
            for (int j = std::max(0, y - 1); j <= std::min(size - 1, y + 1); ++j)
                for (int i = std::max(0, x - 1); i <= std::min(size - 1, x + 1); ++i) {
                    const size_t other = size_t(i) + size_t(size) * size_t(j);
                    const uint32_t owner = of.owners[other];
                    if (owner == kNoTriangle || of.charts[owner] != of.charts[of.owners[texel]] ||
                        isMissing(values[other]))
                        continue;
                    sum += values[other], ++count;
                }
            if (count > 0)
                found.emplace_back(texel, sum / float(count));
            else
                left.push_back(texel);
        }
        for (const auto& [texel, value] : found) values[texel] = value;
        missing = std::move(left);
    } while (!found.empty());
}

template <class Value>
class EdgeConformer {
public:
    EdgeConformer(const BaseSurface& surface, const TexelMap& map, std::span<Value> values)
        : surface_(surface), map_(map), values_(values) {}

    void run() {
        corners();
        edges();
        for (size_t i = 0; i < surface_.triangles.size(); ++i) goOn(i);
    }

private:
    Value& at(ivec2 texel) { return values_[size_t(texel.x) + size_t(map_.size) * size_t(texel.y)]; }

    void corners() {
        std::vector<Value> known(surface_.positions.size(), Value(std::numeric_limits<float>::quiet_NaN()));
        for (size_t i = 0; i < surface_.triangles.size(); ++i)
            for (int k = 0; k < 3; ++k)
                if (Value& value = known[surface_.triangles[i][k]]; isMissing(value)) value = at(map_.onEdge(i, k, 0));
        for (size_t i = 0; i < surface_.triangles.size(); ++i)
            for (int k = 0; k < 3; ++k) at(map_.onEdge(i, k, 0)) = known[surface_.triangles[i][k]];
    }

    /// An edge of a triangle, from its corner k on; it runs from the position of the lower number, or towards it.
    struct Side {
        size_t triangle;
        int k;
        bool isReversed;
    };

    void edges() {
        std::map<std::pair<uint32_t, uint32_t>, std::vector<Side>> sides;
        for (size_t i = 0; i < surface_.triangles.size(); ++i)
            for (int k = 0; k < 3; ++k) {
                const uint32_t a = surface_.triangles[i][k], b = surface_.triangles[i][(k + 1) % 3];
                sides[{std::min(a, b), std::max(a, b)}].push_back({i, k, a > b});
            }
        for (const auto& [ends, all] : sides)
            if (all.size() > 1) join(all);
    }

    Value& onSide(const Side& side, int step) {
        const int n = map_.steps[side.triangle];
        return at(map_.onEdge(side.triangle, side.k, side.isReversed ? n - step : step));
    }

    void join(const std::vector<Side>& sides) {
        int fewest = kMostChartSteps;
        for (const Side& side : sides) fewest = std::min(fewest, map_.steps[side.triangle]);
        std::vector<Value> values(size_t(fewest) + 1, Value(std::numeric_limits<float>::quiet_NaN()));
        for (const Side& side : sides) {
            const int times = map_.steps[side.triangle] / fewest;
            for (int s = 0; s <= fewest; ++s)
                if (isMissing(values[size_t(s)])) values[size_t(s)] = onSide(side, s * times);
        }
        for (const Side& side : sides) {
            const int times = map_.steps[side.triangle] / fewest;
            for (int s = 0; s <= fewest * times; ++s) {
                const int low = s / times, rest = s % times;
                const float part = float(rest) / float(times);
                onSide(side, s) =
                    rest == 0 ? values[size_t(low)] : values[size_t(low)] * (1 - part) + values[size_t(low) + 1] * part;
            }
        }
    }

    /// Lets the values go on straight beyond the edges: slopes there are those within. The hypotenuse runs through the
    /// diagonals of cells, whose bilinear values are linear along it where a corner is the sum of its two neighbours
    /// less the corner opposite.
    void goOn(size_t triangle) {
        const auto& p = map_.places[triangle];
        int right = 0;
        for (int k = 0; k < 3; ++k)
            if (glm::dot(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]) == 0) right = k;
        const int n = map_.steps[triangle];
        const ivec2 from(p[right]), x = (ivec2(p[(right + 1) % 3]) - from) / n,
                                    y = (ivec2(p[(right + 2) % 3]) - from) / n;
        const auto value = [&](int i, int j) -> Value& { return at(from + i * x + j * y); };
        for (int i = 0; i < n; ++i)
            value(i + 1, n - i) = value(i, n - i) + value(i + 1, n - i - 1) - value(i, n - i - 1);
        value(n + 1, 0) = 2.0f * value(n, 0) - value(n - 1, 0);
        value(0, n + 1) = 2.0f * value(0, n) - value(0, n - 1);
        for (int i = 0; i <= n; ++i)
            value(i + 1, n - i + 1) = value(i + 1, n - i) + value(i, n - i + 1) - value(i, n - i);
        for (int i = 0; i <= n + 1; ++i) {
            value(i, -1) = 2.0f * value(i, 0) - value(i, 1);
            value(-1, i) = 2.0f * value(0, i) - value(1, i);
        }
        value(-1, -1) = value(-1, 0) + value(0, -1) - value(0, 0);
    }

    const BaseSurface& surface_;
    const TexelMap& map_;
    std::span<Value> values_;
};

}  // namespace

void fillMissing(const TexelCharts& of, std::span<float> values) { fill(of, values); }
void fillMissing(const TexelCharts& of, std::span<glm::vec3> values) { fill(of, values); }

void conformEdges(const BaseSurface& surface, const TexelMap& map, std::span<float> values) {
    if (map.isAtlas()) EdgeConformer(surface, map, values).run();
}
void conformEdges(const BaseSurface& surface, const TexelMap& map, std::span<glm::vec3> values) {
    if (map.isAtlas()) EdgeConformer(surface, map, values).run();
}

}  // namespace vcp::meso
