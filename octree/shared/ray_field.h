// The surface of a soft leaf along a ray, as a polynomial: part of leaf_math.h. It is written in operators alone,
// without comparisons, so that it also compiles for the rays of several lanes at once (render/host/lanes-inl.h).

// Bilinear weights of a face's corners.
INLINE Real4 faceWeights(Real y, Real z) {
    Real4 wy = Real4(Real(1.0) - y, y, Real(1.0) - y, y);
    Real4 wz = Real4(Real(1.0) - z, Real(1.0) - z, z, z);
    return wy * wz;
}

// f on the segment p + u d, u in [0, 1]: sum c_k u^k + fourth u^4. `last`, its value at the end, is taken from the
// corners, so that two leaves agree on it at the wall between them.
struct RayField {
    Real4 c;
    Real fourth, last;
};

// Returns (1 - x - u dx) a(u) + (x + u dx) b(u) for polynomials a and b, lowest power first.
INLINE Real3 blendLines(Real2 a, Real2 b, Real x, Real dx) {
    Real2 e = b - a;
    return Real3((Real(1.0) - x) * a.x + x * b.x, a.y + x * e.y + dx * e.x, dx * e.y);
}
INLINE Real4 blendParabolas(Real3 a, Real3 b, Real x, Real dx) {
    Real3 e = b - a;
    return Real4((Real(1.0) - x) * a.x + x * b.x, a.y + x * e.y + dx * e.x, a.z + x * e.z + dx * e.y, dx * e.z);
}

// Blends the corners' planes on the segment, faces as in LeafField; r and s: its start and extent, rotated to the axis.
INLINE RayField blendOnRay(Real4 value0, Real4 slope0, Real4 value1, Real4 slope1, Real3 r, Real3 s) {
    Real3 low0 = blendLines(Real2(value0.x, slope0.x), Real2(value0.y, slope0.y), r.y, s.y);
    Real3 low1 = blendLines(Real2(value0.z, slope0.z), Real2(value0.w, slope0.w), r.y, s.y);
    Real3 high0 = blendLines(Real2(value1.x, slope1.x), Real2(value1.y, slope1.y), r.y, s.y);
    Real3 high1 = blendLines(Real2(value1.z, slope1.z), Real2(value1.w, slope1.w), r.y, s.y);
    Real4 low = blendParabolas(low0, low1, r.z, s.z), high = blendParabolas(high0, high1, r.z, s.z);
    Real4 e = high - low;
    RayField ray;
    ray.c = Real4((Real(1.0) - r.x) * low.x + r.x * high.x, low.y + r.x * e.y + s.x * e.x,
                  low.z + r.x * e.z + s.x * e.y, low.w + r.x * e.w + s.x * e.z);
    ray.fourth = s.x * e.w;
    Real3 t = r + s;
    Real4 w = faceWeights(t.y, t.z);
    ray.last = dot(w, value0 + slope0) * (Real(1.0) - t.x) + dot(w, value1 + slope1) * t.x;
    return ray;
}

INLINE Real rayValue(RayField ray, Real u) {
    return ray.c.x + u * (ray.c.y + u * (ray.c.z + u * (ray.c.w + u * ray.fourth)));
}
