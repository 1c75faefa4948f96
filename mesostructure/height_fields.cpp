// Procedural height fields: each a function of the tile's x and y with values in [0, 1].
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "mesostructure/periodic_noise.h"
#include "mesostructure/solids.h"

namespace vcp::meso {

namespace {

using std::numbers::pi;

double fbm(double x, double y, uint32_t seed) {
    double sum = 0, weight = 0.5;
    for (int octave = 0, cells = 4; octave < 6; ++octave, cells *= 2, weight *= 0.5)
        sum += weight * gradientNoise(x * cells, y * cells, cells, cells, seed + octave);
    return 0.5 + 0.75 * sum;
}

double ridged(double x, double y, uint32_t seed) {
    double sum = 0, weight = 0.5, total = 0;
    for (int octave = 0, cells = 3; octave < 6; ++octave, cells *= 2, weight *= 0.5) {
        const double ridge = 1 - std::abs(1.6 * gradientNoise(x * cells, y * cells, cells, cells, seed + octave));
        sum += weight * ridge * ridge;
        total += weight;
    }
    return (sum / total - 0.3) / 0.7;
}

double hemispheres(double x, double y, uint32_t) {
    const double u = 4 * x - std::floor(4 * x) - 0.5, v = 4 * y - std::floor(4 * y) - 0.5;
    return std::sqrt(std::max(0.0, 0.45 * 0.45 - u * u - v * v)) / 0.45;
}

double blocks(double x, double y, uint32_t seed) {
    const int i = int(std::floor(8 * x)), j = int(std::floor(8 * y));
    const double u = 8 * x - i, v = 8 * y - j;
    return std::min(u, v) < 0.12 ? 0 : 0.25 + 0.75 * hashUnit(i & 7, j & 7, seed);
}

double bricks(double x, double y, uint32_t seed) {
    const int row = int(std::floor(8 * y));
    const double shifted = 4 * x + (row & 1 ? 0.5 : 0);
    const int column = int(std::floor(shifted)) & 3;
    // Distance to the joint in tile units, with a bevel.
    const double u = shifted - std::floor(shifted), v = 8 * y - row;
    const double joint = std::min(std::min(u, 1 - u) / 4, std::min(v, 1 - v) / 8);
    const double top = 0.85 + 0.15 * hashUnit(column, row & 7, seed);
    return std::clamp((joint - 0.006) / 0.012, 0.0, 1.0) * top;
}

double ripple(double x, double y, uint32_t) {
    const double r = 40 * std::hypot(x - 0.5, y - 0.5);
    const double fade = std::clamp(2 - 4 * std::hypot(x - 0.5, y - 0.5), 0.0, 1.0);
    return 0.25 + fade * (r < 1e-9 ? 0.75 : 0.75 * std::sin(r) / r);
}

double bark(double x, double y, uint32_t seed) {
    const double warp = 0.04 * gradientNoise(x * 4, y * 4, 4, 4, seed + 40);
    double sum = 0, weight = 0.6;
    for (int octave = 0, cells = 2; octave < 5; ++octave, cells *= 2, weight *= 0.5) {
        const double ridge =
            1 - std::abs(1.7 * gradientNoise(x * cells, (y + warp) * cells * 5, cells, cells * 5, seed + octave));
        sum += weight * std::max(0.0, ridge);
    }
    return sum / 1.2;
}

double cobble(double x, double y, uint32_t seed) {
    constexpr int cells = 6;
    const int i = int(std::floor(x * cells)), j = int(std::floor(y * cells));
    double first = 9, second = 9;
    for (int dj = -2; dj <= 2; ++dj)
        for (int di = -2; di <= 2; ++di) {
            const int a = wrapped(i + di, cells), b = wrapped(j + dj, cells);
            const double px = i + di + 0.15 + 0.7 * hashUnit(a, b, seed),
                         py = j + dj + 0.15 + 0.7 * hashUnit(a, b, seed + 1);
            const double r = std::hypot(px - x * cells, py - y * cells);
            if (r < first)
                second = first, first = r;
            else
                second = std::min(second, r);
        }
    const double edge = std::clamp((second - first) / 0.7, 0.0, 1.0);
    return std::sqrt(edge * (2 - edge));
}

struct Named {
    std::string_view name;
    double range;  ///< tile units
    double (*height)(double, double, uint32_t);
};
constexpr std::array<Named, 8> kFormulas{{{"fbm", 0.15, fbm},
                                          {"ridged", 0.2, ridged},
                                          {"hemispheres", 0.125, hemispheres},
                                          {"blocks", 0.15, blocks},
                                          {"bricks", 0.05, bricks},
                                          {"ripple", 0.15, ripple},
                                          {"bark", 0.1, bark},
                                          {"cobble", 0.1, cobble}}};
constexpr std::array<std::string_view, 11> kHeightFieldNames{
    "fbm", "ridged", "hemispheres", "maze", "blocks", "bricks", "ripple", "needle", "edge", "bark", "cobble"};

/// Carves a maze by recursive backtracking on a torus of 8 x 8 rooms; walls are an eighth of a room, or one texel.
void carveMaze(std::vector<uint16_t>& heights, int n, uint32_t seed) {
    constexpr int rooms = 8;
    const int thick = std::max(1, n / (8 * rooms));
    std::array<std::array<bool, 2>, rooms * rooms> open{};  // whether a room is open towards +x, +y
    std::array<bool, rooms * rooms> seen{};
    std::vector<int> path{0};
    seen[0] = true;
    for (uint32_t step = 0; !path.empty(); ++step) {
        const int x = path.back() % rooms, y = path.back() / rooms,
                  turn = int(hashUnit(int(step), path.back(), seed) * 4);
        bool moved = false;
        for (int k = 0; k < 4 && !moved; ++k) {
            const int way = (turn + k) & 3, nx = wrapped(x + (way == 0) - (way == 2), rooms),
                      ny = wrapped(y + (way == 1) - (way == 3), rooms);
            const int next = nx + rooms * ny;
            if (seen[next]) continue;
            seen[next] = moved = true;
            open[way < 2 ? path.back() : next][way & 1] = true;
            path.push_back(next);
        }
        if (!moved) path.pop_back();
    }
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            const int i = x * rooms / n, j = y * rooms / n, room = i + rooms * j;
            const bool right = (i + 1) * n / rooms - x <= thick, top = (j + 1) * n / rooms - y <= thick;
            const bool wall = (right && top) || (right && !open[room][0]) || (top && !open[room][1]);
            heights[size_t(y) * n + x] = wall ? 65535 : 0;
        }
}

}  // namespace

std::span<const std::string_view> heightFieldNames() { return kHeightFieldNames; }

Result<HeightMap> makeHeightField(std::string_view name, int texels, uint32_t seed) {
    if (std::ranges::find(kHeightFieldNames, name) == kHeightFieldNames.end())
        return Error{.code = ErrorCode::Usage, .message = fmt::format("there is no height field \"{}\"", name)};
    if (texels < 8 || texels > kMaxMapEdge)
        return Error{
            .code = ErrorCode::Usage,
            .message = fmt::format("a height field of {} texels; it must be from 8 to {}", texels, kMaxMapEdge)};
    double range = 0.15;
    std::vector<uint16_t> heights(size_t(texels) * size_t(texels));
    if (name == "maze") range = 0.06, carveMaze(heights, texels, seed);
    if (name == "needle") heights[size_t(texels / 2) * texels + texels / 2] = 65535;
    if (name == "edge")
        for (int y = 0; y < texels; ++y) heights[size_t(y) * texels + texels / 2] = 65535;
    for (const Named& formula : kFormulas) {
        if (formula.name != name) continue;
        range = formula.range;
        for (int y = 0; y < texels; ++y)
            for (int x = 0; x < texels; ++x) {
                const double height = formula.height(double(x) / texels, double(y) / texels, seed);
                heights[size_t(y) * texels + x] = uint16_t(std::lround(65535 * std::clamp(height, 0.0, 1.0)));
            }
    }
    return HeightMap{{texels, texels}, range, std::move(heights)};
}

}  // namespace vcp::meso
