// Finds where a ray first enters the solid inside one cell; the GLSL of mesostructure/cell_solve.h and of crossPatch
// (mesostructure/patches.cpp).

struct CellHit {
    bool hit;
    float t;       // time of the entry
    bool outside;  // side at the end of the interval, when there was no hit
};

CellHit firstFall(float c0, float c1, float c2, float c3, bool outside) {
    if (c0 > 0.0) outside = true;
    else if (outside) return CellHit(true, 0.0, false);
    float r0 = 1.0, r1 = 1.0, a = 3.0 * c3, b = 2.0 * c2, disc = b * b - 4.0 * a * c1;
    if (disc > 0.0) {
        float q = -0.5 * (b + (b >= 0.0 ? sqrt(disc) : -sqrt(disc)));
        float ra = a != 0.0 ? q / a : 1.0, rb = q != 0.0 ? c1 / q : 1.0;
        r0 = clamp(min(ra, rb), 0.0, 1.0);
        r1 = clamp(max(ra, rb), 0.0, 1.0);
    }
    float f0 = ((c3 * r0 + c2) * r0 + c1) * r0 + c0, f1 = ((c3 * r1 + c2) * r1 + c1) * r1 + c0, f2 = ((c3 + c2) + c1) + c0;
    bool inFirst = outside && f0 <= 0.0, inSecond = f0 > 0.0 && f1 <= 0.0;
    if (!inFirst && !inSecond && !(f1 > 0.0 && f2 <= 0.0)) return CellHit(false, 0.0, f2 > 0.0);
    float low = inFirst ? 0.0 : inSecond ? r0 : r1, high = inFirst ? r0 : inSecond ? r1 : 1.0;
    float fLow = inFirst ? c0 : inSecond ? f0 : f1, fHigh = inFirst ? f0 : inSecond ? f1 : f2;
    float u = low + (high - low) * (fLow / (fLow - fHigh));
    for (int k = 0; k < 24; k++) {
        if (!(u > low && u < high)) u = 0.5 * (low + high);
        float value = ((c3 * u + c2) * u + c1) * u + c0;
        if (value > 0.0) low = u;
        else high = u;
        float step = value / ((3.0 * c3 * u + 2.0 * c2) * u + c1);
        if (abs(step) <= 2.4e-7 * u) break;
        u -= step;
    }
    return CellHit(true, u >= low && u <= high ? u : high, false);
}

// h: heights at the corners (0,0), (1,0), (0,1), (1,1). Between ta <= tb.
CellHit firstEntryBilinear(vec4 h, vec3 o, vec3 d, float ta, float tb, bool outside) {
    float hx = h.y - h.x, hy = h.z - h.x, hxy = h.w - h.y - h.z + h.x;
    vec3 p = o + ta * d;
    float span = tb - ta;
    float c = p.z - (h.x + hx * p.x + hy * p.y + hxy * p.x * p.y);
    if (c > 0.0) outside = true;
    else if (outside) return CellHit(true, ta, false);
    float b = d.z - hx * d.x - hy * d.y - hxy * (p.x * d.y + p.y * d.x), a = -hxy * d.x * d.y;
    float end = (a * span + b) * span + c;
    if (!outside) return CellHit(false, 0.0, end > 0.0);
    if (end > 0.0 && !(a > 0.0 && b < 0.0 && -b < 2.0 * a * span)) return CellHit(false, 0.0, true);
    float disc = b * b - 4.0 * a * c;
    if (disc < 0.0) return end > 0.0 ? CellHit(false, 0.0, true) : CellHit(true, tb, false);
    float root = sqrt(disc);
    float s = b <= 0.0 ? 2.0 * c / (-b + root) : -(b + root) / (2.0 * a);
    return CellHit(true, ta + clamp(s, 0.0, span), false);
}

// v0, v1: values at the corners, x fastest, below and above.
CellHit firstEntryTrilinear(vec4 v0, vec4 v1, vec3 o, vec3 d, float ta, float tb, bool outside) {
    float k = v0.x, kx = v0.y - k, ky = v0.z - k, kz = v1.x - k;
    float kxy = v0.w - v0.y - v0.z + k, kyz = v1.z - v0.z - v1.x + k, kzx = v1.y - v0.y - v1.x + k;
    float kxyz = v1.w - v0.w - v1.y - v1.z + v0.y + v0.z + v1.x - k;
    vec3 p = o + ta * d, e = d * (tb - ta);
    float c0 = k + kx * p.x + ky * p.y + kz * p.z + kxy * p.x * p.y + kyz * p.y * p.z + kzx * p.z * p.x + kxyz * p.x * p.y * p.z;
    float c1 = e.x * (kx + kxy * p.y + kzx * p.z + kxyz * p.y * p.z) + e.y * (ky + kxy * p.x + kyz * p.z + kxyz * p.z * p.x) +
               e.z * (kz + kyz * p.y + kzx * p.x + kxyz * p.x * p.y);
    float c2 = kxy * e.x * e.y + kyz * e.y * e.z + kzx * e.z * e.x + kxyz * (e.x * e.y * p.z + e.y * e.z * p.x + e.z * e.x * p.y);
    CellHit found = firstFall(c0, c1, c2, kxyz * e.x * e.y * e.z, outside);
    if (found.hit) found.t = ta + found.t * (tb - ta);
    return found;
}

vec3 gradientTrilinear(vec4 v0, vec4 v1, vec3 p) {
    vec4 z = mix(v0, v1, p.z), up = v1 - v0;
    vec2 y = mix(up.xy, up.zw, p.y);
    return vec3(mix(z.y - z.x, z.w - z.z, p.y), mix(z.z - z.x, z.w - z.y, p.x), mix(y.x, y.y, p.x));
}

struct Patch {
    vec4 abcd, efgh, u, v;
    vec2 ij;
    bool isTriangle;
};

Patch fetchPatch(uint i) {
    uint at = meso.at.w + 5u * i;
    vec4 q0 = uintBitsToFloat(fetchQuad(at)), q1 = uintBitsToFloat(fetchQuad(at + 1u)), q2 = uintBitsToFloat(fetchQuad(at + 2u)), q3 = uintBitsToFloat(fetchQuad(at + 3u));
    uvec4 q4 = fetchQuad(at + 4u);
    return Patch(q0, q1, vec4(q2.zw, q3.xy), vec4(q3.zw, uintBitsToFloat(q4.xy)), q2.xy, q4.z != 0u);
}

const float kOnPatch = 2e-4;

// Returns the crossing; below 0: there is none.
float crossPatch(Patch q, vec3 o, vec3 d, float span) {
    float a = q.abcd.x * d.x * d.x + q.abcd.y * d.y * d.y + q.abcd.z * d.z * d.z + q.abcd.w * d.x * d.y + q.efgh.x * d.y * d.z + q.efgh.y * d.z * d.x;
    float b = 2.0 * (q.abcd.x * o.x * d.x + q.abcd.y * o.y * d.y + q.abcd.z * o.z * d.z) + q.abcd.w * (o.x * d.y + o.y * d.x) +
              q.efgh.x * (o.y * d.z + o.z * d.y) + q.efgh.y * (o.z * d.x + o.x * d.z) + q.efgh.z * d.x + q.efgh.w * d.y + q.ij.x * d.z;
    float c = q.abcd.x * o.x * o.x + q.abcd.y * o.y * o.y + q.abcd.z * o.z * o.z + q.abcd.w * o.x * o.y + q.efgh.x * o.y * o.z + q.efgh.y * o.z * o.x +
              q.efgh.z * o.x + q.efgh.w * o.y + q.ij.x * o.z + q.ij.y;
    float disc = b * b - 4.0 * a * c;
    if (disc < 0.0) return -1.0;
    float r = -0.5 * (b + (b >= 0.0 ? sqrt(disc) : -sqrt(disc)));
    float ra = a != 0.0 ? r / a : -1e30, rb = r != 0.0 ? c / r : -1e30;
    float slack = kOnPatch / max(abs(d.x), max(abs(d.y), abs(d.z)));
    for (int i = 0; i < 2; i++) {
        float s = i == 0 ? min(ra, rb) : max(ra, rb);
        if (!(s >= -slack && s <= span + slack)) continue;
        vec4 p = vec4(o + s * d, 1.0);
        float u = dot(q.u, p), v = dot(q.v, p);
        if (u < -kOnPatch || v < -kOnPatch) continue;
        if (q.isTriangle ? u + v <= 1.0 + kOnPatch : u <= 1.0 + kOnPatch && v <= 1.0 + kOnPatch) return clamp(s, 0.0, span);
    }
    return -1.0;
}

vec3 patchGradient(Patch q, vec3 p) {
    return vec3(2.0 * q.abcd.x * p.x + q.abcd.w * p.y + q.efgh.y * p.z + q.efgh.z, 2.0 * q.abcd.y * p.y + q.abcd.w * p.x + q.efgh.x * p.z + q.efgh.w,
                2.0 * q.abcd.z * p.z + q.efgh.x * p.y + q.efgh.y * p.x + q.ij.x);
}
