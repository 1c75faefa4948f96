// Where a ray crosses a patch (mesostructure/patches.h says how they come about). Compiles as GLSL and as C++.

// A point x of the cell lies on the patch when quadric(x) = 0, u(x) >= 0, v(x) >= 0, and u + v <= 1 for a triangle or
// u <= 1 and v <= 1 for a bilinear patch. In arrays and files:
//
//    0   10 floats   A..J: A x^2 + B y^2 + C z^2 + D xy + E yz + F zx + G x + H y + I z + J
//   40    4 floats   u: of x, y, z and 1
//   56    4 floats   v
//   72    1 word     1: a triangle (A..F are 0), 0: bilinear
struct Patch {
    float quadric[10];
    vec4 u;
    vec4 v;
    uint isTriangle;
};

// Patches meet at their borders: each is so much wider, in its parameters, that a ray between two finds one of them.
const float kOnPatch = 2e-4f;

// Returns the crossing of a ray with a patch at 0 <= s <= span, `o` and `d` in the cell's coordinates; below 0: none.
INLINE float crossPatch(CONST_REF(Patch) it, vec3 o, vec3 d, float span) {
    float a = it.quadric[0] * d.x * d.x + it.quadric[1] * d.y * d.y + it.quadric[2] * d.z * d.z +
              it.quadric[3] * d.x * d.y + it.quadric[4] * d.y * d.z + it.quadric[5] * d.z * d.x;
    float b = 2.0f * (it.quadric[0] * o.x * d.x + it.quadric[1] * o.y * d.y + it.quadric[2] * o.z * d.z) +
              it.quadric[3] * (o.x * d.y + o.y * d.x) + it.quadric[4] * (o.y * d.z + o.z * d.y) +
              it.quadric[5] * (o.z * d.x + o.x * d.z) + it.quadric[6] * d.x + it.quadric[7] * d.y + it.quadric[8] * d.z;
    float c = it.quadric[0] * o.x * o.x + it.quadric[1] * o.y * o.y + it.quadric[2] * o.z * o.z +
              it.quadric[3] * o.x * o.y + it.quadric[4] * o.y * o.z + it.quadric[5] * o.z * o.x + it.quadric[6] * o.x +
              it.quadric[7] * o.y + it.quadric[8] * o.z + it.quadric[9];
    float disc = b * b - 4.0f * a * c;
    if (disc < 0.0f) return -1.0f;
    // Computed without cancellation; for a = 0, the linear branch, the second root is that of the plane.
    float r = -0.5f * (b + (b >= 0.0f ? sqrt(disc) : -sqrt(disc)));
    float ra = a != 0.0f ? r / a : -1e30f, rb = r != 0.0f ? c / r : -1e30f;
    float slack = kOnPatch / max(abs(d.x), max(abs(d.y), abs(d.z)));
    for (int i = 0; i < 2; ++i) {
        float s = i == 0 ? min(ra, rb) : max(ra, rb);
        if (!(s >= -slack && s <= span + slack)) continue;
        vec4 p = vec4(o + s * d, 1.0f);
        float u = dot(it.u, p), v = dot(it.v, p);
        if (u < -kOnPatch || v < -kOnPatch) continue;
        bool within = it.isTriangle != 0u ? u + v <= 1.0f + kOnPatch : u <= 1.0f + kOnPatch && v <= 1.0f + kOnPatch;
        if (within) return clamp(s, 0.0f, span);
    }
    return -1.0f;
}

// Returns a direction of octahedral coordinates (meso::PatchNormals), not of unit length.
INLINE vec3 unfoldNormal(uint code) {
    float x = float(int(code << 16) >> 16) / 32767.0f, y = float(int(code) >> 16) / 32767.0f;
    float z = 1.0f - abs(x) - abs(y), fold = max(-z, 0.0f);
    return vec3(x >= 0.0f ? x - fold : x + fold, y >= 0.0f ? y - fold : y + fold, z);
}

// Returns the blend of a patch's normals at its u and v; `own` where they leave none.
INLINE vec3 blendNormals(uvec4 codes, vec2 at, bool isTriangle, vec3 own) {
    vec2 w = clamp(at, 0.0f, 1.0f);
    vec3 sum = isTriangle ? vec3(0.0f) : w.x * w.y * normalize(unfoldNormal(codes.z));
    float away = isTriangle ? max(1.0f - w.x - w.y, 0.0f) : (1.0f - w.x) * (1.0f - w.y);
    float right = isTriangle ? w.x : w.x * (1.0f - w.y), up = isTriangle ? w.y : w.y * (1.0f - w.x);
    sum += away * normalize(unfoldNormal(codes.x)) + right * normalize(unfoldNormal(codes.y)) +
           up * normalize(unfoldNormal(codes.w));
    return dot(sum, sum) > 1e-6f ? sum : own;
}

INLINE vec3 patchGradient(CONST_REF(Patch) it, vec3 p) {
    return vec3(2.0f * it.quadric[0] * p.x + it.quadric[3] * p.y + it.quadric[5] * p.z + it.quadric[6],
                2.0f * it.quadric[1] * p.y + it.quadric[3] * p.x + it.quadric[4] * p.z + it.quadric[7],
                2.0f * it.quadric[2] * p.z + it.quadric[4] * p.y + it.quadric[5] * p.x + it.quadric[8]);
}
