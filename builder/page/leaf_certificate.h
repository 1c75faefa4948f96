// Certification of a soft leaf: an upper bound on the distance between its surface f = 0 and the mesh inside
// it, both ways. The argument is written out in docs/surface.md; in short:
//
// Within the leaf, widened by a margin, let the mesh have no border, crease, fold or non-manifold edge, let its
// triangles' normals and the gradient of f stay on one side of a reference direction n, with df/dn >= g > 0,
// and let |f| <= F on all of the mesh there. Then mesh and f = 0 are graphs over the plane normal to n, without
// border, and along n they are at most F/g apart. F comes from the Bernstein coefficients of f on the clipped
// triangles, g from those of df/dn.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/lattice/triangle_geometry.h"
#include "builder/page/leaf_surface.h"

namespace vcp {

/// The leaf and the mesh are compared within the leaf's cube, widened by so many cells.
inline constexpr double kCertificateMarginCells = 0.125;

/// A corner's vector to the closest point, in cells. Corner i of a leaf at (i & 1, i >> 1 & 1, i >> 2).
struct CornerVector {
    double distance = 0;
    glm::dvec3 direction{0, 0, 1};  ///< unit, from the closest point to the corner
    uint32_t colour = 0;            ///< colour at the closest point
};

/// A triangle as the certificate sees it, in page space.
struct CertifiedTriangle {
    Triangle3 corners;
    glm::dvec3 normal{0};  ///< unit
    uint8_t badEdges = 0;  ///< bit i: the edge from corner i is a border, crease, fold or non-manifold
};

struct Certificate {
    bool soft = false;
    std::array<uint32_t, 8> codes{};  ///< packed corners
    double maxValue = 0;              ///< F, in leaf edges
    double minSlope = 1;              ///< g
    double curvature = 0;             ///< per leaf edge
};

/// Scratch memory of certify; each thread has its own.
struct CertificateScratch {
    std::vector<float> x, y, z, value;  ///< corners of the clipped triangles, in leaf space, and f there
    size_t count = 0;                   ///< the number of these, with those that fill up the last batch
    std::vector<uint32_t> ends;         ///< where each polygon ends among the corners
    std::vector<glm::dvec3> normals;
    std::vector<double> areas;
};

/// Tries to certify the leaf at `lower` (page space) with edge `edge` cells, a power of two: soft is true when
/// (F + W)/g, W the wall tolerance of F's code, is at most `tolerance` cells. `triangles` are all that overlap
/// the leaf widened by the margin. `corner` is asked for the vector of corner 0 to 7 only once the mesh itself
/// allows a soft leaf.
Certificate certifyLeaf(glm::dvec3 lower, double edge, std::span<const CertifiedTriangle* const> triangles,
                        double tolerance, const std::function<const CornerVector&(int)>& corner,
                        CertificateScratch& scratch);

/// Returns the smallest wall code whose tolerance is at least `value` leaf edges; 16 when there is none.
uint32_t wallCode(double value);
/// Returns the tolerance of a code, in leaf edges.
double wallOf(uint32_t code);

/// Returns the dip code for a bound on the second derivatives: the swing over the leaf's diagonal is curvature * 3 / 8.
uint32_t dipCode(double curvature);

}  // namespace vcp
