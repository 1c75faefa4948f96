#include "mesostructure/base_surface.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>

#include "mesostructure/base_sheet.h"
#include "mesostructure/base_tubes.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, std::numbers::pi;

constexpr std::array<std::string_view, 10> kSurfaceNames = {"quad",   "box",  "cylinder", "sphere",   "torus",
                                                            "teapot", "vase", "bird",     "dinosaur", "tree"};

/// Makes the six sides of a cube, or of the sphere about it by equal angles.
BaseSurface cube(int cells, bool isSphere, double tiles) {
    BaseSurface made;
    for (int side = 0; side < 6; ++side) {
        const int axis = side % 3;
        const double sign = side < 3 ? 1 : -1;
        addSheet(
            made, cells, cells,
            [&](double u, double v) {
                const auto along = [&](double x) { return isSphere ? std::tan((x - 0.5) * pi / 2) : 2 * x - 1; };
                dvec3 p;
                p[axis] = sign, p[(axis + 1) % 3] = along(u) * sign, p[(axis + 2) % 3] = along(v);
                return isSphere ? glm::normalize(p) : p;
            },
            [&](double u, double v) { return tiles * dvec2(u, v); });
    }
    return made;
}

BaseSurface cylinder(double tiles) {
    BaseSurface made;
    constexpr int kAround = 96, kUp = 24;
    const auto ring = [](double u, double r, double z) {
        return dvec3(r * std::cos(2 * pi * u), r * std::sin(2 * pi * u), z);
    };
    addSheet(
        made, kAround, kUp, [&](double u, double v) { return ring(u, 1, 2 * v - 1); },
        [&](double u, double v) { return tiles * dvec2(3 * u, v); });
    for (const double end : {1.0, -1.0})
        addSheet(
            made, kAround, kUp / 2, [&](double u, double v) { return ring(u * end, 1 - v, end); },
            [&](double u, double v) {
                return tiles * 0.5 * (1 - v) * dvec2(std::cos(2 * pi * u), std::sin(2 * pi * u));
            });
    return made;
}

/// Joins corners that are one but for their last bits, as the two ends of a turn are.
void joinRounded(BaseSurface& surface) {
    for (dvec3& p : surface.positions)
        for (int axis = 0; axis < 3; ++axis) p[axis] = std::round(p[axis] * 0x1p40) * 0x1p-40;
    joinPositions(surface);
}

template <class Point>
Point bezier(const std::array<Point, 4>& c, double t) {
    const double s = 1 - t;
    return s * s * s * c[0] + 3 * s * s * t * c[1] + 3 * s * t * t * c[2] + t * t * t * c[3];
}

using Profile = std::array<dvec2, 4>;  // radius, height
using BicubicPatch = std::array<std::array<dvec3, 4>, 4>;

/// Newell's teapot (1975): its round parts by their profiles, from the rim down and from the lid's knob down, and the
/// halves y <= 0 of handle and spout.
constexpr std::array<Profile, 4> kBody = {{{{{1.4, 2.4}, {1.3375, 2.53125}, {1.4375, 2.53125}, {1.5, 2.4}}},
                                           {{{1.5, 2.4}, {1.75, 1.875}, {2, 1.35}, {2, 0.9}}},
                                           {{{2, 0.9}, {2, 0.45}, {1.5, 0.225}, {1.5, 0.15}}},
                                           {{{1.5, 0.15}, {1.5, 0.075}, {1.425, 0}, {0, 0}}}}};
constexpr std::array<Profile, 2> kLid = {
    {{{{0, 3.15}, {0.8, 3.15}, {0, 2.85}, {0.2, 2.7}}}, {{{0.2, 2.7}, {0.4, 2.55}, {1.3, 2.55}, {1.3, 2.4}}}}};
const std::array<BicubicPatch, 2> kHandle = {
    {{{{{{-1.6, 0, 2.025}, {-1.6, -0.3, 2.025}, {-1.5, -0.3, 2.25}, {-1.5, 0, 2.25}}},
       {{{-2.3, 0, 2.025}, {-2.3, -0.3, 2.025}, {-2.5, -0.3, 2.25}, {-2.5, 0, 2.25}}},
       {{{-2.7, 0, 2.025}, {-2.7, -0.3, 2.025}, {-3, -0.3, 2.25}, {-3, 0, 2.25}}},
       {{{-2.7, 0, 1.8}, {-2.7, -0.3, 1.8}, {-3, -0.3, 1.8}, {-3, 0, 1.8}}}}},
     {{{{{-2.7, 0, 1.8}, {-2.7, -0.3, 1.8}, {-3, -0.3, 1.8}, {-3, 0, 1.8}}},
       {{{-2.7, 0, 1.575}, {-2.7, -0.3, 1.575}, {-3, -0.3, 1.35}, {-3, 0, 1.35}}},
       {{{-2.5, 0, 1.125}, {-2.5, -0.3, 1.125}, {-2.65, -0.3, 0.9375}, {-2.65, 0, 0.9375}}},
       {{{-2, 0, 0.9}, {-2, -0.3, 0.9}, {-1.9, -0.3, 0.6}, {-1.9, 0, 0.6}}}}}}};
const std::array<BicubicPatch, 2> kSpout = {
    {{{{{{1.7, 0, 1.425}, {1.7, -0.66, 1.425}, {1.7, -0.66, 0.6}, {1.7, 0, 0.6}}},
       {{{2.6, 0, 1.425}, {2.6, -0.66, 1.425}, {3.1, -0.66, 0.825}, {3.1, 0, 0.825}}},
       {{{2.3, 0, 2.1}, {2.3, -0.25, 2.1}, {2.4, -0.25, 2.025}, {2.4, 0, 2.025}}},
       {{{2.7, 0, 2.4}, {2.7, -0.25, 2.4}, {3.3, -0.25, 2.4}, {3.3, 0, 2.4}}}}},
     {{{{{2.7, 0, 2.4}, {2.7, -0.25, 2.4}, {3.3, -0.25, 2.4}, {3.3, 0, 2.4}}},
       {{{2.8, 0, 2.475}, {2.8, -0.25, 2.475}, {3.525, -0.25, 2.49375}, {3.525, 0, 2.49375}}},
       {{{2.9, 0, 2.475}, {2.9, -0.15, 2.475}, {3.45, -0.15, 2.5125}, {3.45, 0, 2.5125}}},
       {{{2.8, 0, 2.4}, {2.8, -0.15, 2.4}, {3.2, -0.15, 2.4}, {3.2, 0, 2.4}}}}}}};

/// Adds the round parts; a quarter of a turn of the body is one unit of the map.
void addRound(BaseSurface& to, std::span<const Profile> profiles, double tiles) {
    double length = 0;
    for (const Profile& profile : profiles) {
        double span = 0;
        for (int i = 0; i < 32; ++i) span += glm::distance(bezier(profile, i / 32.0), bezier(profile, (i + 1) / 32.0));
        addSheet(
            to, 48, 8,
            [&](double u, double v) {
                const dvec2 p = bezier(profile, v);
                // The turn is reversed, so that v, which goes down, and u are counter-clockwise from outside.
                return dvec3(p.x * std::cos(2 * pi * u), -p.x * std::sin(2 * pi * u), p.y);
            },
            [&](double u, double v) { return tiles * dvec2(4 * u, (length + v * span) / pi); });
        length += span;
    }
}

void addTube(BaseSurface& to, std::span<const BicubicPatch> patches, double tiles) {
    double first = 0;
    for (const BicubicPatch& patch : patches) {
        for (const double half : {1.0, -1.0})
            addSheet(
                to, 8, 8,
                [&](double u, double v) {
                    std::array<dvec3, 4> row;
                    for (int i = 0; i < 4; ++i) row[i] = bezier(patch[i], half > 0 ? u : 1 - u);
                    dvec3 p = bezier(row, v);
                    p.y *= half;
                    return p;
                },
                [&](double u, double v) { return tiles * 0.5 * dvec2(half > 0 ? u : 1 + u, 2 * (first + v)); });
        first += 1;
    }
}

/// Leaves out triangles two of whose corners are one, as there are at poles.
void leaveOutPoints(BaseSurface& surface) {
    size_t kept = 0;
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        const auto t = surface.triangles[i];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        surface.triangles[kept] = t, surface.uvs[kept] = surface.uvs[i];
        ++kept;
    }
    surface.triangles.resize(kept), surface.uvs.resize(kept);
}

}  // namespace

std::span<const std::string_view> baseSurfaceNames() { return kSurfaceNames; }

Result<BaseSurface> makeBaseSurface(std::string_view name, double tiles) {
    if (!(tiles > 0) || !(tiles <= 4096))
        return Error{.code = ErrorCode::Usage,
                     .message = "tiles along a base surface must be above 0 and at most 4096"};
    BaseSurface made;
    if (name == "quad")
        addSheet(
            made, 1, 1, [](double u, double v) { return dvec3(2 * u - 1, 2 * v - 1, 0); },
            [&](double u, double v) { return tiles * dvec2(u, v); });
    else if (name == "box")
        made = cube(16, false, tiles);
    else if (name == "sphere")
        made = cube(20, true, tiles);
    else if (name == "cylinder")
        made = cylinder(tiles);
    else if (name == "torus")
        return torusSurface(tiles, {96, 40});
    else if (name == "teapot")
        addRound(made, kBody, tiles), addRound(made, kLid, tiles), addTube(made, kHandle, tiles),
            addTube(made, kSpout, tiles);
    else if (auto tubes = makeTubes(name, tiles))
        made = *std::move(tubes);
    else
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("there is no base surface \"{}\"; there are {}", name,
                                            fmt::join(kSurfaceNames, ", "))};
    joinRounded(made);
    leaveOutPoints(made);
    return made;
}

BaseSurface torusSurface(double tiles, glm::ivec2 cells) {
    BaseSurface made;
    addSheet(
        made, cells.x, cells.y,
        [](double u, double v) {
            const double r = 1 + kTorusTube * std::cos(2 * pi * v);
            return dvec3(r * std::cos(2 * pi * u), r * std::sin(2 * pi * u), kTorusTube * std::sin(2 * pi * v));
        },
        [&](double u, double v) { return tiles * dvec2(kTorusRingTiles * u, v); });
    joinRounded(made);
    return made;
}

void joinPositions(BaseSurface& surface) {
    const std::vector<dvec3>& all = surface.positions;
    std::vector<uint32_t> order(all.size()), first(all.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](uint32_t i) { return std::tie(all[i].x, all[i].y, all[i].z); };
    std::ranges::sort(order, [&](uint32_t a, uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
    for (size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && key(order[i - 1]) == key(order[i]) ? first[order[i - 1]] : order[i];
    std::vector<dvec3> kept;
    std::vector<uint32_t> renumbered(all.size());
    for (uint32_t i = 0; i < all.size(); ++i) {
        renumbered[i] = first[i] == i ? uint32_t(kept.size()) : renumbered[first[i]];
        if (first[i] == i) kept.push_back(all[i]);
    }
    for (auto& triangle : surface.triangles)
        for (uint32_t& corner : triangle) corner = renumbered[corner];
    surface.positions = std::move(kept);
}

double tileEdge(const BaseSurface& surface) {
    double world = 0, tile = 0;
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        const auto& t = surface.triangles[i];
        const auto& m = surface.uvs[i];
        world += glm::length(glm::cross(surface.positions[t[1]] - surface.positions[t[0]],
                                        surface.positions[t[2]] - surface.positions[t[0]]));
        const dvec2 a = m[1] - m[0], b = m[2] - m[0];
        tile += std::abs(a.x * b.y - a.y * b.x);
    }
    return tile > 0 ? std::sqrt(world / tile) : 0;
}

}  // namespace vcp::meso
