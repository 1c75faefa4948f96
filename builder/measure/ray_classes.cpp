#include "builder/measure/ray_classes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr int kMaxSteps = 4096;
constexpr int kMaxCrossings = 256;

/// Two unit vectors perpendicular to d and to each other.
std::array<glm::dvec3, 2> perpendiculars(glm::dvec3 d) {
    const glm::dvec3 other = std::abs(d.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(d, other));
    return {u, glm::cross(d, u)};
}

/// Returns the distance between the segments p0 p1 and q0 q1.
double segmentDistance(glm::dvec3 p0, glm::dvec3 p1, glm::dvec3 q0, glm::dvec3 q1) {
    const glm::dvec3 p = p1 - p0, q = q1 - q0, r = p0 - q0;
    const double pp = glm::dot(p, p), pq = glm::dot(p, q), qq = glm::dot(q, q), pr = glm::dot(p, r),
                 qr = glm::dot(q, r);
    const auto share = [](double part, double whole) { return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0.0; };
    // The nearest points of the lines are cut to one segment, then to the other, then to the first again.
    double s = share(pq * qr - qq * pr, pp * qq - pq * pq);
    const double t = share(pq * s + qr, qq);
    s = share(pq * t - pr, pp);
    return glm::length(r + s * p - t * q);
}

}  // namespace

RayJudge::RayJudge(const MeshBvh& mesh, double cell, double certifiedError)
    : mesh_(&mesh), cell_(cell), radius_(certifiedError * 1.01 + cell * 1e-6) {}

RayJudgement RayJudge::judge(glm::dvec3 origin, glm::dvec3 direction, const std::optional<SurfaceHit>& hit,
                             bool resolved) const {
    RayJudgement j;
    if (!resolved || (hit && !std::isfinite(hit->t))) {
        j.rayClass = RayClass::Unresolved;
        return j;
    }
    const auto meshHit = mesh_->nearestHit(origin, direction);
    if (hit) {
        const auto closest = mesh_->nearestPoint(origin + hit->t * direction);
        j.distance = closest ? closest->distance : kInfinity;
        const double allowed = hit->certifiedError * 1.01 + cell_ * 1e-6;
        j.overCertified = j.distance / std::max(hit->certifiedError, cell_ * 1e-6);
        j.tooFar = j.distance > allowed;
    }
    if (!meshHit) {
        j.rayClass = hit ? RayClass::False : RayClass::Miss;
        return j;
    }
    if (!hit) {
        j.rayClass = RayClass::Missed;
        j.hole = leaks(origin, direction, kInfinity);
        return j;
    }
    if (std::abs(hit->t - meshHit->t) > kWrongSheetCells * cell_) {
        j.rayClass = RayClass::WrongSheet;
        j.hole = hit->t > meshHit->t && leaks(origin, direction, hit->t);
        return j;
    }
    j.rayClass = RayClass::Hit;
    j.depthError = std::abs(hit->t - meshHit->t);
    const double cosine = std::min(std::abs(glm::dot(hit->normal, meshHit->normal)), 1.0);
    j.normalDegrees = std::acos(cosine) * 180 / std::numbers::pi;
    return j;
}

bool RayJudge::leaks(glm::dvec3 origin, glm::dvec3 direction, double until) const {
    double from = 0;
    for (int crossing = 0; crossing < kMaxCrossings; ++crossing) {
        const auto hit = mesh_->nearestHit(origin, direction, from, until);
        if (!hit) return false;
        const Piece piece = pieceNearMesh(origin, direction, hit->t);
        // The ray is stopped within the piece, by the surface of this very crossing.
        if (until <= piece.last + radius_) return false;
        // A piece that begins behind the eye says nothing about a surface in front of it.
        if (piece.first > 0 && parallelsCross(origin, direction, piece) &&
            !borderNear(origin + piece.first * direction, origin + piece.last * direction))
            return true;
        from = std::max(piece.last, std::nextafter(hit->t, kInfinity));
    }
    return false;
}

RayJudge::Piece RayJudge::pieceNearMesh(glm::dvec3 origin, glm::dvec3 direction, double t) const {
    // The distance to the mesh changes by at most the step: the piece's end is not stepped over by more
    // than a tenth of the radius.
    const double reach = 1.1 * radius_;
    const auto walk = [&](double sign) {
        double at = t;
        for (int step = 0; step < kMaxSteps; ++step) {
            const auto closest = mesh_->nearestPoint(origin + at * direction, 1.2 * reach);
            if (!closest || closest->distance > reach) break;
            at += sign * std::max(reach - closest->distance, 0.1 * radius_);
        }
        return at;
    };
    return {walk(-1), walk(1)};
}

bool RayJudge::parallelsCross(glm::dvec3 origin, glm::dvec3 direction, Piece piece) const {
    const auto [u, v] = perpendiculars(direction);
    for (const double distance : {1.0, 0.6, 0.2}) {
        for (int i = 0; i < kParallels; ++i) {
            const double angle = 2 * std::numbers::pi * i / kParallels;
            const glm::dvec3 moved = origin + distance * radius_ * (std::cos(angle) * u + std::sin(angle) * v);
            if (!mesh_->anyHit(moved, direction, piece.first, piece.last)) return false;
        }
    }
    return true;
}

bool RayJudge::borderNear(glm::dvec3 first, glm::dvec3 last) const {
    // Both triangles of an edge that comes so near are among these. Corners are compared by their positions.
    const IndexedMesh& mesh = mesh_->mesh();
    using Place = std::array<double, 3>;
    std::map<std::pair<Place, Place>, int> triangles;
    for (const uint32_t triangle :
         mesh_->trianglesNear(glm::min(first, last) - radius_, glm::max(first, last) + radius_))
        for (int i = 0; i < 3; ++i) {
            const auto place = [&](int corner) {
                const glm::dvec3 p = mesh.positions[mesh.triangles[triangle][corner % 3]];
                return Place{p.x, p.y, p.z};
            };
            const bool isSegment = place(0) == place(1) || place(1) == place(2) || place(2) == place(0);
            if (!isSegment) ++triangles[std::minmax({place(i), place(i + 1)})];
        }
    return std::ranges::any_of(triangles, [&](const auto& edge) {
        const auto& [a, b] = edge.first;
        return edge.second == 1 && segmentDistance(first, last, {a[0], a[1], a[2]}, {b[0], b[1], b[2]}) <= radius_;
    });
}

void RayClassTable::add(const RayJudgement& j) {
    ++counts_[size_t(j.rayClass)];
    holes_ += j.hole ? 1 : 0;
    tooFar_ += j.tooFar ? 1 : 0;
    overCertifiedMax_ = std::max(overCertifiedMax_, j.overCertified);
    if (j.rayClass != RayClass::Hit) return;
    distances_.push_back(float(j.distance));
    depthErrors_.push_back(float(j.depthError));
    normalDegrees_.push_back(float(j.normalDegrees));
}

void RayClassTable::merge(const RayClassTable& other) {
    for (size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
    holes_ += other.holes_;
    tooFar_ += other.tooFar_;
    overCertifiedMax_ = std::max(overCertifiedMax_, other.overCertifiedMax_);
    const auto append = [](std::vector<float>& to, const std::vector<float>& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    append(distances_, other.distances_);
    append(depthErrors_, other.depthErrors_);
    append(normalDegrees_, other.normalDegrees_);
}

uint64_t RayClassTable::rays() const {
    uint64_t sum = 0;
    for (const uint64_t count : counts_) sum += count;
    return sum;
}

double RayClassTable::fraction(RayClass rayClass) const {
    const uint64_t all = rays();
    return all > 0 ? double(count(rayClass)) / double(all) : 0;
}

Quantiles RayClassTable::distanceCells(double cell) const { return inCells(quantilesOf(distances_), cell); }
Quantiles RayClassTable::depthCells(double cell) const { return inCells(quantilesOf(depthErrors_), cell); }

}  // namespace vcp
