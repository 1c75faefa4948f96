// Marchers of height fields: relief mapping with its refinements, and the maximum pyramid with closed-form cells.
#include <array>
#include <limits>

#include <glm/geometric.hpp>

#include "mesostructure/cell_solve.h"
#include "mesostructure/grid_walk.h"

namespace vcp::meso {

namespace {

using glm::ivec2, glm::vec3;

class Relief final : public Marcher {
public:
    Relief(const HeightMap& map, const ReliefOptions& options) : map_(map), options_(options) {}

    MarchResult march(const MarchRay& ray) const override {
        MarchResult result;
        const Line line(*this, ray);
        // f > 0 above the surface; the slab's height is 1.
        float low = 0, fLow = line.f(0, result);
        for (int i = 1; i <= options_.steps; ++i) {
            ++result.iterations;
            const float high = line.end * (float(i) / float(options_.steps));
            float fHigh = line.f(high, result);
            // The slab's bottom is below every height, however it rounds.
            if (i == options_.steps && line.bottomIsEnd) fHigh = std::min(fHigh, 0.0f);
            if (fLow > 0 && fHigh <= 0) {
                result.state = MarchState::Hit;
                result.t = options_.refinement == Refinement::SecantAsPrinted
                               ? asPrinted(line, low, fLow, high, fHigh, result)
                               : refine(line, low, fLow, high, fHigh, result);
                return result;
            }
            low = high, fLow = fHigh;
        }
        return result;
    }
    uint64_t bytes() const override { return map_.texels.size() * 2; }
    bool isConservative() const override { return false; }

private:
    struct Line {
        const Relief& relief;
        vec3 o, d;  ///< texels along x and y, the slab's height along z
        float end;
        bool bottomIsEnd;
        Line(const Relief& r, const MarchRay& ray) : relief(r) {
            const glm::dvec3 scale(r.map_.size.x, r.map_.size.x, 1 / r.map_.range);
            o = vec3(inFirstTile(ray.origin, r.map_.extent()) * scale), d = vec3(ray.direction * scale);
            const float leaves = d.z < 0 ? -o.z / d.z : d.z > 0 ? (1 - o.z) / d.z : 64.0f;
            end = std::clamp(leaves, 0.0f, std::min(float(ray.tMax), 64.0f));
            bottomIsEnd = d.z < 0 && end == leaves;
        }
        float f(float t, MarchResult& result) const {
            ++result.fetches;
            const vec3 p = o + t * d;
            return p.z - relief.sample(p.x, p.y);
        }
    };

    float sample(float x, float y) const {
        const float i = std::floor(x), j = std::floor(y), u = x - i, v = y - j;
        const auto height = [&](int a, int b) { return float(map_.texel(int(i) + a, int(j) + b)) * (1.0f / 65535); };
        return glm::mix(glm::mix(height(0, 0), height(1, 0), u), glm::mix(height(0, 1), height(1, 1), u), v);
    }

    float refine(const Line& line, float low, float fLow, float high, float fHigh, MarchResult& result) const {
        if (options_.refinement == Refinement::None) return high;
        float t = high;
        int kept = 0;  // which end the last step kept: -1 low, +1 high
        for (int i = 0; i < options_.refinements; ++i) {
            const float chord = low + (high - low) * (fLow / (fLow - fHigh));
            t = options_.refinement == Refinement::Binary || !(chord >= low && chord <= high) ? 0.5f * (low + high)
                                                                                              : chord;
            ++result.iterations, ++result.surfaceTests;
            const float f = line.f(t, result);
            if (std::abs(f) < options_.tolerance || f == 0) break;
            // Illinois (Dowell and Jarratt 1971): an end that is kept twice counts half.
            if (f > 0) {
                if (options_.refinement == Refinement::Illinois && kept == 1) fHigh *= 0.5f;
                low = t, fLow = f, kept = 1;
            } else {
                if (options_.refinement == Refinement::Illinois && kept == -1) fLow *= 0.5f;
                high = t, fHigh = f, kept = -1;
            }
        }
        return t;
    }

    /// Refines as the listing does, with depths from the top: the branch replaces the upper bound by what is below the
    /// surface.
    float asPrinted(const Line& line, float low, float fLow, float high, float fHigh, MarchResult& result) const {
        const float slope = -line.d.z, depth0 = 1 - line.o.z;
        // The depth of the surface is the depth of the ray + f.
        float upperD = low, upperH = depth0 + slope * low + fLow, lowerD = high, lowerH = depth0 + slope * high + fHigh,
              best = upperH;
        for (int i = 0; i < options_.refinements; ++i) {
            const float lineSlope = (upperH - lowerH) / (upperD - lowerD),
                        at = (upperH - lineSlope * upperD - depth0) / (slope - lineSlope);
            if (!std::isfinite(at)) break;
            ++result.iterations, ++result.surfaceTests;
            const float f = line.f(at, result), depth = depth0 + slope * at, surface = depth + f;
            best = surface;
            if (surface < depth)
                upperH = surface, upperD = at;
            else
                lowerH = surface, lowerD = at;
            if (std::abs(f) <= options_.tolerance) break;
        }
        const float t = (best - depth0) / slope;
        return std::isfinite(t) ? t : high;
    }

    const HeightMap& map_;
    ReliefOptions options_;
};

class Pyramid final : public Marcher {
public:
    explicit Pyramid(const HeightMap& map) : map_(map), levels_(buildMaxPyramid(map).levels) {}

    MarchResult march(const MarchRay& ray) const override {
        MarchResult result;
        // Cells are texels along x and y, and the slab is one cell high.
        const TileGrid grid({map_.size.x, map_.size.y, 1}, map_.extent());
        GridWalk walk(ray, grid);
        bool outside = walk.startsAtTop;
        int level = int(levels_.size()) - 1;
        while (walk.cell.z == 0 && walk.t <= walk.tMax) {
            if (result.iterations++ == kMostIterations) {
                result.state = MarchState::Unresolved;
                return result;
            }
            glm::ivec3 further(0);
            const ivec2 home(wrapped(walk.cell.x, map_.size.x), wrapped(walk.cell.y, map_.size.y));
            for (int axis = 0; axis < 2; ++axis) {
                const int first = home[axis] >> level << level,
                          last = std::min(first + (1 << level), map_.size[axis]) - 1;
                further[axis] = walk.sign[axis] > 0 ? last - home[axis] : home[axis] - first;
            }
            int axisOut = 0;
            const float exit = walk.exit(further, axisOut), end = std::max(walk.t, std::min(exit, walk.tMax));
            ++result.fetches;
            const Level& maxima = levels_[size_t(level)];
            const float most =
                float(maxima.most[size_t(home.y >> level) * size_t(maxima.size.x) + size_t(home.x >> level)]) *
                (1.0f / 65535);
            // Where the ray leaves by the slab's bottom its height is 0, however that rounds: ground at 0 is a tie
            // there.
            const float atEnd = axisOut == 2 && end == exit ? float(walk.sign.z > 0) : walk.at(end).z,
                        lowest = std::min(walk.at(walk.t).z, atEnd);
            const bool isAbove = lowest > most && (outside || level > 0 || walk.t > 0);
            if (!isAbove && level > 0) {
                --level;
                continue;
            }
            if (isAbove)
                outside = true;
            else if (solve(walk, end, outside, result))
                return result;
            if (exit >= kFar) break;
            walk.leave(further, exit, axisOut);
            if (isAbove) level = std::min(level + 1, int(levels_.size()) - 1);
        }
        // No height is below the slab's bottom, however the ray's end there rounds.
        if (walk.cell.z < 0 && walk.sign.z < 0 && outside && walk.t <= walk.tMax) {
            result.state = MarchState::Hit;
            result.t = walk.t, result.normal = {0, 0, 1};
        }
        return result;
    }
    uint64_t bytes() const override {
        uint64_t sum = map_.texels.size() * 2;
        for (const Level& level : levels_) sum += level.most.size() * 2;
        return sum;
    }
    bool isConservative() const override { return true; }

private:
    using Level = MaxPyramid::Level;

    bool solve(const GridWalk& walk, float end, bool& outside, MarchResult& result) const {
        ++result.fetches, ++result.surfaceTests;
        const float entry = std::min(walk.entry(), end);
        const int x = walk.cell.x, y = walk.cell.y;
        const auto height = [&](int i, int j) { return float(map_.texel(x + i, y + j)) * (1.0f / 65535); };
        const BilinearCell<float> cell{height(0, 0), height(1, 0), height(0, 1), height(1, 1)};
        const vec3 o = walk.at(entry) - vec3(walk.cell);
        const CellHit<float> found = cell.firstEntry(o, walk.d, 0, end - entry, outside);
        outside = found.outside;
        if (!found.hit) return false;
        result.state = MarchState::Hit;
        result.t = entry + found.t;
        const vec3 p = o + found.t * walk.d;
        const float dx = glm::mix(cell.h10 - cell.h00, cell.h11 - cell.h01, p.y),
                    dy = glm::mix(cell.h01 - cell.h00, cell.h11 - cell.h10, p.x);
        const float texels = float(map_.size.x * map_.range);
        result.normal = glm::normalize(vec3(-dx * texels, -dy * texels, 1));
        return true;
    }

    const HeightMap& map_;
    std::vector<Level> levels_;  ///< level 0: maxima of the texels' bilinear cells
};

MaxPyramid::Level halved(const MaxPyramid::Level& fine) {
    MaxPyramid::Level coarse{(fine.size + 1) / 2, {}};
    coarse.most.resize(size_t(coarse.size.x) * size_t(coarse.size.y));
    for (int y = 0; y < fine.size.y; ++y)
        for (int x = 0; x < fine.size.x; ++x) {
            uint16_t& most = coarse.most[size_t(y / 2) * size_t(coarse.size.x) + size_t(x / 2)];
            most = std::max(most, fine.most[size_t(y) * size_t(fine.size.x) + size_t(x)]);
        }
    return coarse;
}

}  // namespace

MaxPyramid buildMaxPyramid(const HeightMap& map) {
    MaxPyramid pyramid;
    MaxPyramid::Level base{map.size, std::vector<uint16_t>(map.texels.size())};
    for (int y = 0; y < map.size.y; ++y)
        for (int x = 0; x < map.size.x; ++x)
            base.most[size_t(y) * size_t(map.size.x) + size_t(x)] =
                std::max({map.texel(x, y), map.texel(x + 1, y), map.texel(x, y + 1), map.texel(x + 1, y + 1)});
    pyramid.levels.push_back(std::move(base));
    while (pyramid.levels.back().size.x > 1 || pyramid.levels.back().size.y > 1)
        pyramid.levels.push_back(halved(pyramid.levels.back()));
    return pyramid;
}

std::unique_ptr<Marcher> reliefMarcher(const HeightMap& map, const ReliefOptions& options) {
    return std::make_unique<Relief>(map, options);
}
std::unique_ptr<Marcher> pyramidMarcher(const HeightMap& map) { return std::make_unique<Pyramid>(map); }

}  // namespace vcp::meso
