#include "builder/page/leaf_surface.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "builder/lattice/wider_clones.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

// A linear polynomial with end values a, b has the Bernstein coefficients a, (a + b) / 2, b of degree 2;
// times the coordinate, which runs from l to h, they are l a, (l b + h a) / 2, h b.
struct Quadratic {
    double c[3];
};

Quadratic raised(double a, double b) { return {{a, (a + b) / 2, b}}; }
Quadratic timesCoordinate(double a, double b, double l, double h) { return {{l * a, (l * b + h * a) / 2, h * b}}; }

}  // namespace

LeafSurface::LeafSurface(const std::array<uint32_t, 8>& codes) {
    for (size_t i = 0; i < 8; ++i) {
        const double side = f64::decodeSide(codes[i]);
        slope_[i] = 0.5 * side * f64::decodeDirection(codes[i] >> 11);
        constant_[i] =
            side * f64::decodeDistance(codes[i]) - glm::dot(slope_[i], glm::dvec3(i & 1, i >> 1 & 1, i >> 2));
        coefficients_[i] = float(constant_[i]);
        coefficients_[i + 8] = float(slope_[i].x);
        coefficients_[i + 16] = float(slope_[i].y);
        coefficients_[i + 24] = float(slope_[i].z);
    }
}

double LeafSurface::value(glm::dvec3 x) const {
    const auto along = [&](int i) { return constant_[i] + glm::dot(slope_[i], x); };
    const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
    return mix(mix(mix(along(0), along(1), x.x), mix(along(2), along(3), x.x), x.y),
               mix(mix(along(4), along(5), x.x), mix(along(6), along(7), x.x), x.y), x.z);
}

WIDER_CLONES void LeafSurface::evaluate(const float* px, const float* py, const float* pz, float* value,
                                        size_t count) const {
    const float *c = coefficients_.data(), *sx = c + 8, *sy = c + 16, *sz = c + 24;
    for (size_t first = 0; first < count; first += kBatchStep) {
        float v[kBatchStep];
        for (size_t i = 0; i < kBatchStep; ++i) {
            const float x = px[first + i], y = py[first + i], z = pz[first + i];
            const float a0 = c[0] + sx[0] * x + sy[0] * y + sz[0] * z, a1 = c[1] + sx[1] * x + sy[1] * y + sz[1] * z;
            const float a2 = c[2] + sx[2] * x + sy[2] * y + sz[2] * z, a3 = c[3] + sx[3] * x + sy[3] * y + sz[3] * z;
            const float a4 = c[4] + sx[4] * x + sy[4] * y + sz[4] * z, a5 = c[5] + sx[5] * x + sy[5] * y + sz[5] * z;
            const float a6 = c[6] + sx[6] * x + sy[6] * y + sz[6] * z, a7 = c[7] + sx[7] * x + sy[7] * y + sz[7] * z;
            const float y0 = a0 + (a1 - a0) * x, y1 = a2 + (a3 - a2) * x, y2 = a4 + (a5 - a4) * x,
                        y3 = a6 + (a7 - a6) * x;
            const float z0 = y0 + (y1 - y0) * y, z1 = y2 + (y3 - y2) * y;
            v[i] = z0 + (z1 - z0) * z;
        }
        for (size_t i = 0; i < kBatchStep; ++i) value[first + i] = v[i];
    }
}

BernsteinCube::BernsteinCube(const LeafSurface& surface, double lower, double upper) : width_(upper - lower) {
    // f = C + x X + y Y + z Z with C, X, Y, Z trilinear: first their values at the cube's corners ...
    double corner[8][4];
    for (size_t i = 0; i < 8; ++i) {
        corner[i][0] = surface.constant_[i];
        for (int k = 0; k < 3; ++k) corner[i][k + 1] = surface.slope_[i][k];
    }
    for (const int bit : {1, 2, 4})
        for (int i = 0; i < 8; ++i) {
            if (i & bit) continue;
            for (int k = 0; k < 4; ++k) {
                const double a = corner[i][k], d = corner[i | bit][k] - a;
                corner[i][k] = a + lower * d;
                corner[i | bit][k] = a + upper * d;
            }
        }
    // ... then they are raised to degree 2, an axis at a time; the factor of the axis' own coordinate joins f there.
    double f1[4][3], y1[4][3], z1[4][3];  // [corner of y, z][x]
    for (int i = 0; i < 4; ++i) {
        const double *a = corner[2 * i], *b = corner[2 * i + 1];
        const Quadratic c = raised(a[0], b[0]), x = timesCoordinate(a[1], b[1], lower, upper), y = raised(a[2], b[2]),
                        z = raised(a[3], b[3]);
        for (int m = 0; m < 3; ++m) f1[i][m] = c.c[m] + x.c[m], y1[i][m] = y.c[m], z1[i][m] = z.c[m];
    }
    double f2[2][9], z2[2][9];  // [corner of z][x, y]
    for (int i = 0; i < 2; ++i)
        for (int m = 0; m < 3; ++m) {
            const Quadratic f = raised(f1[2 * i][m], f1[2 * i + 1][m]),
                            y = timesCoordinate(y1[2 * i][m], y1[2 * i + 1][m], lower, upper),
                            z = raised(z1[2 * i][m], z1[2 * i + 1][m]);
            for (int n = 0; n < 3; ++n) f2[i][m + 3 * n] = f.c[n] + y.c[n], z2[i][m + 3 * n] = z.c[n];
        }
    for (size_t m = 0; m < 9; ++m) {
        const Quadratic f = raised(f2[0][m], f2[1][m]), z = timesCoordinate(z2[0][m], z2[1][m], lower, upper);
        for (size_t n = 0; n < 3; ++n) c_[m + 9 * n] = f.c[n] + z.c[n];
    }
}

double BernsteinCube::minDerivative(glm::dvec3 n) const {
    // Each partial derivative has degree 1 along its axis; raised to 2 there, the three share one control net.
    const auto slope = [](double a, double b, double c, int i) {
        return i == 0 ? b - a : i == 2 ? c - b : (c - a) / 2;
    };
    double least[3] = {1e300, 1e300, 1e300};
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x) {
                const double dx = slope(at(0, y, z), at(1, y, z), at(2, y, z), x);
                const double dy = slope(at(x, 0, z), at(x, 1, z), at(x, 2, z), y);
                const double dz = slope(at(x, y, 0), at(x, y, 1), at(x, y, 2), z);
                least[x] = std::min(least[x], n.x * dx + n.y * dy + n.z * dz);
            }
    return 2 * std::min({least[0], least[1], least[2]}) / width_;
}

double BernsteinCube::maxCurvature() const {
    double pure[3] = {}, mixed[3] = {};  // xx yy zz, yz zx xy
    constexpr int stride[3] = {1, 3, 9};
    for (int axis = 0; axis < 3; ++axis) {
        const int s = stride[axis], u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) {
                const double* c = c_.data() + i * u + j * v;
                pure[axis] = std::max(pure[axis], std::abs(c[0] - 2 * c[s] + c[2 * s]));
            }
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 2; ++j)
                for (int i = 0; i < 2; ++i) {
                    const double* c = c_.data() + k * s + i * u + j * v;
                    mixed[axis] = std::max(mixed[axis], std::abs((c[u + v] - c[u]) - (c[v] - c[0])));
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

}  // namespace vcp
