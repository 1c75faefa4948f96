// Rays of a picture through the shell of one surface (mesostructure/shell.h), and shadow rays from what all surfaces left.
// Reads and writes the hits: depth, normal, colour and light, iterations. A surface replaces what is farther.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"
#include "render/shaders/meso_march.glsl"

layout(constant_id = 4) const uint kShadow = 0u;  // 1: from the hits towards the light
layout(local_size_x = 8, local_size_y = 8) in;

uint fetchHit(uint i) { return hits[i]; }
#include "render/shaders/hit_records.glsl"

const float kNoHit = 1e30;
// Pieces are met a little wider than they are, in weights of their corners, so that no rounding opens a gap between two; what is
// met twice is the same surface. Ten times what single precision loses over a picture.
const float kPieceSlack = 2e-5;
const uint kBaseFace = 16u;  // Shell::kBase

struct ShellHit {
    float t;        // along the ray; kNoHit
    vec3 normal;    // not unit
    uint iterations;
    bool unresolved;
};

// A normal where the method gives none: of the nearest data, or of the voxel's face.
vec3 fallbackNormal(vec3 p, vec3 d) {
    if (kWalk == kMesoRelief) {
        vec2 at = p.xy * float(meso.fine.x), i = floor(at), w = at - i;
        vec4 h = heightsAt(int(i.x), int(i.y)) * meso.scale.x;
        return vec3(-vec2(mix(h.y - h.x, h.w - h.z, w.y), mix(h.z - h.x, h.w - h.y, w.x)) * float(meso.fine.x), 1.0);
    }
    if (kWalk == kMesoSphere) {
        vec4 v0, v1;
        vec3 w;
        sphereCorners(p, v0, v1, w);
        return gradientTrilinear(v0, v1, w) / meso.cell.xyz;
    }
    // The wall that the point is nearest to, of those that the ray may enter by.
    vec3 at = p * vec3(meso.cells.xyz) / meso.extent.xyz, off = abs(at - round(at));
    off = mix(off, vec3(1.0), equal(d, vec3(0.0)));
    float least = min(off.x, min(off.y, off.z));
    return off.x == least ? vec3(-sign(d.x), 0.0, 0.0) : off.y == least ? vec3(0.0, -sign(d.y), 0.0) : vec3(0.0, 0.0, -sign(d.z));
}

// `o` is on the ray at `start`.
void castPiece(uint piece, vec3 o, vec3 d, float start, inout ShellHit best) {
    int at = int(2u * view.picture.z + 7u * piece);
    vec4 corner = texelFetch(inputTexels, at);
    vec4 r0 = texelFetch(inputTexels, at + 1), r1 = texelFetch(inputTexels, at + 2), r2 = texelFetch(inputTexels, at + 3);
    vec3 p = o - corner.xyz;
    vec4 a, b;
    a.yzw = vec3(dot(r0.xyz, p), dot(r1.xyz, p), dot(r2.xyz, p));
    b.yzw = vec3(dot(r0.xyz, d), dot(r1.xyz, d), dot(r2.xyz, d));
    a.x = 1.0 - a.y - a.z - a.w;
    b.x = -b.y - b.z - b.w;
    a += kPieceSlack;
    // From the eye on: the piece may reach out of the box whose wall `o` is on.
    float enter = -start, leave = best.t - start;
    uint bits = uint(corner.w);
    int entered = -1;
    bool toBase = false;
    for (int i = 0; i < 4; i++) {
        float time = -a[i] / b[i];
        if (b[i] > 0.0 && time > enter) {
            entered = i;
            enter = time;
        } else if (b[i] < 0.0 && time < leave) {
            toBase = i == 3 && (bits & kBaseFace) != 0u;
            leave = time;
        } else if (b[i] == 0.0 && a[i] < 0.0) return;
    }
    if (!(enter <= leave)) return;
    bool fromBase = entered == 3 && (bits & kBaseFace) != 0u, fromCut = entered >= 0 && (bits & (1u << uint(entered))) != 0u;
    // The weight of the corner above, whose row of R this is, grows away from the base.
    if (fromBase && view.picture.w != 0u) {
        best.t = start + enter;
        best.normal = -r2.xyz;
        return;
    }
    vec3 t0 = texelFetch(inputTexels, at + 4).xyz, t1 = texelFetch(inputTexels, at + 5).xyz, t2 = texelFetch(inputTexels, at + 6).xyz;
    vec3 q = p + enter * d, direction = vec3(dot(t0, d), dot(t1, d), dot(t2, d));
    float scale = length(direction);
    if (scale > 1e-12) {
        MesoRay ray;
        ray.o = vec3(r0.w + dot(t0, q), r1.w + dot(t1, q), clamp(r2.w + dot(t2, q), 0.0, meso.extent.z));
        ray.o.xy -= meso.extent.xy * floor(ray.o.xy / meso.extent.xy);
        ray.d = direction / scale;
        ray.tMax = (leave - enter) * scale;
        ray.atTop = false;
        // A ray that comes from another piece was outside there, or had its hit there.
        ray.isOutside = entered >= 0;
        vec3 cut = entered == 0 ? r0.xyz + r1.xyz + r2.xyz : entered == 1 ? -r0.xyz : entered == 2 ? -r1.xyz : -r2.xyz;
        if (fromCut && isSolidAt(ray.o)) {
            best.t = start + enter;
            best.normal = cut;
            return;
        }
        MesoResult found = marchMeso(ray);
        best.iterations += found.iterations;
        best.unresolved = best.unresolved || found.state == kMesoUnresolved;
        float t = start + enter + found.t / scale;
        if (found.state == kMesoHit && t < best.t) {
            best.t = t;
            vec3 n = found.normal != vec3(0.0) ? found.normal : fallbackNormal(ray.o + found.t * ray.d, ray.d);
            // On a ridge, where rounding may choose the side that is turned away.
            if (ray.d.z < 0.0 && dot(n, ray.d) > 0.1 * length(n)) n = vec3(0.0, 0.0, 1.0);
            best.normal = t0 * n.x + t1 * n.y + t2 * n.z;
            if (fromCut && found.t == 0.0) best.normal = cut;
            return;
        }
    }
    if (toBase && view.picture.w != 0u) {
        best.t = start + leave;
        best.normal = r2.xyz;
    }
}

float boxEntry(uint node, vec3 o, vec3 inverse, float leave, out vec4 low, out vec4 high) {
    low = texelFetch(inputTexels, int(2u * node));
    high = texelFetch(inputTexels, int(2u * node + 1u));
    vec3 a = (low.xyz - o) * inverse, b = (high.xyz - o) * inverse, near = min(a, b), far = max(a, b);
    float first = max(0.0, max(near.x, max(near.y, near.z))), last = min(leave, min(far.x, min(far.y, far.z)));
    return first <= last ? first : kNoHit;
}

ShellHit castShell(vec3 eye, vec3 d, float tMax) {
    ShellHit best = ShellHit(tMax, vec3(0.0), 0u, false);
    vec3 inverse = 1.0 / mix(d, vec3(1e-18), lessThan(abs(d), vec3(1e-18)));
    vec4 low, high;
    float start = boxEntry(0u, eye, inverse, tMax, low, high);
    if (start >= kNoHit) return best;
    // From the shell's box on, where numbers are small.
    vec3 o = eye + start * d;
    uint stack[32];
    int depth = 0;
    uint node = 0u;
    while (true) {
        if (boxEntry(node, o, inverse, best.t - start, low, high) < kNoHit) {
            if (high.w > 0.0) {
                for (uint i = 0u; i < uint(high.w); i++) castPiece(uint(low.w) + i, o, d, start, best);
                if (kShadow != 0u && best.t < tMax) return best;
            } else {
                uint child = uint(low.w);
                vec4 l0, h0, l1, h1;
                float e0 = boxEntry(child, o, inverse, best.t - start, l0, h0), e1 = boxEntry(child + 1u, o, inverse, best.t - start, l1, h1);
                bool swapped = e1 < e0;
                if (max(e0, e1) < kNoHit) stack[depth++] = swapped ? child : child + 1u;
                if (min(e0, e1) < kNoHit) {
                    node = swapped ? child + 1u : child;
                    continue;
                }
            }
        }
        if (depth == 0) break;
        node = stack[--depth];
    }
    return best;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, view.picture.xy))) return;
    vec2 at = vec2(pixel) + 0.5;
    uint index = pixel.y * view.picture.x + pixel.x, plane = view.picture.x * view.picture.y;
    vec3 eye = view.eye.xyz + at.x * view.eyeX.xyz + at.y * view.eyeY.xyz;
    vec3 d = normalize(view.forward.xyz + at.x * view.forwardX.xyz + at.y * view.forwardY.xyz);
    float depth = uintBitsToFloat(hits[index]);
    if (kShadow != 0u) {
        uint colour = hits[2u * plane + index];
        // Only what is mesostructure, and not yet in the dark.
        if (hits[plane + index] == 0u || colour >> 24 == 0u) return;
        vec3 n = unpackHitNormal(hits[plane + index]);
        if (dot(n, view.light.xyz) <= 0.0) return;
        vec3 from = eye + depth * d + view.light.w * n;
        ShellHit hit = castShell(from, view.light.xyz, kNoHit);
        if (hit.t < kNoHit) hits[2u * plane + index] = colour & 0xffffffu;
        return;
    }
    ShellHit hit = castShell(eye, d, depth);
    hits[3u * plane + index] += hit.iterations;
    if (hit.unresolved) atomicAdd(counters[0], 1u);
    if (!(hit.t < depth)) return;
    vec3 n = normalize(hit.normal);
    if (dot(n, d) > 0.0) n -= dot(n, d) * d;
    hits[index] = floatBitsToUint(hit.t);
    // 0 says that a pixel has no mesostructure.
    hits[plane + index] = max(packHitNormal(normalize(n)), 1u);
    hits[2u * plane + index] = packUnorm4x8(vec4(view.colour.xyz, 1.0));
}
