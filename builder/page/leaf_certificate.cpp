#include "builder/page/leaf_certificate.h"

#include <algorithm>
#include <cmath>

#include "builder/lattice/wider_clones.h"
#include "builder/page/quadric_fit.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/packing.h"

namespace vcp {

namespace {

// Normals of mesh and gradient must stay within 60 degrees of the reference; otherwise the leaf is hard.
constexpr double kConeCosine = 0.5;
constexpr double kMinSlope = 0.5;
constexpr int kMaxSubdivision = 1;

// The share of the tolerance that may be given away for not bounding a small polygon exactly.
constexpr double kCheapSlack = 0.15;

// f is a quadric up to terms of third order. Where the mesh's root mean square distance from every quadric is this
// share of the tolerance, hardly any leaf would certify: it is not tried.
constexpr double kHopelessResidual = 0.3;

// A corner whose vector turns so far from the reference (cosine) sees another sheet: it is not tried either.
constexpr double kHopelessCosine = 0.4;

double clippedArea(const Polygon& polygon, glm::dvec3 normal) {
    glm::dvec3 sum(0);
    for (size_t i = 1; i + 1 < polygon.size(); ++i)
        sum += glm::cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    return std::abs(glm::dot(sum, normal)) / 2;
}

/// Clips the triangles to the widened leaf, in leaf space. Returns false when a bad edge is inside.
bool clipTriangles(glm::dvec3 lower, double edge, std::span<const CertifiedTriangle* const> triangles,
                   CertificateScratch& s) {
    const double half = edge / 2 + kCertificateMarginCells;
    const glm::dvec3 centre = lower + edge / 2;
    for (const CertifiedTriangle* t : triangles) {
        if (t->badEdges == 0) continue;
        for (int i = 0; i < 3; ++i)
            if ((t->badEdges >> i & 1) && segmentMeetsBox(t->corners[i], t->corners[(i + 1) % 3], centre, half))
                return false;
    }
    // Edges are powers of two, so the change to leaf space costs no rounding.
    const double scale = 1 / edge, margin = kCertificateMarginCells * scale;
    const size_t room = triangles.size() * Polygon::kMaxCorners + LeafSurface::kBatchStep;
    if (s.x.size() < room)
        for (auto* list : {&s.x, &s.y, &s.z, &s.value}) list->resize(room);
    s.ends.clear();
    s.normals.clear();
    s.areas.clear();
    s.count = 0;
    Polygon polygon;
    for (const CertifiedTriangle* t : triangles) {
        clipToBox({(t->corners[0] - lower) * scale, (t->corners[1] - lower) * scale, (t->corners[2] - lower) * scale},
                  glm::dvec3(-margin), glm::dvec3(1 + margin), polygon);
        if (polygon.empty()) continue;
        for (const glm::dvec3& p : polygon) {
            s.x[s.count] = float(p.x);
            s.y[s.count] = float(p.y);
            s.z[s.count++] = float(p.z);
        }
        s.ends.push_back(uint32_t(s.count));
        s.normals.push_back(t->normal);
        s.areas.push_back(clippedArea(polygon, t->normal));
    }
    // The last batch is filled up with the last point.
    for (; s.count > 0 && s.count % LeafSurface::kBatchStep != 0; ++s.count)
        for (auto* list : {&s.x, &s.y, &s.z}) (*list)[s.count] = (*list)[s.count - 1];
    return !s.ends.empty();
}

/// Returns the mean normal without orientation, started from the largest piece; zero where the pieces disagree.
glm::dvec3 referenceDirection(const CertificateScratch& s) {
    const size_t largest = size_t(std::max_element(s.areas.begin(), s.areas.end()) - s.areas.begin());
    glm::dvec3 sum(0);
    for (size_t i = 0; i < s.normals.size(); ++i)
        sum += (glm::dot(s.normals[i], s.normals[largest]) < 0 ? -s.areas[i] : s.areas[i]) * s.normals[i];
    const double length = glm::length(sum);
    if (!(length > 0)) return glm::dvec3(0);
    const glm::dvec3 n = sum / length;
    for (const glm::dvec3& m : s.normals)
        if (std::abs(glm::dot(m, n)) < kConeCosine) return glm::dvec3(0);
    return n;
}

/// Turns the values of a quartic at the 15 points (i, j, k) / 4 of a triangle into its Bernstein coefficients, which
/// bound it. The matrix is the inverse of the Bernstein polynomials' values at those points.
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
                rows[p][q] = 24 / (factorial[i] * factorial[j] * factorial[k]) * std::pow(u / 4.0, i) *
                             std::pow(v / 4.0, j) * std::pow(w / 4.0, k);
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
            for (int m = 0; m < kPoints; ++m) coefficient_[m][r] = float(rows[r][kPoints + m] / rows[r][r]);
        for (int p = 0; p < 16; ++p)
            for (int c = 0; c < 3; ++c) weight_[c][p] = float(index_[p % kPoints][c]) / 4;
    }

    /// Sets the 15 points of a triangle (and its first corner again).
    void place(glm::vec3 t0, glm::vec3 t1, glm::vec3 t2, LeafSurface::Batch& b) const {
        for (int p = 0; p < 16; ++p) {
            b.x[p] = weight_[0][p] * t0.x + weight_[1][p] * t1.x + weight_[2][p] * t2.x;
            b.y[p] = weight_[0][p] * t0.y + weight_[1][p] * t1.y + weight_[2][p] * t2.y;
            b.z[p] = weight_[0][p] * t0.z + weight_[1][p] * t1.z + weight_[2][p] * t2.z;
        }
    }

    /// Returns the largest coefficient, by magnitude, of the quartic with these values at the 15 points.
    WIDER_CLONES float bound(const float* values) const {
        alignas(64) float c[16] = {};
        for (int p = 0; p < kPoints; ++p)
            for (int q = 0; q < 16; ++q) c[q] += coefficient_[p][q] * values[p];
        float most = 0;
        for (const float v : c) most = std::max(most, std::abs(v));
        return most;
    }

private:
    static constexpr std::array<std::array<int, 3>, kPoints> index_{{{4, 0, 0},
                                                                     {0, 4, 0},
                                                                     {0, 0, 4},
                                                                     {3, 1, 0},
                                                                     {2, 2, 0},
                                                                     {1, 3, 0},
                                                                     {0, 3, 1},
                                                                     {0, 2, 2},
                                                                     {0, 1, 3},
                                                                     {1, 0, 3},
                                                                     {2, 0, 2},
                                                                     {3, 0, 1},
                                                                     {2, 1, 1},
                                                                     {1, 2, 1},
                                                                     {1, 1, 2}}};
    alignas(64) float coefficient_[kPoints][16] = {};  ///< [point][coefficient]
    alignas(64) float weight_[3][16] = {};             ///< weights of the corners, at each point
};

/// Bounds |f| over flat polygons: on a plane f is a quartic. Values at points suffice where the curvature cannot add
/// much between them: linear interpolation over a triangle within a ball of radius R errs by at most curvature R^2 / 2.
/// First the polygon's corners are tried, then points half and a quarter of the way between them, then the quartic's
/// coefficients.
class PolygonBound {
public:
    PolygonBound(const LeafSurface& surface, double curvature, double limit, CertificateScratch& scratch)
        : surface_(surface), s_(scratch), limit_(limit), halfCurvature_(curvature / 2 * (1 + 1e-5)) {}

    /// Adds all polygons of the scratch memory. Returns false as soon as the bound exceeds the limit.
    bool addAll() {
        float most = 0;
        for (size_t i = 0; i < s_.count; ++i) most = std::max(most, std::abs(s_.value[i]));
        bound_ = double(most) + LeafSurface::kBatchRounding;
        if (bound_ > limit_) return false;
        for (size_t i = 0, begin = 0; i < s_.ends.size(); begin = s_.ends[i++])
            if (!add(begin, s_.ends[i])) return false;
        return true;
    }
    [[nodiscard]] double bound() const { return bound_; }

private:
    /// Whether samples up to `value` that may miss `slack` suffice; then they become part of the bound.
    bool accept(double value, double slack) {
        const double total = value + slack + LeafSurface::kBatchRounding;
        if (total > bound_ && (slack > kCheapSlack * limit_ || total > limit_)) return false;
        bound_ = std::max(bound_, total);
        return true;
    }

    [[nodiscard]] glm::vec3 point(size_t i) const { return {s_.x[i], s_.y[i], s_.z[i]}; }

    bool add(size_t begin, size_t end) {
        glm::vec3 low = point(begin), high = low;
        float value = 0;
        for (size_t i = begin; i < end; ++i) {
            low = glm::min(low, point(i));
            high = glm::max(high, point(i));
            value = std::max(value, std::abs(s_.value[i]));
        }
        const glm::vec3 centre = 0.5f * (low + high);
        float radius2 = 0;
        for (size_t i = begin; i < end; ++i)
            radius2 = std::max(radius2, glm::dot(point(i) - centre, point(i) - centre));
        const double slack = halfCurvature_ * double(radius2);
        if (accept(double(value), slack)) return true;
        const bool fits = 2 * (end - begin) - 3 <= kHalfway;
        if (fits && (slack / 4 <= kCheapSlack * limit_ || double(value) + slack / 4 <= bound_)) {
            value = std::max(value, largestHalfway(begin, end));
            if (double(value) > limit_) return false;
            if (accept(double(value), slack / 4)) return true;
        }
        for (size_t i = begin + 1; i + 1 < end; ++i)
            if (!triangle(point(begin), point(i), point(i + 1), slack / 16, 0)) return false;
        return true;
    }

    static constexpr size_t kHalfway = 16;  ///< points halfway along edges: enough for polygons of 9 corners

    /// Returns the largest |f| halfway along the edges of the polygon's fan of triangles: twice the corners less 3.
    float largestHalfway(size_t begin, size_t end) const {
        LeafSurface::Batch batch;
        size_t count = 0;
        const auto put = [&](size_t i, size_t j) {
            batch.x[count] = 0.5f * (s_.x[i] + s_.x[j]);
            batch.y[count] = 0.5f * (s_.y[i] + s_.y[j]);
            batch.z[count++] = 0.5f * (s_.z[i] + s_.z[j]);
        };
        for (size_t i = begin; i + 1 < end; ++i) put(i, i + 1);
        for (size_t i = begin + 2; i < end; ++i) put(begin, i);
        const size_t points = count;
        while (count % LeafSurface::kBatchStep != 0) put(begin, begin);
        surface_.evaluate(batch.x, batch.y, batch.z, batch.value, count);
        float most = 0;
        for (size_t i = 0; i < points; ++i) most = std::max(most, std::abs(batch.value[i]));
        return most;
    }

    bool triangle(glm::vec3 a, glm::vec3 b, glm::vec3 c, double slack, int depth) {
        static const QuarticTriangle quartic;
        LeafSurface::Batch batch;
        quartic.place(a, b, c, batch);
        surface_.evaluate(batch);
        float most = 0;
        for (const float v : batch.value) most = std::max(most, std::abs(v));
        if (double(most) > limit_) return false;
        if (accept(double(most), slack)) return true;
        // This accounts for the coefficients' rounding: the matrix' rows have an absolute sum below 35.
        const double bound = quartic.bound(batch.value) + 35 * LeafSurface::kBatchRounding;
        if (bound <= limit_ || depth == kMaxSubdivision) {
            bound_ = std::max(bound_, bound);
            return bound <= limit_;
        }
        const glm::vec3 ab = 0.5f * (a + b), bc = 0.5f * (b + c), ca = 0.5f * (c + a);
        const double part = slack / 4;
        return triangle(a, ab, ca, part, depth + 1) && triangle(ab, b, bc, part, depth + 1) &&
               triangle(ca, bc, c, part, depth + 1) && triangle(ab, bc, ca, part, depth + 1);
    }

    const LeafSurface& surface_;
    CertificateScratch& s_;
    double limit_, halfCurvature_, bound_ = 0;
};

/// Returns the largest F that, with the wall tolerance of its code, is at most `sum`.
double largestWalled(double sum) {
    double most = 0;
    for (uint32_t code = 1; code <= kSoftWallMask; ++code)
        most = std::max(most, std::min(wallOf(code), sum - wallOf(code)));
    return most;
}

}  // namespace

Certificate certifyLeaf(glm::dvec3 lower, double edge, std::span<const CertifiedTriangle* const> triangles,
                        double tolerance, const std::function<const CornerVector&(int)>& corner,
                        CertificateScratch& scratch) {
    Certificate result;
    if (!clipTriangles(lower, edge, triangles, scratch)) return result;
    const glm::dvec3 n = referenceDirection(scratch);
    if (n == glm::dvec3(0)) return result;
    if (quadricResidual(scratch.x.data(), scratch.y.data(), scratch.z.data(), scratch.count, n) >
        kHopelessResidual * tolerance / edge)
        return result;
    for (int i = 0; i < 8; ++i) {
        const CornerVector& c = corner(i);
        if (c.distance > double(kPackedDistanceRange) * edge || std::abs(glm::dot(c.direction, n)) < kHopelessCosine)
            return result;
        result.codes[i] = packVector(c.distance / edge, c.direction, glm::dot(c.direction, n) < 0);
    }

    const LeafSurface surface(result.codes);
    const double margin = kCertificateMarginCells / edge;
    const BernsteinCube cube(surface, -margin, 1 + margin);
    result.minSlope = cube.minDerivative(n);
    if (result.minSlope < kMinSlope) return result;
    result.curvature = cube.maxCurvature();
    // A ray may be taken to hit at a wall where |f| <= W, W >= F: there it is at most (F + W) / g from the mesh.
    const double limit = largestWalled(tolerance * result.minSlope / edge);
    surface.evaluate(scratch.x.data(), scratch.y.data(), scratch.z.data(), scratch.value.data(), scratch.count);
    PolygonBound bound(surface, result.curvature, limit, scratch);
    if (!bound.addAll()) return result;
    result.maxValue = bound.bound();
    result.soft = true;
    return result;
}

uint32_t wallCode(double value) {
    if (value <= 0) return 0;
    uint32_t code = uint32_t(std::ceil(std::sqrt(value / double(kWallUnit))));
    while (wallOf(code) < value) ++code;
    while (wallOf(code - 1) >= value) --code;
    return std::min(code, kSoftWallMask + 1);
}

double wallOf(uint32_t code) { return double(kWallUnit) * code * code; }

uint32_t dipCode(double curvature) {
    const double dip = curvature * 3 / 8;
    return dip <= 0.004 ? 0 : dip <= 0.02 ? 1 : dip <= 0.1 ? 2 : 3;
}

}  // namespace vcp
