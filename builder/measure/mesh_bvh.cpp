#include "builder/measure/mesh_bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "octree/surface/area_split.h"

namespace vcp {

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr uint32_t kLeafTriangles = 4;

/// Returns the point of segment a b nearest to the coordinate origin.
glm::dvec3 closestOfSegment(glm::dvec3 a, glm::dvec3 b) {
    const glm::dvec3 ab = b - a;
    const double length2 = glm::dot(ab, ab);
    if (!(length2 > 0)) return a;
    const double u = std::clamp(-glm::dot(a, ab) / length2, 0.0, 1.0);
    // The point is computed from the nearer end: no cancellation along long edges.
    return u <= 0.5 ? a + u * ab : b - std::clamp(glm::dot(b, ab) / length2, 0.0, 1.0) * ab;
}

/// Returns the foot of the perpendicular from the coordinate origin, where it is inside the triangle.
std::optional<glm::dvec3> footInside(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double wa = glm::dot(n, glm::cross(b, c)), wb = glm::dot(n, glm::cross(c, a)),
                 wc = glm::dot(n, glm::cross(a, b));
    if (!(wa >= 0 && wb >= 0 && wc >= 0)) return {};
    const double sum = wa + wb + wc;
    if (!(sum > 0)) return {};
    return (wa / sum) * a + (wb / sum) * b + (wc / sum) * c;
}

double boxDistance2(glm::dvec3 p, glm::dvec3 low, glm::dvec3 high) {
    const glm::dvec3 out = glm::max(glm::max(low - p, p - high), glm::dvec3(0));
    return glm::dot(out, out);
}

Bounds triangleBounds(const IndexedMesh& mesh, uint32_t triangle) {
    Bounds bounds;
    for (const glm::dvec3& p : mesh.corners(triangle)) bounds.add(p);
    return bounds;
}

}  // namespace

glm::dvec3 closestPointOfTriangle(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    a -= p;
    b -= p;
    c -= p;
    glm::dvec3 best = closestOfSegment(a, b);
    double best2 = glm::dot(best, best);
    const auto consider = [&](glm::dvec3 q) {
        const double q2 = glm::dot(q, q);
        if (q2 < best2) {
            best = q;
            best2 = q2;
        }
    };
    consider(closestOfSegment(b, c));
    consider(closestOfSegment(c, a));
    if (const auto foot = footInside(a, b, c)) consider(*foot);
    return p + best;
}

// A ray turned so that its largest component is the z axis and sheared onto it.
struct MeshBvh::WoopRay {
    glm::dvec3 origin, direction, inverse;
    glm::dvec3 originLow, originHigh;  ///< origin moved by the rounding of the vertices, for box tests
    int kx, ky, kz;
    double sx, sy, sz;

    WoopRay(glm::dvec3 o, glm::dvec3 d, glm::dvec3 low, glm::dvec3 high) : origin(o), direction(d) {
        const glm::dvec3 size = glm::abs(d);
        kz = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
        kx = (kz + 1) % 3;
        ky = (kx + 1) % 3;
        sx = d[kx] / d[kz];
        sy = d[ky] / d[kz];
        sz = 1 / d[kz];
        inverse = 1.0 / d;
        const glm::dvec3 far = glm::max(glm::abs(low - o), glm::abs(high - o));
        const double pad = 8 * kEpsilon * std::max({far.x, far.y, far.z});
        originLow = o + glm::dvec3(pad);
        originHigh = o - glm::dvec3(pad);
    }

    /// Returns the smallest t in [tMin, tMax] inside of the box, or infinity. Errs towards inside.
    [[nodiscard]] double enter(glm::dvec3 low, glm::dvec3 high, double tMin, double tMax) const {
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (low[axis] - originLow[axis]) * inverse[axis];
            const double b = (high[axis] - originHigh[axis]) * inverse[axis];
            // Comparisons are false for NaN (0 times infinity: in the box's plane), which counts as inside.
            const double first = a < b ? a : b, last = a < b ? b : a;
            if (first > tMin) tMin = first;
            if (last < tMax) tMax = last;
        }
        return tMin * (1 - 4 * kEpsilon) <= tMax * (1 + 4 * kEpsilon) ? tMin : kInfinity;
    }

    [[nodiscard]] std::optional<double> hit(const std::array<glm::dvec3, 3>& v) const {
        const glm::dvec3 a = v[0] - origin, b = v[1] - origin, c = v[2] - origin;
        const double ax = a[kx] - sx * a[kz], ay = a[ky] - sy * a[kz];
        const double bx = b[kx] - sx * b[kz], by = b[ky] - sy * b[kz];
        const double cx = c[kx] - sx * c[kz], cy = c[ky] - sy * c[kz];
        const double u = cx * by - cy * bx, w = bx * ay - by * ax, n = ax * cy - ay * cx;
        if ((u < 0 || n < 0 || w < 0) && (u > 0 || n > 0 || w > 0)) return {};
        const double sum = u + n + w;
        if (sum == 0) return {};
        return (u / sum * a[kz] + n / sum * b[kz] + w / sum * c[kz]) * sz;
    }
};

MeshBvh::MeshBvh(const IndexedMesh& mesh) : mesh_(&mesh), order_(mesh.triangles.size()) {
    if (order_.empty()) return;
    std::iota(order_.begin(), order_.end(), 0u);
    std::vector<glm::dvec3> centres(order_.size());
    for (uint32_t t = 0; t < order_.size(); ++t) {
        const Bounds bounds = triangleBounds(mesh, t);
        centres[t] = 0.5 * bounds.low + 0.5 * bounds.high;
    }
    nodes_.reserve(order_.size());
    nodes_.push_back({{}, {}, 0, uint32_t(order_.size())});
    fitNode(nodes_[0]);
    split(0, centres);
    nodes_.shrink_to_fit();
}

void MeshBvh::fitNode(Node& node) const {
    Bounds bounds;
    for (uint32_t i = 0; i < node.count; ++i) bounds.add(triangleBounds(*mesh_, order_[node.first + i]));
    node.low = bounds.low;
    node.high = bounds.high;
}

void MeshBvh::split(uint32_t root, std::vector<glm::dvec3>& centres) {
    std::vector<uint32_t> open{root};
    while (!open.empty()) {
        const uint32_t number = open.back();
        open.pop_back();
        const uint32_t first = nodes_[number].first, count = nodes_[number].count;
        if (count <= kLeafTriangles) continue;
        uint32_t* begin = order_.data() + first;
        const AreaSplit plane = cheapestSplit(
            count, [&](uint32_t i) { return centres[begin[i]]; },
            [&](uint32_t i) { return triangleBounds(*mesh_, begin[i]); });
        uint32_t left = count / 2;
        if (plane.axis >= 0)
            left = uint32_t(std::partition(begin, begin + count,
                                           [&](uint32_t t) { return centres[t][plane.axis] < plane.position; }) -
                            begin);
        if (left == 0 || left == count) left = count / 2;
        const auto child = uint32_t(nodes_.size());
        nodes_[number].first = child;
        nodes_[number].count = 0;
        nodes_.push_back({{}, {}, first, left});
        nodes_.push_back({{}, {}, first + left, count - left});
        fitNode(nodes_[child]);
        fitNode(nodes_[child + 1]);
        open.push_back(child);
        open.push_back(child + 1);
    }
}

std::vector<uint32_t> MeshBvh::trianglesNear(glm::dvec3 low, glm::dvec3 high) const {
    std::vector<uint32_t> near, open;
    if (!nodes_.empty()) open.push_back(0);
    const auto touch = [&](glm::dvec3 boxLow, glm::dvec3 boxHigh) {
        return glm::all(glm::lessThanEqual(boxLow, high)) && glm::all(glm::greaterThanEqual(boxHigh, low));
    };
    while (!open.empty()) {
        const Node& node = nodes_[open.back()];
        open.pop_back();
        if (!touch(node.low, node.high)) continue;
        if (node.count == 0) {
            open.push_back(node.first);
            open.push_back(node.first + 1);
        }
        for (uint32_t i = 0; i < node.count; ++i) {
            const auto v = mesh_->corners(order_[node.first + i]);
            if (touch(glm::min(v[0], glm::min(v[1], v[2])), glm::max(v[0], glm::max(v[1], v[2]))))
                near.push_back(order_[node.first + i]);
        }
    }
    return near;
}

std::optional<NearestPoint> MeshBvh::nearestPoint(glm::dvec3 p, double within) const {
    if (nodes_.empty()) return {};
    NearestPoint best;
    double best2 = within * within;
    bool found = false;
    std::vector<std::pair<double, uint32_t>> open{{boxDistance2(p, nodes_[0].low, nodes_[0].high), 0}};
    open.reserve(64);
    while (!open.empty()) {
        const auto [distance2, number] = open.back();
        open.pop_back();
        if (distance2 * (1 - 8 * kEpsilon) > best2) continue;
        const Node& node = nodes_[number];
        if (node.count == 0) {
            std::pair<double, uint32_t> near{boxDistance2(p, nodes_[node.first].low, nodes_[node.first].high),
                                             node.first};
            std::pair<double, uint32_t> far{boxDistance2(p, nodes_[node.first + 1].low, nodes_[node.first + 1].high),
                                            node.first + 1};
            if (far.first < near.first) std::swap(near, far);
            open.push_back(far);
            open.push_back(near);
            continue;
        }
        for (uint32_t i = 0; i < node.count; ++i) {
            const uint32_t triangle = order_[node.first + i];
            const auto v = mesh_->corners(triangle);
            const glm::dvec3 q = closestPointOfTriangle(p, v[0], v[1], v[2]);
            const double q2 = glm::dot(q - p, q - p);
            if (q2 > best2 || (found && q2 == best2)) continue;
            best2 = q2;
            best = {q, std::sqrt(q2), triangle};
            found = true;
        }
    }
    if (!found) return {};
    return best;
}

template <class Visit>
void MeshBvh::walkRay(const WoopRay& ray, double tMin, double& tMax, const Visit& visit) const {
    if (nodes_.empty()) return;
    std::vector<std::pair<double, uint32_t>> open{{ray.enter(nodes_[0].low, nodes_[0].high, tMin, tMax), 0}};
    open.reserve(64);
    while (!open.empty()) {
        const auto [entered, number] = open.back();
        open.pop_back();
        if (entered == kInfinity || entered * (1 - 4 * kEpsilon) > tMax) continue;
        const Node& node = nodes_[number];
        if (node.count == 0) {
            std::pair<double, uint32_t> near{ray.enter(nodes_[node.first].low, nodes_[node.first].high, tMin, tMax),
                                             node.first};
            std::pair<double, uint32_t> far{
                ray.enter(nodes_[node.first + 1].low, nodes_[node.first + 1].high, tMin, tMax), node.first + 1};
            if (far.first < near.first) std::swap(near, far);
            open.push_back(far);
            open.push_back(near);
            continue;
        }
        for (uint32_t i = 0; i < node.count; ++i) {
            const uint32_t triangle = order_[node.first + i];
            const auto t = ray.hit(mesh_->corners(triangle));
            if (t && *t >= tMin && *t <= tMax && !visit(*t, triangle)) return;
        }
    }
}

namespace {

MeshHit describe(const IndexedMesh& mesh, double t, uint32_t triangle) {
    const auto v = mesh.corners(triangle);
    const glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double length = glm::length(n);
    return {t, triangle, length > 0 ? n / length : glm::dvec3(0)};
}

}  // namespace

std::optional<MeshHit> MeshBvh::nearestHit(glm::dvec3 origin, glm::dvec3 direction, double tMin, double tMax) const {
    std::optional<uint32_t> triangle;
    walkRay(WoopRay(origin, direction, low(), high()), tMin, tMax, [&](double t, uint32_t which) {
        if (triangle && t == tMax) return true;
        tMax = t;
        triangle = which;
        return true;
    });
    if (!triangle) return {};
    return describe(*mesh_, tMax, *triangle);
}

bool MeshBvh::anyHit(glm::dvec3 origin, glm::dvec3 direction, double tMin, double tMax) const {
    bool any = false;
    walkRay(WoopRay(origin, direction, low(), high()), tMin, tMax, [&](double, uint32_t) {
        any = true;
        return false;
    });
    return any;
}

std::vector<MeshHit> MeshBvh::allHits(glm::dvec3 origin, glm::dvec3 direction, double tMin, double tMax) const {
    std::vector<MeshHit> hits;
    walkRay(WoopRay(origin, direction, low(), high()), tMin, tMax, [&](double t, uint32_t triangle) {
        hits.push_back(describe(*mesh_, t, triangle));
        return true;
    });
    std::sort(hits.begin(), hits.end(),
              [](const MeshHit& a, const MeshHit& b) { return a.t != b.t ? a.t < b.t : a.triangle < b.triangle; });
    return hits;
}

}  // namespace vcp
