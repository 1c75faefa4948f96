#include "builder/leaf_certificate.h"

#include <algorithm>
#include <cmath>

#include "octree/leaf_math.h"
#include "octree/packing.h"

// Also compiled for wider vectors, chosen when the program starts. They round alike, since nothing is fused:
// results do not depend on the processor.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WIDER_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define WIDER_CLONES
#endif

namespace vcp {

namespace {

// Normals of mesh and gradient must stay within 60 degrees of the reference; beyond it a leaf is hard.
constexpr double kConeCosine = 0.5;
constexpr double kMinSlope = 0.5;
constexpr int kMaxSubdivision = 1;

// Part of the tolerance that may be given away for not bounding a small polygon exactly.
constexpr double kCheapSlack = 0.15;

double clippedArea(std::span<const glm::dvec3> polygon, glm::dvec3 normal) {
    glm::dvec3 sum(0);
    for (size_t i = 1; i + 1 < polygon.size(); ++i) sum += glm::cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    return std::abs(glm::dot(sum, normal)) / 2;
}

/// The triangles clipped to the widened leaf, in leaf space. False when a bad edge is inside.
bool clipTriangles(glm::dvec3 lower, double edge, std::span<const CertifiedTriangle* const> triangles, CertificateScratch& s) {
    const double half = edge / 2 + kCertificateMarginCells;
    const glm::dvec3 centre = lower + edge / 2;
    s.points.clear();
    s.ends.clear();
    s.normals.clear();
    s.areas.clear();
    for (const CertifiedTriangle* t : triangles) {
        for (int i = 0; i < 3; ++i)
            if ((t->badEdges >> i & 1) && segmentMeetsBox(t->corners[i], t->corners[(i + 1) % 3], centre, half)) return false;
    }
    for (const CertifiedTriangle* t : triangles) {
        clipToBox(t->corners, centre - half, centre + half, s.polygon, s.clip);
        if (s.polygon.size() < 3) continue;
        const size_t begin = s.points.size();
        for (const glm::dvec3& p : s.polygon) s.points.push_back((p - lower) / edge);
        s.ends.push_back(static_cast<uint32_t>(s.points.size()));
        s.normals.push_back(t->normal);
        s.areas.push_back(clippedArea(std::span(s.points).subspan(begin), t->normal));
    }
    return !s.ends.empty();
}

/// Mean normal without orientation, started from the largest piece; zero where the pieces disagree.
glm::dvec3 referenceDirection(const CertificateScratch& s) {
    const size_t largest = static_cast<size_t>(std::max_element(s.areas.begin(), s.areas.end()) - s.areas.begin());
    glm::dvec3 sum(0);
    for (size_t i = 0; i < s.normals.size(); ++i) sum += (glm::dot(s.normals[i], s.normals[largest]) < 0 ? -s.areas[i] : s.areas[i]) * s.normals[i];
    const double length = glm::length(sum);
    if (!(length > 0)) return glm::dvec3(0);
    const glm::dvec3 n = sum / length;
    for (const glm::dvec3& m : s.normals)
        if (std::abs(glm::dot(m, n)) < kConeCosine) return glm::dvec3(0);
    return n;
}

/// From the values of a quartic at the 15 points (i, j, k) / 4 of a triangle to its Bernstein coefficients,
/// which bound it. The matrix is the inverse of the Bernstein polynomials' values at those points.
class QuarticTriangle {
public:
    static constexpr int kPoints = 15;

    QuarticTriangle() {
        double rows[kPoints][2 * kPoints] = {};
        constexpr double factorial[5] = {1, 1, 2, 6, 24};
        for (int p = 0; p < kPoints; ++p) {
            for (int q = 0; q < kPoints; ++q) {
                const auto [i, j, k] = index_[q];
                const auto [u, v, w] = index_[p];
                rows[p][q] = 24 / (factorial[i] * factorial[j] * factorial[k]) * std::pow(u / 4.0, i) * std::pow(v / 4.0, j) * std::pow(w / 4.0, k);
            }
            rows[p][kPoints + p] = 1;
        }
        for (int c = 0; c < kPoints; ++c) {
            int pivot = c;
            for (int r = c + 1; r < kPoints; ++r)
                if (std::abs(rows[r][c]) > std::abs(rows[pivot][c])) pivot = r;
            std::swap(rows[c], rows[pivot]);
            for (int r = 0; r < kPoints; ++r) {
                if (r == c) continue;
                const double factor = rows[r][c] / rows[c][c];
                for (int m = 0; m < 2 * kPoints; ++m) rows[r][m] -= factor * rows[c][m];
            }
        }
        for (int r = 0; r < kPoints; ++r)
            for (int m = 0; m < kPoints; ++m) coefficient_[m][r] = static_cast<float>(rows[r][kPoints + m] / rows[r][r]);
        for (int p = 0; p < 16; ++p)
            for (int c = 0; c < 3; ++c) weight_[c][p] = static_cast<float>(index_[p % kPoints][c]) / 4;
    }

    /// The 15 points of a triangle (and its first corner again).
    void place(const Triangle3& t, LeafSurface::Batch& b) const {
        const glm::vec3 t0(t[0]), t1(t[1]), t2(t[2]);
        for (int p = 0; p < 16; ++p) {
            b.x[p] = weight_[0][p] * t0.x + weight_[1][p] * t1.x + weight_[2][p] * t2.x;
            b.y[p] = weight_[0][p] * t0.y + weight_[1][p] * t1.y + weight_[2][p] * t2.y;
            b.z[p] = weight_[0][p] * t0.z + weight_[1][p] * t1.z + weight_[2][p] * t2.z;
        }
    }

    /// Largest coefficient, by magnitude, of the quartic with these values at the 15 points.
    WIDER_CLONES float bound(const float* values) const {
        alignas(64) float c[16] = {};
        for (int p = 0; p < kPoints; ++p)
            for (int q = 0; q < 16; ++q) c[q] += coefficient_[p][q] * values[p];
        float most = 0;
        for (const float v : c) most = std::max(most, std::abs(v));
        return most;
    }

private:
    static constexpr std::array<std::array<int, 3>, kPoints> index_{{{4, 0, 0}, {0, 4, 0}, {0, 0, 4}, {3, 1, 0}, {2, 2, 0}, {1, 3, 0}, {0, 3, 1}, {0, 2, 2},
                                                                     {0, 1, 3}, {1, 0, 3}, {2, 0, 2}, {3, 0, 1}, {2, 1, 1}, {1, 2, 1}, {1, 1, 2}}};
    alignas(64) float coefficient_[kPoints][16] = {};  ///< [point][coefficient]
    alignas(64) float weight_[3][16] = {};             ///< of the corners, at each point
};

/// Bound on |f| over a flat polygon: on a plane f is a quartic.
class PolygonBound {
public:
    PolygonBound(const LeafSurface& surface, double curvature, double limit) : surface_(surface), curvature_(curvature), limit_(limit) {}

    /// False as soon as the bound exceeds the limit. Where the curvature cannot add much between the corners,
    /// their values are enough: linear interpolation over a triangle of longest edge L errs by at most
    /// curvature L^2 / 6.
    bool add(std::span<const glm::dvec3> polygon) {
        LeafSurface::Batch batch;
        const size_t count = std::min<size_t>(polygon.size(), 16);
        glm::dvec3 low = polygon[0], high = polygon[0];
        for (size_t i = 0; i < 16; ++i) {
            const glm::dvec3 p = polygon[std::min(i, count - 1)];
            batch.x[i] = static_cast<float>(p.x);
            batch.y[i] = static_cast<float>(p.y);
            batch.z[i] = static_cast<float>(p.z);
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        surface_.evaluate(batch);
        double corner = 0;
        for (size_t i = 0; i < count; ++i) corner = std::max(corner, double(std::abs(batch.value[i])));
        corner += LeafSurface::kBatchRounding;
        if (corner > limit_) return false;
        const double slack = curvature_ * glm::dot(high - low, high - low) / 6;
        if (polygon.size() <= 16 && (corner + slack <= bound_ || (slack <= kCheapSlack * limit_ && corner + slack <= limit_))) {
            bound_ = std::max(bound_, corner + slack);
            return true;
        }
        for (size_t i = 1; i + 1 < polygon.size(); ++i)
            if (!triangle({polygon[0], polygon[i], polygon[i + 1]}, 0)) return false;
        return true;
    }
    [[nodiscard]] double bound() const { return bound_; }

private:
    bool triangle(const Triangle3& t, int depth) {
        static const QuarticTriangle quartic;
        LeafSurface::Batch batch;
        quartic.place(t, batch);
        surface_.evaluate(batch);
        for (int p = 0; p < QuarticTriangle::kPoints; ++p)
            if (std::abs(batch.value[p]) > limit_) return false;
        // The coefficients' rounding: the matrix' rows have an absolute sum below 35.
        const double bound = quartic.bound(batch.value) + 35 * LeafSurface::kBatchRounding;
        if (bound <= limit_ || depth == kMaxSubdivision) {
            bound_ = std::max(bound_, bound);
            return bound <= limit_;
        }
        const glm::dvec3 ab = (t[0] + t[1]) / 2.0, bc = (t[1] + t[2]) / 2.0, ca = (t[2] + t[0]) / 2.0;
        return triangle({t[0], ab, ca}, depth + 1) && triangle({ab, t[1], bc}, depth + 1) && triangle({ca, bc, t[2]}, depth + 1) && triangle({ab, bc, ca}, depth + 1);
    }

    const LeafSurface& surface_;
    double curvature_, limit_, bound_ = 0;
};

}  // namespace

LeafSurface::LeafSurface(const std::array<uint32_t, 8>& codes) {
    for (int i = 0; i < 8; ++i) {
        const double side = f64::decodeSide(codes[i]);
        slope_[i] = 0.5 * side * f64::decodeDirection(codes[i] >> 11);
        constant_[i] = side * f64::decodeDistance(codes[i]) - glm::dot(slope_[i], glm::dvec3(i & 1, i >> 1 & 1, i >> 2));
    }
}

double LeafSurface::value(glm::dvec3 x) const {
    const auto along = [&](int i) { return constant_[i] + glm::dot(slope_[i], x); };
    const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
    return mix(mix(mix(along(0), along(1), x.x), mix(along(2), along(3), x.x), x.y), mix(mix(along(4), along(5), x.x), mix(along(6), along(7), x.x), x.y), x.z);
}

WIDER_CLONES void LeafSurface::evaluate(Batch& b) const {
    float constant[8], slope[8][3];
    for (int c = 0; c < 8; ++c) {
        constant[c] = static_cast<float>(constant_[c]);
        for (int i = 0; i < 3; ++i) slope[c][i] = static_cast<float>(slope_[c][i]);
    }
    for (int i = 0; i < 16; ++i) {
        const float x = b.x[i], y = b.y[i], z = b.z[i];
        float along[8];
        for (int c = 0; c < 8; ++c) along[c] = constant[c] + slope[c][0] * x + slope[c][1] * y + slope[c][2] * z;
        const float y0 = along[0] + (along[1] - along[0]) * x, y1 = along[2] + (along[3] - along[2]) * x;
        const float y2 = along[4] + (along[5] - along[4]) * x, y3 = along[6] + (along[7] - along[6]) * x;
        const float z0 = y0 + (y1 - y0) * y, z1 = y2 + (y3 - y2) * y;
        b.value[i] = z0 + (z1 - z0) * z;
    }
}

BernsteinCube::BernsteinCube(const LeafSurface& surface, double lower, double upper) : width_(upper - lower) {
    const double x[3] = {lower, (lower + upper) / 2, upper};
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) c_[i + 3 * j + 9 * k] = surface.value({x[i], x[j], x[k]});
    // From values at ends and middle to coefficients, an axis at a time: b1 = 2 f(1/2) - (f0 + f1) / 2.
    for (const int stride : {1, 3, 9})
        for (int m = 0; m < 27; ++m)
            if (m / stride % 3 == 1) c_[m] = 2 * c_[m] - (c_[m - stride] + c_[m + stride]) / 2;
}

double BernsteinCube::minDerivative(glm::dvec3 n) const {
    // Each partial has degree 1 along its axis; raised to 2 there, the three share one control net.
    double least = 1e300;
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x) {
                const double dx = x == 0 ? at(1, y, z) - at(0, y, z) : x == 2 ? at(2, y, z) - at(1, y, z) : (at(2, y, z) - at(0, y, z)) / 2;
                const double dy = y == 0 ? at(x, 1, z) - at(x, 0, z) : y == 2 ? at(x, 2, z) - at(x, 1, z) : (at(x, 2, z) - at(x, 0, z)) / 2;
                const double dz = z == 0 ? at(x, y, 1) - at(x, y, 0) : z == 2 ? at(x, y, 2) - at(x, y, 1) : (at(x, y, 2) - at(x, y, 0)) / 2;
                least = std::min(least, n.x * dx + n.y * dy + n.z * dz);
            }
    return 2 * least / width_;
}

double BernsteinCube::maxCurvature() const {
    double pure[3] = {}, mixed[3] = {};  // xx yy zz, yz zx xy
    constexpr int stride[3] = {1, 3, 9};
    for (int axis = 0; axis < 3; ++axis) {
        const int s = stride[axis], u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
        for (int m = 0; m < 27; ++m) {
            if (m / s % 3 == 0) pure[axis] = std::max(pure[axis], std::abs(c_[m] - 2 * c_[m + s] + c_[m + 2 * s]));
            if (m / u % 3 < 2 && m / v % 3 < 2) mixed[axis] = std::max(mixed[axis], std::abs(c_[m + u + v] - c_[m + u] - c_[m + v] + c_[m]));
        }
    }
    // Second derivatives are 2 and 4 times these differences; the spectral norm is at most the largest row sum.
    double norm = 0;
    for (int i = 0; i < 3; ++i) norm = std::max(norm, 2 * pure[i] + 4 * mixed[(i + 1) % 3] + 4 * mixed[(i + 2) % 3]);
    return norm / (width_ * width_);
}

BernsteinCube::Range BernsteinCube::faceRange(int axis, int end) const {
    constexpr int stride[3] = {1, 3, 9};
    const int base = 2 * end * stride[axis], u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
    Range range{1e300, -1e300};
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
            range.min = std::min(range.min, c_[base + i * u + j * v]);
            range.max = std::max(range.max, c_[base + i * u + j * v]);
        }
    return range;
}

Certificate certifyLeaf(glm::dvec3 lower, double edge, std::span<const CertifiedTriangle* const> triangles, double tolerance,
                        const std::function<const CornerVector&(int)>& corner, CertificateScratch& scratch) {
    Certificate result;
    if (!clipTriangles(lower, edge, triangles, scratch)) return result;
    const glm::dvec3 n = referenceDirection(scratch);
    if (n == glm::dvec3(0)) return result;
    for (int i = 0; i < 8; ++i) {
        const CornerVector& c = corner(i);
        if (c.distance > double(kPackedDistanceRange) * edge) return result;
        result.codes[i] = packVector(c.distance / edge, c.direction, glm::dot(c.direction, n) < 0);
    }

    const LeafSurface surface(result.codes);
    const double margin = kCertificateMarginCells / edge;
    const BernsteinCube cube(surface, -margin, 1 + margin);
    result.minSlope = cube.minDerivative(n);
    if (result.minSlope < kMinSlope) return result;
    result.curvature = cube.maxCurvature();
    // A ray may be taken to hit at a wall where |f| <= F: there it is at most 2 F / g from the mesh.
    const double limit = tolerance * result.minSlope / (2 * edge);
    PolygonBound bound(surface, result.curvature, limit);
    for (size_t i = 0, begin = 0; i < scratch.ends.size(); begin = scratch.ends[i++])
        if (!bound.add(std::span(scratch.points).subspan(begin, scratch.ends[i] - begin))) return result;
    result.maxValue = bound.bound();
    const uint32_t code = wallCode(result.maxValue);
    result.soft = code <= kSoftWallMask && (result.maxValue + wallOf(code)) * edge <= tolerance * result.minSlope;
    return result;
}

uint32_t wallCode(double value) {
    if (value <= 0) return 0;
    uint32_t code = static_cast<uint32_t>(std::ceil(std::sqrt(value / double(kWallUnit))));
    while (wallOf(code) < value) ++code;
    return std::min(code, kSoftWallMask + 1);
}

double wallOf(uint32_t code) { return double(kWallUnit) * code * code; }

uint32_t dipCode(double curvature) {
    const double dip = curvature * 3 / 8;
    return dip <= 0.004 ? 0 : dip <= 0.02 ? 1 : dip <= 0.1 ? 2 : 3;
}

}  // namespace vcp
