// What maps from prisms to tile space distort, on tori of more and fewer triangles (mesostructure/prism_maps.h).
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "mesostructure/prism_maps.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {

namespace {

using namespace meso;
using glm::dvec2, glm::dvec3, std::numbers::pi;

constexpr double kTexels = 128;     // along a tile's edge
constexpr dvec3 kTile{1, 1, 0.25};  // and its height

/// Returns the place in the tile of a place over the smooth torus, in the period that is next to another one.
dvec3 smoothPlace(dvec3 p, double tiles, double height, dvec3 near) {
    const double ring = std::hypot(p.x, p.y) - 1;
    dvec3 place = tiles / (2 * pi) * dvec3(kTorusRingTiles * std::atan2(p.y, p.x), std::atan2(p.z, ring), 0);
    const dvec2 period(tiles * kTorusRingTiles, tiles);
    for (int axis = 0; axis < 2; ++axis)
        place[axis] += period[axis] * std::round((near[axis] - place[axis]) / period[axis]);
    place.z = (std::hypot(ring, p.z) - kTorusTube) / height * kTile.z;
    return place;
}

/// `across`: cells round the tube.
MesoPrisms measured(double tiles, int across, uint64_t rays) {
    const BaseSurface surface = torusSurface(tiles, {int(std::lround(2.4 * across)), across});
    const double height = tileEdge(surface) * kTile.z;
    Shell shell;
    const std::vector<ShellPiece> pieces = shellPieces(surface, height, kTile, 0, shell);
    MesoPrisms row;
    row.turnDegrees = 360.0 / across, row.heightOverRadius = height / kTorusTube;
    row.prisms = surface.triangles.size(), row.cutColumns = shell.cut;
    std::mt19937_64 random(41);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<double> straight, linear, straightSmooth, linearSmooth, curvedSmooth;
    uint64_t printedWrong = 0;
    for (; row.rays < rays; ++row.rays) {
        const auto prism = size_t(unit(random) * double(pieces.size() / 3));
        const std::span<const ShellPiece, 3> own(&pieces[3 * prism], 3);
        const PrismCorners corners = prismOf(own);
        const double a = std::sqrt(unit(random)), b = unit(random);
        const PrismPlace place = curvedPlace(corners, {1 - a, a * (1 - b), a * b}, unit(random));
        const double up = 2 * unit(random) - 1, turn = 2 * pi * unit(random), flat = std::sqrt(1 - up * up);
        const dvec3 direction(flat * std::cos(turn), flat * std::sin(turn), up);
        const auto passage = straightPassage(corners, place.world, direction);
        const auto in = linearPlace(own, place.world);
        if (!passage || !in) {
            ++row.between;  // between the bilinear side and its two triangles
            continue;
        }
        const dvec3 world = place.world + shell.origin, smooth = smoothPlace(world, tiles, height, place.tile);
        straight.push_back(kTexels * glm::distance(passage->tile(), place.tile));
        linear.push_back(kTexels * glm::distance(*in, place.tile));
        straightSmooth.push_back(kTexels * glm::distance(passage->tile(), smooth));
        linearSmooth.push_back(kTexels * glm::distance(*in, smooth));
        curvedSmooth.push_back(kTexels * glm::distance(place.tile, smooth));
        printedWrong += std::abs(passage->printedLeave - passage->leave) > 1e-9 * height;
    }
    const auto of = [](std::vector<double>& all) {
        return MesoDistortion{upperQuantile(all, 0.5), upperQuantile(all, 0.95)};
    };
    row.straight = of(straight), row.linear = of(linear), row.straightSmooth = of(straightSmooth),
    row.linearSmooth = of(linearSmooth), row.curvedSmooth = of(curvedSmooth);
    row.printedWrong = double(printedWrong) / double(straight.size());
    return row;
}

}  // namespace

std::vector<MesoPrisms> compareMesoPrisms(uint64_t rays) {
    std::vector<MesoPrisms> rows;
    for (const double tiles : {4.0, 8.0, 16.0})
        for (const int across : {8, 16, 32, 64}) rows.push_back(measured(tiles, across, rays));
    return rows;
}

}  // namespace vcp
