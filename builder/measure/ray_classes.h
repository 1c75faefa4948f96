// Ray classes: how right a rendered surface is, ray by ray, against the mesh itself (docs/measuring.md).
//
// Every ray is in exactly one class:
//   hit          mesh and surface are hit, at most kWrongSheetCells apart along the ray
//   miss         neither is hit
//   missed       the mesh is hit, the surface is not
//   false        the surface is hit, the mesh is not
//   wrong sheet  both are hit, farther apart along the ray
//   unresolved   the method gave up (step limit, not a number)
// A surface within e of the mesh is free to move by e: near silhouettes and open borders a few rays are
// missed, false or on the wrong sheet even if nothing is wrong. What is wrong beyond doubt is counted apart:
//
//   hole      The ray crosses the mesh, has no surface hit there, and every surface within e of the mesh
//             that has no opening would have been hit: all parallels of the ray at distances up to e
//             (kParallels directions, three distances) cross the mesh there too, and no border of the mesh
//             (an edge of one triangle alone) comes within e of it there: of two parts that touch and share no
//             edge, each may recede by e. "There" is the ray's piece around the crossing on which it stays
//             within 1.1 e of the mesh. So it passes no silhouette and no border by e or less, and enters the
//             mesh's e-neighbourhood and leaves it again, without being stopped. All crossings up to the
//             surface hit are judged, so that missed and wrong-sheet rays are treated alike.
//   too far   A surface hit, of whatever class, farther from the mesh than its page's certified error.
//
// Here e is the certified error widened by 1 % and a millionth of a cell. Both counts must be zero.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/measure/mesh_bvh.h"
#include "builder/measure/quantile.h"

namespace vcp {

inline constexpr double kWrongSheetCells = 2;
inline constexpr int kParallels = 32;

enum class RayClass : uint8_t { Hit, Miss, Missed, False, WrongSheet, Unresolved };
inline constexpr std::array<std::string_view, 6> kRayClassNames = {"hit",   "miss",        "missed",
                                                                   "false", "wrong_sheet", "unresolved"};

/// What a method reports about a ray.
struct SurfaceHit {
    double t = 0;               ///< world units; |direction| = 1
    glm::dvec3 normal{0};       ///< unit, either side
    double certifiedError = 0;  ///< world units
};

struct RayJudgement {
    RayClass rayClass = RayClass::Miss;
    double depthError = 0;     ///< world units along the ray; for the class hit
    double distance = 0;       ///< from the surface hit to the mesh, world units; for every surface hit
    double overCertified = 0;  ///< distance / certified error (1: at the bound)
    double normalDegrees = 0;  ///< against the plane of the hit triangle, 0 to 90; for the class hit
    bool hole = false;
    bool tooFar = false;
};

class RayJudge {
public:
    /// `cell`: edge of the finest cell; `certifiedError`: that of the surface; both in world units. `mesh` must outlive
    /// the judge.
    RayJudge(const MeshBvh& mesh, double cell, double certifiedError);

    /// Judges a ray; |direction| = 1. `resolved` is false where the method gave up. Any thread.
    [[nodiscard]] RayJudgement judge(glm::dvec3 origin, glm::dvec3 direction, const std::optional<SurfaceHit>& hit,
                                     bool resolved = true) const;

    /// Whether the ray crosses the mesh before `until` where any surface within the certified error would have
    /// stopped it; hits of the surface at `until` excuse a crossing nearby.
    [[nodiscard]] bool leaks(glm::dvec3 origin, glm::dvec3 direction, double until) const;

private:
    struct Piece {
        double first, last;
    };
    [[nodiscard]] Piece pieceNearMesh(glm::dvec3 origin, glm::dvec3 direction, double t) const;
    [[nodiscard]] bool parallelsCross(glm::dvec3 origin, glm::dvec3 direction, Piece piece) const;
    [[nodiscard]] bool borderNear(glm::dvec3 first, glm::dvec3 last) const;

    const MeshBvh* mesh_;
    double cell_;
    double radius_;  ///< e, world units
};

/// Sums judgements. Add from one thread, or use one table a thread and merge.
class RayClassTable {
public:
    void add(const RayJudgement& judgement);
    void merge(const RayClassTable& other);

    [[nodiscard]] uint64_t rays() const;
    [[nodiscard]] uint64_t count(RayClass rayClass) const { return counts_[size_t(rayClass)]; }
    /// Returns a class's fraction of all rays; the six fractions sum to 1.
    [[nodiscard]] double fraction(RayClass rayClass) const;
    [[nodiscard]] uint64_t holes() const { return holes_; }
    [[nodiscard]] uint64_t tooFar() const { return tooFar_; }
    [[nodiscard]] double overCertifiedMax() const { return overCertifiedMax_; }
    /// For the class hit: distance of the hit to the mesh and error along the ray, both in cells of edge `cell`; angle
    /// between the normals in degrees.
    [[nodiscard]] Quantiles distanceCells(double cell) const;
    [[nodiscard]] Quantiles depthCells(double cell) const;
    [[nodiscard]] Quantiles normalDegrees() const { return quantilesOf(normalDegrees_); }

private:
    std::array<uint64_t, kRayClassNames.size()> counts_{};
    uint64_t holes_ = 0, tooFar_ = 0;
    double overCertifiedMax_ = 0;
    std::vector<float> distances_, depthErrors_, normalDegrees_;
};

}  // namespace vcp
