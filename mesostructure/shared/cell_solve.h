// Finds where a ray first enters the solid inside one cell: closed forms for the bilinear height field and, one
// monotone piece after the other, for the trilinear field. The function f along the ray is above 0 outside the solid.
// Compiles as GLSL (Real = float) and as C++ in float and double (mesostructure/march_math.h). Only the common subset
// of GLSL and GLM is used: no swizzles, no constructors of structs.
//
// The side travels with the ray: `outside` says on which side it came to the cell. A ray that was outside and finds f
// <= 0 at the wall enters there, so nothing slips between cells whose values round differently.
// (DESIGN: no epsilon; Hansson-Soderlund et al. 2022 and Marmitt et al. 2004 for splitting the cubic.)

struct CellHit {
    bool hit;
    Real t;        // time of the entry
    bool outside;  // side at the end of the interval, when there was no hit
};

INLINE CellHit entryAt(Real t) {
    CellHit found;
    found.hit = true;
    found.t = t;
    found.outside = false;
    return found;
}

INLINE CellHit noEntry(bool outside) {
    CellHit found;
    found.hit = false;
    found.t = Real(0.0);
    found.outside = outside;
    return found;
}

INLINE Real cubicAt(Real c0, Real c1, Real c2, Real c3, Real u) { return ((c3 * u + c2) * u + c1) * u + c0; }

// Returns the root of a cubic between `low`, where its value fLow is above 0, and `high`, where fHigh is not. A step is
// Newton's, or a bisection where that leaves the bracket.
INLINE Real rootBetween(Real c0, Real c1, Real c2, Real c3, Real low, Real high, Real fLow, Real fHigh) {
    Real u = low + (high - low) * (fLow / (fLow - fHigh));
    for (int k = 0; k < 24; ++k) {
        if (!(u > low && u < high)) u = Real(0.5) * (low + high);
        Real value = cubicAt(c0, c1, c2, c3, u);
        if (value > Real(0.0))
            low = u;
        else
            high = u;
        Real step = value / ((Real(3.0) * c3 * u + Real(2.0) * c2) * u + c1);
        if (abs(step) <= Real(2.0 * REAL_EPSILON) * u) break;
        u -= step;
    }
    return u >= low && u <= high ? u : high;
}

// Returns the first u in [0, 1] where a cubic c0 + c1 u + c2 u^2 + c3 u^3 falls to 0 from above.
INLINE CellHit firstFall(Real c0, Real c1, Real c2, Real c3, bool outside) {
    if (c0 > Real(0.0))
        outside = true;
    else if (outside)
        return entryAt(Real(0.0));
    // The cubic is monotone between 0, the roots of the derivative in [0, 1], and 1.
    Real r0 = Real(1.0), r1 = Real(1.0), a = Real(3.0) * c3, b = Real(2.0) * c2, disc = b * b - Real(4.0) * a * c1;
    if (disc > Real(0.0)) {
        Real q = Real(-0.5) * (b + (b >= Real(0.0) ? sqrt(disc) : -sqrt(disc)));
        Real ra = a != Real(0.0) ? q / a : Real(1.0), rb = q != Real(0.0) ? c1 / q : Real(1.0);
        r0 = clamp(min(ra, rb), Real(0.0), Real(1.0));
        r1 = clamp(max(ra, rb), Real(0.0), Real(1.0));
    }
    Real f0 = cubicAt(c0, c1, c2, c3, r0), f1 = cubicAt(c0, c1, c2, c3, r1), f2 = cubicAt(c0, c1, c2, c3, Real(1.0));
    bool inFirst = outside && f0 <= Real(0.0), inSecond = f0 > Real(0.0) && f1 <= Real(0.0);
    if (!inFirst && !inSecond && !(f1 > Real(0.0) && f2 <= Real(0.0))) return noEntry(f2 > Real(0.0));
    Real low = inFirst ? Real(0.0) : inSecond ? r0 : r1, high = inFirst ? r0 : inSecond ? r1 : Real(1.0);
    Real fLow = inFirst ? c0 : inSecond ? f0 : f1, fHigh = inFirst ? f0 : inSecond ? f1 : f2;
    return entryAt(rootBetween(c0, c1, c2, c3, low, high, fLow, fHigh));
}

// Enters a height field between ta <= tb. `h`: its heights at the corners (0, 0), (1, 0), (0, 1), (1, 1) of the cell
// [0, 1]^2, z in any unit; f = z - height. `o` and `d` are in cell units along x and y, from the cell's lower corner.
INLINE CellHit firstEntryBilinear(Real4 h, Real3 o, Real3 d, Real ta, Real tb, bool outside) {
    Real hx = h.y - h.x, hy = h.z - h.x, hxy = h.w - h.y - h.z + h.x;
    Real3 p = o + ta * d;
    Real span = tb - ta;
    Real c = p.z - (h.x + hx * p.x + hy * p.y + hxy * p.x * p.y);
    if (c > Real(0.0))
        outside = true;
    else if (outside)
        return entryAt(ta);
    Real b = d.z - hx * d.x - hy * d.y - hxy * (p.x * d.y + p.y * d.x), a = -hxy * d.x * d.y;
    Real end = (a * span + b) * span + c;
    if (!outside) return noEntry(end > Real(0.0));
    // The first root, computed without cancellation; there is none behind the interval's end unless the parabola opens
    // upwards.
    if (end > Real(0.0) && !(a > Real(0.0) && b < Real(0.0) && -b < Real(2.0) * a * span)) return noEntry(true);
    Real disc = b * b - Real(4.0) * a * c;
    if (disc < Real(0.0)) {
        if (end > Real(0.0)) return noEntry(true);
        return entryAt(tb);
    }
    // c > 0: the wanted root is 2c / (-b + sqrt(disc)) for either sign of a.
    Real root = sqrt(disc);
    Real s = b <= Real(0.0) ? Real(2.0) * c / (-b + root) : -(b + root) / (Real(2.0) * a);
    return entryAt(ta + clamp(s, Real(0.0), span));
}

// Returns how much the heights grow along x and y, over the cell's edges.
INLINE Real2 slopeBilinear(Real4 h, Real3 p) {
    return Real2(mix(h.y - h.x, h.w - h.z, p.y), mix(h.z - h.x, h.w - h.y, p.x));
}

// Returns -1 where a trilinear cell is solid throughout, 1 where it is empty throughout, and 0 where the surface may
// pass. v0, v1: values at the corners, x fastest, below and above.
INLINE int sideTrilinear(Real4 v0, Real4 v1) {
    Real4 low = min(v0, v1), high = max(v0, v1);
    Real least = min(min(low.x, low.y), min(low.z, low.w)), most = max(max(high.x, high.y), max(high.z, high.w));
    return least > Real(0.0) ? 1 : most <= Real(0.0) ? -1 : 0;
}

// Enters a trilinear field between ta <= tb. `o` and `d` are in cell units from the cell's lower corner.
INLINE CellHit firstEntryTrilinear(Real4 v0, Real4 v1, Real3 o, Real3 d, Real ta, Real tb, bool outside) {
    Real k = v0.x, kx = v0.y - k, ky = v0.z - k, kz = v1.x - k;
    Real kxy = v0.w - v0.y - v0.z + k, kyz = v1.z - v0.z - v1.x + k, kzx = v1.y - v0.y - v1.x + k;
    Real kxyz = v1.w - v0.w - v1.y - v1.z + v0.y + v0.z + v1.x - k;
    Real3 p = o + ta * d, e = d * (tb - ta);
    Real c0 = k + kx * p.x + ky * p.y + kz * p.z + kxy * p.x * p.y + kyz * p.y * p.z + kzx * p.z * p.x +
              kxyz * p.x * p.y * p.z;
    Real c1 = e.x * (kx + kxy * p.y + kzx * p.z + kxyz * p.y * p.z) +
              e.y * (ky + kxy * p.x + kyz * p.z + kxyz * p.z * p.x) +
              e.z * (kz + kyz * p.y + kzx * p.x + kxyz * p.x * p.y);
    Real c2 = kxy * e.x * e.y + kyz * e.y * e.z + kzx * e.z * e.x +
              kxyz * (e.x * e.y * p.z + e.y * e.z * p.x + e.z * e.x * p.y);
    CellHit found = firstFall(c0, c1, c2, kxyz * e.x * e.y * e.z, outside);
    if (found.hit) found.t = ta + found.t * (tb - ta);
    return found;
}

INLINE Real3 gradientTrilinear(Real4 v0, Real4 v1, Real3 p) {
    Real4 z = mix(v0, v1, p.z), up = v1 - v0;
    Real2 y = mix(Real2(up.x, up.y), Real2(up.z, up.w), p.y);
    return Real3(mix(z.y - z.x, z.w - z.z, p.y), mix(z.z - z.x, z.w - z.y, p.x), mix(y.x, y.y, p.x));
}
