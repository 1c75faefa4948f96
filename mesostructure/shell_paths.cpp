#include "mesostructure/shell_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace vcp::meso {

namespace {

using glm::dmat3, glm::dvec3, glm::dvec4;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPathLift = 1e-6;  // by which rays start above a surface, parts of the scene's diagonal
constexpr double kSlack = 1e-10;    // by which pieces are met wider than they are, in weights
constexpr double kWithin = -1e-7;   // a field that is within the solid, tile units

dmat3 edgesOf(const std::array<dvec3, 4>& c) { return {c[1] - c[0], c[2] - c[0], c[3] - c[0]}; }

/// Returns the unit normal, out of the piece, of the face that is opposite to a corner.
dvec3 faceNormal(const dmat3& weights, int corner) {
    const dmat3 rows = glm::transpose(weights);
    return glm::normalize(corner == 0 ? rows[0] + rows[1] + rows[2] : -rows[corner - 1]);
}

}  // namespace

ShellPaths::ShellPaths(const std::vector<Surface>& surfaces, double albedo) : albedo_(albedo) {
    for (const Surface& surface : surfaces) {
        Shell shell;
        for (ShellPiece& piece : shellPieces(surface.base, surface.height, surface.shape->extent(), 0, shell)) {
            for (dvec3& corner : piece.corners) corner += shell.origin;
            const dmat3 weights = glm::inverse(edgesOf(piece.corners));
            pieces_.push_back({surface.shape, piece, weights, edgesOf(piece.tile) * weights});
        }
    }
    nodes_.push_back({dvec3(0), dvec3(0), 0, uint32_t(pieces_.size())});
    if (pieces_.empty()) return;
    split(0);
    lift_ = kPathLift * glm::length(nodes_[0].high - nodes_[0].low);
}

void ShellPaths::split(uint32_t node) {
    const auto [first, count] = std::pair(nodes_[node].first, nodes_[node].count);
    dvec3 low(kInfinity), high(-kInfinity);
    for (uint32_t i = first; i < first + count; ++i)
        low = glm::min(low, pieces_[i].of.low()), high = glm::max(high, pieces_[i].of.high());
    const dvec3 size = high - low, slack = 1e-9 * (size + glm::abs(low) + glm::abs(high));
    nodes_[node].low = low - slack, nodes_[node].high = high + slack;
    if (count <= 4) return;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto middle = [axis](const Piece& piece) { return piece.of.low()[axis] + piece.of.high()[axis]; };
    const uint32_t half = count / 2;
    std::nth_element(pieces_.begin() + first, pieces_.begin() + first + half, pieces_.begin() + first + count,
                     [&](const Piece& a, const Piece& b) { return middle(a) < middle(b); });
    const auto children = uint32_t(nodes_.size());
    nodes_[node].first = children, nodes_[node].count = 0;
    nodes_.push_back({dvec3(0), dvec3(0), first, half});
    nodes_.push_back({dvec3(0), dvec3(0), first + half, count - half});
    split(children);
    split(children + 1);
}

bool ShellPaths::passes(const Piece& piece, dvec3 origin, dvec3 direction, Passage& passage) {
    const dvec3 a3 = piece.weights * (origin - piece.of.corners[0]), b3 = piece.weights * direction;
    const dvec4 a(1 - a3.x - a3.y - a3.z, a3), b(-b3.x - b3.y - b3.z, b3);
    passage = {&piece, 0, kInfinity, -1, -1};
    for (int i = 0; i < 4; ++i) {
        const double time = -(a[i] + kSlack) / b[i];
        if (b[i] > 0 && time > passage.enter)
            passage.enter = time, passage.entered = i;
        else if (b[i] < 0 && time < passage.leave)
            passage.leave = time, passage.left = i;
        else if (b[i] == 0 && a[i] < -kSlack)
            return false;
    }
    return passage.enter <= passage.leave;
}

std::vector<ShellPaths::Passage> ShellPaths::passages(dvec3 origin, dvec3 direction) const {
    std::vector<Passage> all;
    if (pieces_.empty()) return all;
    const dvec3 inverse = 1.0 / direction;
    std::vector<uint32_t> open{0};
    while (!open.empty()) {
        const Node& node = nodes_[open.back()];
        open.pop_back();
        const dvec3 a = (node.low - origin) * inverse, b = (node.high - origin) * inverse;
        double first = 0, last = kInfinity;
        for (int axis = 0; axis < 3; ++axis) {
            if (direction[axis] == 0) {
                if (origin[axis] < node.low[axis] || origin[axis] > node.high[axis]) last = -1;
                continue;
            }
            first = std::max(first, std::min(a[axis], b[axis])), last = std::min(last, std::max(a[axis], b[axis]));
        }
        if (first > last) continue;
        if (node.count == 0) {
            open.push_back(node.first), open.push_back(node.first + 1);
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; ++i)
            if (Passage passage; passes(pieces_[i], origin, direction, passage)) all.push_back(passage);
    }
    std::ranges::sort(all, {}, &Passage::enter);
    return all;
}

TileMeeting ShellPaths::meet(dvec3 origin, dvec3 direction) const {
    double nearest = kInfinity;
    TileMeeting met{TileMeeting::Kind::Sky, {}};
    const auto keep = [&](double t, TileMeeting::Kind kind, dvec3 normal) {
        if (t < nearest) nearest = t, met = {kind, {origin + t * direction, glm::normalize(normal)}};
    };
    for (const Passage& passage : passages(origin, direction)) {
        if (passage.enter > nearest) break;
        const Piece& piece = *passage.piece;
        const uint32_t bits = piece.of.bits;
        const bool hasBase = (bits & Shell::kBase) != 0;
        if (passage.entered == 3 && hasBase) {
            keep(passage.enter, TileMeeting::Kind::Unresolved, direction);
            continue;
        }
        const dvec3 from = origin + passage.enter * direction, along = piece.tile * direction,
                    place = piece.of.tile[0] + piece.tile * (from - piece.of.corners[0]);
        const double scale = glm::length(along);
        if (passage.entered >= 0 && (bits >> passage.entered & 1) != 0 && piece.shape->field(place) < kWithin) {
            keep(passage.enter, TileMeeting::Kind::Surface, faceNormal(piece.weights, passage.entered));
            continue;
        }
        if (scale <= 0) continue;
        const TruthHit hit = piece.shape->trace(place, along / scale, (passage.leave - passage.enter) * scale);
        if (hit.hit)
            keep(passage.enter + hit.t / scale, TileMeeting::Kind::Surface, hit.normal * piece.tile);
        else if (!hit.resolved)
            keep(passage.enter, TileMeeting::Kind::Unresolved, direction);
        else if (passage.left == 3 && hasBase)
            keep(passage.leave, TileMeeting::Kind::Surface, -faceNormal(piece.weights, 3));
    }
    return met;
}

TileEscape ShellPaths::follow(TilePoint from, dvec3 direction, PathRandom& random) const {
    const auto meets = [this](const TilePoint& point, dvec3 towards) {
        return meet(point.at + lift_ * point.normal, towards);
    };
    return followPath(meets, albedo_, from, direction, random);
}

}  // namespace vcp::meso
