#include "mesostructure/prism_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace vcp::meso {

namespace {

using glm::dvec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPrismSlack = 1e-12;  // by which tetrahedra are met wider than they are, in weights

using Face = std::array<int, 3>;

/// Returns a triangle's area vector, twice its area along its normal.
dvec3 areaOf(const PrismCorners& prism, const Face& face) {
    const dvec3 a = prism.world[face[0]];
    return glm::cross(prism.world[face[1]] - a, prism.world[face[2]] - a);
}

/// Returns where a ray passes a triangle's plane; infinity where it never does.
double passesPlane(const PrismCorners& prism, const Face& face, dvec3 origin, dvec3 direction) {
    const dvec3 normal = areaOf(prism, face);
    const double towards = glm::dot(normal, direction);
    return towards == 0 ? kInfinity : glm::dot(normal, prism.world[face[0]] - origin) / towards;
}

/// Returns the weights of a face's second and third corner where a ray passes it; nothing where it passes beside it.
std::optional<glm::dvec2> passesFace(const PrismCorners& prism, const Face& face, dvec3 origin, dvec3 direction) {
    const dvec3 a = prism.world[face[0]], b = prism.world[face[1]] - a, c = prism.world[face[2]] - a,
                p = glm::cross(direction, c), s = origin - a, q = glm::cross(s, b);
    const double area = glm::dot(b, p);
    if (area == 0) return std::nullopt;
    const double u = glm::dot(s, p) / area, v = glm::dot(direction, q) / area;
    if (u < 0 || v < 0 || u + v > 1) return std::nullopt;
    return glm::dvec2(u, v);
}

/// Returns the exit by planes, the first after `enter` of base, top and sides.
double printedExit(const PrismCorners& prism, dvec3 origin, dvec3 direction, double enter) {
    const auto ahead = [&](const Face& face) {
        const double t = passesPlane(prism, face, origin, direction);
        return t > enter + 1e-9 ? t : kInfinity;
    };
    dvec3 middle(0);
    for (const dvec3 corner : prism.world) middle += corner / 6.0;
    double exit = std::min(ahead(kPrismFaces[0]), ahead(kPrismFaces[1]));
    for (size_t side = 2; side < 8; side += 2) {
        const Face &one = kPrismFaces[side], &other = kPrismFaces[side + 1];
        // The corner of the other triangle that is not on the diagonal; the middle of the prism is inside.
        const int apart =
            *std::ranges::find_if(other, [&](int corner) { return std::ranges::find(one, corner) == one.end(); });
        const dvec3 a = prism.world[one[0]], normal = areaOf(prism, one);
        const bool isConvex = glm::dot(normal, prism.world[apart] - a) * glm::dot(normal, middle - a) >= 0;
        const double first = ahead(one), second = ahead(other);
        exit = std::min(exit, isConvex ? std::min(first, second) : std::max(first, second));
    }
    return exit;
}

}  // namespace

PrismCorners prismOf(std::span<const ShellPiece, 3> pieces) {
    const auto cornersOf = [&](const auto& of) {
        return std::array<dvec3, 6>{of(0, 0), of(0, 1), of(0, 2), of(2, 1), of(1, 2), of(0, 3)};
    };
    return {cornersOf([&](int piece, int corner) { return pieces[piece].corners[corner]; }),
            cornersOf([&](int piece, int corner) { return pieces[piece].tile[corner]; })};
}

PrismPlace curvedPlace(const PrismCorners& prism, dvec3 weights, double height) {
    const auto at = [&](const std::array<dvec3, 6>& corners) {
        dvec3 sum(0);
        for (int k = 0; k < 3; ++k) sum += weights[k] * glm::mix(corners[k], corners[k + 3], height);
        return sum;
    };
    return {at(prism.world), at(prism.tile)};
}

std::optional<dvec3> linearPlace(std::span<const ShellPiece, 3> pieces, dvec3 world) {
    for (const ShellPiece& piece : pieces) {
        const auto edges = [](const std::array<dvec3, 4>& c) {
            return glm::dmat3(c[1] - c[0], c[2] - c[0], c[3] - c[0]);
        };
        const dvec3 w = glm::inverse(edges(piece.corners)) * (world - piece.corners[0]);
        if (std::min({w.x, w.y, w.z, 1 - w.x - w.y - w.z}) >= -kPrismSlack)
            return piece.tile[0] + edges(piece.tile) * w;
    }
    return std::nullopt;
}

std::optional<StraightPassage> straightPassage(const PrismCorners& prism, dvec3 world, dvec3 direction) {
    StraightPassage passage{-kInfinity, kInfinity, {}, {}, 0};
    int crossings = 0;  // ahead: an odd number where the place is inside
    for (const Face& face : kPrismFaces) {
        const auto weights = passesFace(prism, face, world, direction);
        if (!weights) continue;
        const double t = passesPlane(prism, face, world, direction);
        const auto& tile = prism.tile;
        const dvec3 at =
            tile[face[0]] + weights->x * (tile[face[1]] - tile[face[0]]) + weights->y * (tile[face[2]] - tile[face[0]]);
        crossings += t > 0;
        if (t > 0 && t < passage.leave) passage.leave = t, passage.leaveTile = at;
        if (t <= 0 && t > passage.enter) passage.enter = t, passage.enterTile = at;
    }
    if (crossings % 2 == 0 || !std::isfinite(passage.enter)) return std::nullopt;
    passage.printedLeave = printedExit(prism, world, direction, passage.enter);
    return passage;
}

}  // namespace vcp::meso
