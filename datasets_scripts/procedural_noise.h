// Noise and waves from integer hashes and plain IEEE arithmetic only: no libm call whose last bit differs
// from one system to the next, so that a seed gives the same bytes everywhere.
#pragma once

#include <cmath>
#include <cstdint>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace vcp::scan {

/// splitmix64's finaliser: every input bit reaches every output bit.
inline uint64_t hash(uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// Uniform in [-1, 1), from 21 bits of `bits` starting at `shift`.
inline double signedUnit(uint64_t bits, int shift = 0) {
    return double((bits >> shift) & 0x1fffff) * (2.0 / 0x200000) - 1.0;
}

/// sin(2 pi turns), error below 1e-9.
inline double sinTurns(double turns) {
    double t = turns - std::floor(turns + 0.5);
    if (t > 0.25) t = 0.5 - t;
    if (t < -0.25) t = -0.5 - t;
    const double x = t * 6.283185307179586476925;
    const double q = x * x;
    return x * (1 + q * (-1.0 / 6 +
                         q * (1.0 / 120 + q * (-1.0 / 5040 +
                                               q * (1.0 / 362880 + q * (-1.0 / 39916800 + q * (1.0 / 6227020800)))))));
}

inline double cosTurns(double turns) { return sinTurns(turns + 0.25); }

/// Returns 0 up to `from`, 1 beyond `to`, smooth between.
inline double smoothStep(double from, double to, double x) {
    const double t = (x - from) / (to - from);
    if (t <= 0) return 0;
    if (t >= 1) return 1;
    return t * t * (3 - 2 * t);
}

/// Returns 1 at 0, 0 from |x| = 1 on, smooth.
inline double bump(double x) {
    const double q = 1 - x * x;
    return q > 0 ? q * q : 0;
}

/// Gradient noise on the unit lattice, in about [-1, 1].
class Noise {
public:
    explicit Noise(uint64_t seed) : seed_(hash(seed)) {}

    double operator()(const glm::dvec3& p) const {
        const glm::dvec3 cell(std::floor(p.x), std::floor(p.y), std::floor(p.z));
        const glm::dvec3 f = p - cell;
        const glm::dvec3 s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
        const auto x = int64_t(cell.x), y = int64_t(cell.y), z = int64_t(cell.z);
        const auto edge = [&](int dy, int dz) {
            const double a = corner(x, y + dy, z + dz, f.x, f.y - dy, f.z - dz);
            const double b = corner(x + 1, y + dy, z + dz, f.x - 1, f.y - dy, f.z - dz);
            return a + s.x * (b - a);
        };
        const double near = edge(0, 0) + s.y * (edge(1, 0) - edge(0, 0));
        const double far = edge(0, 1) + s.y * (edge(1, 1) - edge(0, 1));
        return near + s.z * (far - near);
    }

    /// Sums octaves from `wavelength` down to `finest`, each half as high as the one before.
    [[nodiscard]] double fractal(const glm::dvec3& p, double wavelength, double finest) const {
        double sum = 0, height = 1;
        for (glm::dvec3 offset(0); wavelength >= finest; wavelength *= 0.5, height *= 0.5, offset += 17.3)
            sum += height * (*this)(p / wavelength + offset);
        return sum;
    }

private:
    double corner(int64_t x, int64_t y, int64_t z, double dx, double dy, double dz) const {
        const uint64_t h =
            hash(seed_ ^ (uint64_t(x) * 0x8da6b343u + uint64_t(y) * 0xd8163841u + uint64_t(z) * 0xcb1ab31fu));
        // The 12 edge directions of a cube, as in Perlin's improved noise.
        const uint64_t edge = (h >> 40) % 12;
        const double a = (h & 1) ? 1 : -1, b = (h & 2) ? 1 : -1;
        return edge < 4 ? a * dx + b * dy : edge < 8 ? a * dx + b * dz : a * dy + b * dz;
    }

    uint64_t seed_;
};

}  // namespace vcp::scan
