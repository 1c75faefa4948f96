#include "builder/lattice/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>

#include "builder/lattice/wider_clones.h"

namespace vcp {

namespace {

constexpr double kTouch = 1e-9;

// This stands for a zero that would be divided by.
constexpr double kTiny = 1e-300;

// It takes doubles by value: std::min and std::max hide from the compiler that it can use vectors.
double smaller(double a, double b) { return a < b ? a : b; }
double larger(double a, double b) { return a > b ? a : b; }

/// Finds the closest point of the segment a b to the origin, as the weight of b.
double closestOnSegment(glm::dvec3 a, glm::dvec3 b, double& squared) {
    const glm::dvec3 u = b - a;
    const double length2 = glm::dot(u, u);
    const double w = length2 > 0 ? std::clamp(-glm::dot(a, u) / length2, 0.0, 1.0) : 0.0;
    const glm::dvec3 q = a + w * u;
    squared = glm::dot(q, q);
    return w;
}

}  // namespace

ClosestPoint closestOnTriangle(glm::dvec3 query, const Triangle3& t) {
    const glm::dvec3 a = t[0] - query, b = t[1] - query, c = t[2] - query;
    const glm::dvec3 u = b - a, v = c - a, n = glm::cross(u, v);
    const double n2 = glm::dot(n, n);
    ClosestPoint best;
    if (n2 > 0) {
        const double wc = -glm::dot(glm::cross(u, a), n), wb = -glm::dot(glm::cross(a, v), n);
        if (wb >= 0 && wc >= 0 && wb + wc <= n2) {
            const double distance = glm::dot(a, n) / n2;
            best.offset = distance * n;
            best.squared = glm::dot(best.offset, best.offset);
            best.weights = {1 - (wb + wc) / n2, wb / n2, wc / n2};
            return best;
        }
    }
    double ab = 0, bc = 0, ca = 0;
    const double wab = closestOnSegment(a, b, ab), wbc = closestOnSegment(b, c, bc), wca = closestOnSegment(c, a, ca);
    if (ab <= bc && ab <= ca) {
        best = {a + wab * u, ab, {1 - wab, wab, 0}};
    } else if (bc <= ca) {
        best = {b + wbc * (c - b), bc, {0, 1 - wbc, wbc}};
    } else {
        best = {c + wca * (a - c), ca, {wca, 0, 1 - wca}};
    }
    return best;
}

WIDER_CLONES void squaredDistances(glm::dvec3 query, TriangleBatch& batch) {
    const double px = query.x, py = query.y, pz = query.z;
    for (int i = 0; i < TriangleBatch::kSize; ++i) {
        const double ax = batch.corners[0][i] - px, ay = batch.corners[1][i] - py, az = batch.corners[2][i] - pz;
        const double bx = batch.corners[3][i] - px, by = batch.corners[4][i] - py, bz = batch.corners[5][i] - pz;
        const double cx = batch.corners[6][i] - px, cy = batch.corners[7][i] - py, cz = batch.corners[8][i] - pz;
        const double ux = bx - ax, uy = by - ay, uz = bz - az, vx = cx - ax, vy = cy - ay, vz = cz - az, wx = cx - bx,
                     wy = cy - by, wz = cz - bz;
        // The interior is handled as in closestOnTriangle.
        const double nx = uy * vz - vy * uz, ny = uz * vx - vz * ux, nz = ux * vy - vx * uy;
        const double n2 = nx * nx + ny * ny + nz * nz;
        const double wc = -((uy * az - ay * uz) * nx + (uz * ax - az * ux) * ny + (ux * ay - ax * uy) * nz);
        const double wb = -((ay * vz - vy * az) * nx + (az * vx - vz * ax) * ny + (ax * vy - vx * ay) * nz);
        const double height = ax * nx + ay * ny + az * nz;
        const double area2 = larger(n2, kTiny), outside = larger(larger(-wb, -wc), larger(wb + wc - n2, kTiny - n2));
        // The edges a b, a c, b c.
        const double fu =
            larger(smaller(-(ax * ux + ay * uy + az * uz) / larger(ux * ux + uy * uy + uz * uz, kTiny), 1.0), 0.0);
        const double fv =
            larger(smaller(-(ax * vx + ay * vy + az * vz) / larger(vx * vx + vy * vy + vz * vz, kTiny), 1.0), 0.0);
        const double fw =
            larger(smaller(-(bx * wx + by * wy + bz * wz) / larger(wx * wx + wy * wy + wz * wz, kTiny), 1.0), 0.0);
        const double qx = ax + fu * ux, qy = ay + fu * uy, qz = az + fu * uz, rx = ax + fv * vx, ry = ay + fv * vy,
                     rz = az + fv * vz;
        const double sx = bx + fw * wx, sy = by + fw * wy, sz = bz + fw * wz;
        const double edges =
            smaller(smaller(qx * qx + qy * qy + qz * qz, rx * rx + ry * ry + rz * rz), sx * sx + sy * sy + sz * sz);
        const double face = height * height / area2;
        batch.squared[i] = outside > 0 ? edges : face;
    }
}

BoxOverlap::BoxOverlap(const Triangle3& t) : t_(t) {
    for (int i = 0; i < 3; ++i) edge_[i] = t[(i + 1) % 3] - t[i];
    normal_ = glm::cross(edge_[0], edge_[1]);
    lower_ = glm::min(t[0], glm::min(t[1], t[2]));
    upper_ = glm::max(t[0], glm::max(t[1], t[2]));
}

bool BoxOverlap::test(glm::dvec3 centre, double half) const {
    half += kTouch;
    for (int i = 0; i < 3; ++i)
        if (lower_[i] > centre[i] + half || upper_[i] < centre[i] - half) return false;
    const glm::dvec3 a = t_[0] - centre;
    if (std::abs(glm::dot(normal_, a)) > half * (std::abs(normal_.x) + std::abs(normal_.y) + std::abs(normal_.z)))
        return false;
    const glm::dvec3 b = t_[1] - centre, c = t_[2] - centre;
    for (const glm::dvec3& e : edge_) {
        // For the axes e x (x, y, z), each projection has two components.
        const double ax = e.z * a.y - e.y * a.z, bx = e.z * b.y - e.y * b.z, cx = e.z * c.y - e.y * c.z;
        const double rx = half * (std::abs(e.z) + std::abs(e.y));
        if (std::min(ax, std::min(bx, cx)) > rx || std::max(ax, std::max(bx, cx)) < -rx) return false;
        const double ay = e.x * a.z - e.z * a.x, by = e.x * b.z - e.z * b.x, cy = e.x * c.z - e.z * c.x;
        const double ry = half * (std::abs(e.x) + std::abs(e.z));
        if (std::min(ay, std::min(by, cy)) > ry || std::max(ay, std::max(by, cy)) < -ry) return false;
        const double az = e.y * a.x - e.x * a.y, bz = e.y * b.x - e.x * b.y, cz = e.y * c.x - e.x * c.y;
        const double rz = half * (std::abs(e.y) + std::abs(e.x));
        if (std::min(az, std::min(bz, cz)) > rz || std::max(az, std::max(bz, cz)) < -rz) return false;
    }
    return true;
}

bool segmentMeetsBox(glm::dvec3 a, glm::dvec3 b, glm::dvec3 centre, double half) {
    half += kTouch;
    a -= centre;
    b -= centre;
    double t0 = 0, t1 = 1;
    for (int i = 0; i < 3; ++i) {
        const double d = b[i] - a[i];
        if (d == 0) {
            if (std::abs(a[i]) > half) return false;
            continue;
        }
        double enter = (-half - a[i]) / d, leave = (half - a[i]) / d;
        if (enter > leave) std::swap(enter, leave);
        t0 = std::max(t0, enter);
        t1 = std::min(t1, leave);
        if (t0 > t1) return false;
    }
    return true;
}

std::pair<double, double> extentOf(const Polygon& polygon, int axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const glm::dvec3& p : polygon) {
        least = std::min(least, p[axis]);
        most = std::max(most, p[axis]);
    }
    return {least, most};
}

PolygonSides partAt(const Polygon& polygon, int axis, double at, Polygon& below, Polygon& above) {
    std::array<double, Polygon::kMaxCorners> from;  // the plane, of each corner
    bool isBelow = false, isAbove = false;
    for (size_t i = 0; i < polygon.size(); ++i) {
        from[i] = polygon[i][axis] - at;
        isBelow |= from[i] < 0;
        isAbove |= from[i] > 0;
    }
    if (!isBelow || !isAbove) return {isAbove ? nullptr : &polygon, isBelow ? nullptr : &polygon};
    below.clear();
    above.clear();
    for (size_t i = 0; i < polygon.size(); ++i) {
        const size_t next = i + 1 < polygon.size() ? i + 1 : 0;
        const double da = from[i], db = from[next];
        const glm::dvec3 &a = polygon[i], &b = polygon[next];
        if (da <= 0) below.add(a);
        if (da >= 0) above.add(a);
        if ((da < 0) == (db < 0) || da == 0 || db == 0) continue;
        glm::dvec3 crossing = a + da / (da - db) * (b - a);
        crossing[axis] = at;
        below.add(crossing);
        above.add(crossing);
    }
    return {&below, &above};
}

void clipToBox(const Triangle3& triangle, glm::dvec3 lower, glm::dvec3 upper, Polygon& polygon) {
    polygon.clear();
    unsigned beyond[3] = {};  // bit 2 * axis + end: outside that plane
    for (int i = 0; i < 3; ++i)
        for (int axis = 0; axis < 3; ++axis)
            beyond[i] |= (triangle[i][axis] < lower[axis] ? 1u : 0u) << 2 * axis |
                         (triangle[i][axis] > upper[axis] ? 2u : 0u) << 2 * axis;
    if (beyond[0] & beyond[1] & beyond[2]) return;
    for (const glm::dvec3& p : triangle) polygon.add(p);
    const unsigned planes = beyond[0] | beyond[1] | beyond[2];
    if (planes == 0) return;
    Polygon spare;
    Polygon *from = &polygon, *to = &spare;
    for (int plane = 0; plane < 6; ++plane) {
        if (!(planes >> plane & 1u)) continue;
        const int axis = plane / 2;
        const double side = plane % 2 ? 1 : -1, limit = plane % 2 ? upper[axis] : -lower[axis];
        to->clear();
        const glm::dvec3* p = from->end() - 1;
        double dp = limit - side * (*p)[axis];
        for (const glm::dvec3& q : *from) {
            const double dq = limit - side * q[axis];
            if ((dp < 0) != (dq < 0)) to->add(*p + (q - *p) * (dp / (dp - dq)));
            if (dq >= 0) to->add(q);
            p = &q;
            dp = dq;
        }
        std::swap(from, to);
        if (from->size() < 3) return polygon.clear();
    }
    if (from == &spare) {
        polygon.clear();
        for (const glm::dvec3& p : spare) polygon.add(p);
    }
}

}  // namespace vcp
