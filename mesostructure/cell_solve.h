// Finds where a ray first enters the solid inside one cell: closed forms for the bilinear height field and, one
// monotone piece after the other, for the trilinear field. The function f along the ray is above 0 outside the solid.
//
// The side travels with the ray: `outside` says on which side it came to the cell. A ray that was outside and finds f
// <= 0 at the wall enters there, so nothing slips between cells whose values round differently.
// (DESIGN: no epsilon; Hansson-Soderlund et al. 2022 and Marmitt et al. 2004 for splitting the cubic.)
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace vcp::meso {

template <class Real>
struct CellHit {
    bool hit = false;
    Real t = 0;            ///< time of the entry
    bool outside = false;  ///< side at the end of the interval, when there was no hit
};

/// Returns the first u in [0, 1] where a cubic c0 + c1 u + c2 u^2 + c3 u^3 falls to 0 from above.
template <class Real>
CellHit<Real> firstFall(Real c0, Real c1, Real c2, Real c3, bool outside) {
    const auto f = [&](Real u) { return ((c3 * u + c2) * u + c1) * u + c0; };
    if (c0 > 0)
        outside = true;
    else if (outside)
        return {true, 0, false};
    // The cubic is monotone between 0, the roots of the derivative in [0, 1], and 1.
    Real r0 = 1, r1 = 1;
    const Real a = 3 * c3, b = 2 * c2, disc = b * b - 4 * a * c1;
    if (disc > 0) {
        const Real q = Real(-0.5) * (b + (b >= 0 ? std::sqrt(disc) : -std::sqrt(disc)));
        const Real ra = a != 0 ? q / a : Real(1), rb = q != 0 ? c1 / q : Real(1);
        r0 = std::clamp(std::min(ra, rb), Real(0), Real(1)), r1 = std::clamp(std::max(ra, rb), Real(0), Real(1));
    }
    const Real f0 = f(r0), f1 = f(r1), f2 = f(Real(1));
    Real low = 0, high = r0, fLow = c0, fHigh = f0;
    if (!(outside && f0 <= 0)) {
        if (f0 > 0 && f1 <= 0)
            low = r0, high = r1, fLow = f0, fHigh = f1;
        else if (f1 > 0 && f2 <= 0)
            low = r1, high = 1, fLow = f1, fHigh = f2;
        else
            return {false, 0, f2 > 0};
    }
    // A step is Newton's, or a bisection where that leaves the bracket.
    Real u = low + (high - low) * (fLow / (fLow - fHigh));
    for (int k = 0; k < 24; ++k) {
        if (!(u > low && u < high)) u = Real(0.5) * (low + high);
        const Real value = f(u);
        if (value > 0)
            low = u;
        else
            high = u;
        const Real step = value / ((Real(3) * c3 * u + Real(2) * c2) * u + c1);
        if (std::abs(step) <= Real(2) * std::numeric_limits<Real>::epsilon() * u) break;
        u -= step;
    }
    return {true, u >= low && u <= high ? u : high, false};
}

/// Heights at the corners of the cell [0, 1]^2; z in any unit. f = z - height.
template <class Real>
struct BilinearCell {
    Real h00, h10, h01, h11;

    /// `o` and `d` are in cell units along x and y, from the cell's lower corner. The search is between ta <= tb.
    CellHit<Real> firstEntry(glm::vec<3, Real> o, glm::vec<3, Real> d, Real ta, Real tb, bool outside) const {
        const Real hx = h10 - h00, hy = h01 - h00, hxy = h11 - h10 - h01 + h00;
        const Real x = o.x + ta * d.x, y = o.y + ta * d.y, z = o.z + ta * d.z, span = tb - ta;
        const Real c = z - (h00 + hx * x + hy * y + hxy * x * y);
        if (c > 0)
            outside = true;
        else if (outside)
            return {true, ta, false};
        const Real b = d.z - hx * d.x - hy * d.y - hxy * (x * d.y + y * d.x), a = -hxy * d.x * d.y;
        const Real end = (a * span + b) * span + c;
        if (!outside) return {false, 0, end > 0};
        // The first root, computed without cancellation; there is none behind the interval's end unless the parabola
        // opens upwards.
        if (end > 0 && !(a > 0 && b < 0 && -b < 2 * a * span)) return {false, 0, true};
        const Real disc = b * b - 4 * a * c;
        if (disc < 0) return end > 0 ? CellHit<Real>{false, 0, true} : CellHit<Real>{true, tb, false};
        // c > 0: the wanted root is 2c / (-b + sqrt(disc)) for either sign of a.
        const Real root = std::sqrt(disc);
        const Real s = b <= 0 ? 2 * c / (-b + root) : -(b + root) / (2 * a);
        return {true, ta + std::clamp(s, Real(0), span), false};
    }
};

/// Values at the corners of the cell [0, 1]^3, x fastest.
template <class Real>
struct TrilinearCell {
    Real value[8];

    /// -1: solid throughout, 1: empty throughout, 0: the surface may pass.
    [[nodiscard]] int side() const {
        int inside = 0;
        for (const Real v : value) inside += v <= 0;
        return inside == 0 ? 1 : inside == 8 ? -1 : 0;
    }

    /// `o` and `d` are in cell units from the cell's lower corner.
    CellHit<Real> firstEntry(glm::vec<3, Real> o, glm::vec<3, Real> d, Real ta, Real tb, bool outside) const {
        const Real* v = value;
        const Real k = v[0], kx = v[1] - k, ky = v[2] - k, kz = v[4] - k;
        const Real kxy = v[3] - v[1] - v[2] + k, kyz = v[6] - v[2] - v[4] + k, kzx = v[5] - v[1] - v[4] + k;
        const Real kxyz = v[7] - v[3] - v[5] - v[6] + v[1] + v[2] + v[4] - k;
        const Real x = o.x + ta * d.x, y = o.y + ta * d.y, z = o.z + ta * d.z, span = tb - ta;
        const Real dx = d.x * span, dy = d.y * span, dz = d.z * span;
        const Real c0 = k + kx * x + ky * y + kz * z + kxy * x * y + kyz * y * z + kzx * z * x + kxyz * x * y * z;
        const Real c1 = dx * (kx + kxy * y + kzx * z + kxyz * y * z) + dy * (ky + kxy * x + kyz * z + kxyz * z * x) +
                        dz * (kz + kyz * y + kzx * x + kxyz * x * y);
        const Real c2 =
            kxy * dx * dy + kyz * dy * dz + kzx * dz * dx + kxyz * (dx * dy * z + dy * dz * x + dz * dx * y);
        CellHit<Real> found = firstFall(c0, c1, c2, kxyz * dx * dy * dz, outside);
        if (found.hit) found.t = ta + found.t * span;
        return found;
    }

    [[nodiscard]] glm::vec<3, Real> gradient(glm::vec<3, Real> p) const {
        const Real* v = value;
        const auto mix = [](Real a, Real b, Real w) { return a + w * (b - a); };
        return {mix(mix(v[1] - v[0], v[3] - v[2], p.y), mix(v[5] - v[4], v[7] - v[6], p.y), p.z),
                mix(mix(v[2] - v[0], v[3] - v[1], p.x), mix(v[6] - v[4], v[7] - v[5], p.x), p.z),
                mix(mix(v[4] - v[0], v[5] - v[1], p.x), mix(v[6] - v[2], v[7] - v[3], p.x), p.y)};
    }
};

}  // namespace vcp::meso
