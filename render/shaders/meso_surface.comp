// Casts a picture's rays through the shell of one surface (mesostructure/shell.h), and shadow rays from the hits on all
// surfaces.
// Reads and writes the hits: depth, normal, colour and light, iterations. A surface replaces what is farther.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"
#include "render/shaders/meso_march.glsl"

layout(constant_id = 4) const uint kShadow = 0u;    // 1: from the hits towards the light
layout(constant_id = 5) const uint kTextures = 0u;  // kMesoColours, kMesoNormals
layout(constant_id = 6) const uint kFromFar = 0u;  // 1: slabs that are less high than a part of a pixel are not marched
layout(local_size_x = 8, local_size_y = 8) in;

uint fetchHit(uint i) { return hits[i]; }
#include "render/shaders/hit_records.glsl"
#include "render/shaders/meso_texture.glsl"
#include "render/shaders/meso_far.glsl"

// Pieces are met a little wider than they are, in weights of their corners, so that no rounding opens a gap between
// two; what is met twice is the same surface. By at least kPieceSlack, ten times what single precision loses over a
// picture of some thousand pieces, and by kRounding of the products that a weight is the sum of: small pieces far from
// the origin lose more.
const float kPieceSlack = 2e-5, kRounding = 4e-7;
// A ray looks at no more nodes and pieces, and makes no more iterations in all its pieces; then it is unresolved, with
// what it found. A ray along a base of five million triangles, 1600 quads across, passes a tenth of that.
const uint kMostVisits = 65536u;
// A ray that begins in a section plane meets what is solid there in the piece that it begins in, or comes into within
// this part of a pixel.
const float kCutSlack = 0.05;
const float kLeastSlope = 1.0 / 16.0;  // least slope of a ray to the slab: below it, textures are not blurred further

struct ShellHit {
    float t;      // along the ray; kMesoNoHit
    vec3 normal;  // not unit
    uint iterations;
    bool unresolved;
    int piece;  // first texel of its piece
    bool far;   // not marched: normal and light come from the appearance
};

// A pixel's width in world units: at the start of its ray, and how much it grows along it.
float widthAtStart, widthGrowth;
float pixelWidth(float t) { return widthAtStart + widthGrowth * t; }

// Where the ray begins in a section plane, the normal of what that cuts; else 0.
vec3 cutNormal = vec3(0.0);

// Gives a normal where the method has none: that of the nearest data, or of the voxel's face.
vec3 fallbackNormal(vec3 p, vec3 d) {
    if (kWalk == kMesoRelief) {
        vec3 at = p * float(meso.fine.x), i = floor(at);
        vec4 h = heightsAt(int(i.x), int(i.y)) * meso.step;
        return vec3(-slopeBilinear(h, at - i) * float(meso.fine.x), 1.0);
    }
    if (kWalk == kMesoSphere) {
        vec4 v0, v1;
        vec3 w;
        distancesAt(p, v0, v1, w);
        return gradientTrilinear(v0, v1, w) / meso.cell;
    }
    // Takes the wall that the point is nearest to, among those that the ray may enter by.
    vec3 at = p * vec3(meso.cells) / meso.extent, off = abs(at - round(at));
    off = mix(off, vec3(1.0), equal(d, vec3(0.0)));
    float least = min(off.x, min(off.y, off.z));
    return off.x == least   ? vec3(-sign(d.x), 0.0, 0.0)
           : off.y == least ? vec3(0.0, -sign(d.y), 0.0)
                            : vec3(0.0, 0.0, -sign(d.z));
}

// Where a ray passes a piece; times count from `o`, which is on the ray at `start`.
struct Passage {
    int at;  // texel of the piece
    float enter, leave;
    int entered;  // the corner opposite to the face that it comes in by; -1: it starts within
    bool toBase;
};

bool passesPiece(uint piece, vec3 o, vec3 d, float start, float tMax, out Passage passage) {
    int at = int(kShellNodeTexels * view.nodes + kShellPieceTexels * piece);
    vec4 corner = texelFetch(inputTexels, at);
    vec3 r0 = texelFetch(inputTexels, at + 1).xyz, r1 = texelFetch(inputTexels, at + 2).xyz,
         r2 = texelFetch(inputTexels, at + 3).xyz;
    vec3 p = o - corner.xyz;
    vec4 a, b;
    a.yzw = vec3(dot(r0, p), dot(r1, p), dot(r2, p));
    b.yzw = vec3(dot(r0, d), dot(r1, d), dot(r2, d));
    a.x = 1.0 - a.y - a.z - a.w;
    b.x = -b.y - b.z - b.w;
    vec3 size = abs(o) + abs(corner.xyz),
         lost = kRounding * vec3(dot(abs(r0), size), dot(abs(r1), size), dot(abs(r2), size));
    a += max(vec4(lost.x + lost.y + lost.z, lost), kPieceSlack);
    // The passage begins at the eye at the earliest: the piece may reach out of the box whose wall `o` is on.
    passage = Passage(at, -start, tMax - start, -1, false);
    for (int i = 0; i < 4; i++) {
        float time = -a[i] / b[i];
        if (b[i] > 0.0 && time > passage.enter) {
            passage.entered = i;
            passage.enter = time;
        } else if (b[i] < 0.0 && time < passage.leave) {
            passage.toBase = i == 3 && (uint(corner.w) & kShellBaseFace) != 0u;
            passage.leave = time;
        } else if (b[i] == 0.0 && a[i] < 0.0)
            return false;
    }
    return passage.enter <= passage.leave;
}

void castPiece(Passage passage, vec3 o, vec3 d, float start, inout ShellHit best) {
    int at = passage.at, entered = passage.entered;
    vec4 corner = texelFetch(inputTexels, at), r0 = texelFetch(inputTexels, at + 1),
         r1 = texelFetch(inputTexels, at + 2), r2 = texelFetch(inputTexels, at + 3);
    uint bits = uint(corner.w);
    // The weight of the corner above, whose row of R r2 is, grows away from the base.
    if (entered == 3 && (bits & kShellBaseFace) != 0u && view.withBase != 0u) {
        best = ShellHit(start + passage.enter, -r2.xyz, best.iterations, best.unresolved, at, false);
        return;
    }
    bool fromCut = entered >= 0 && (bits & (1u << uint(entered))) != 0u;
    vec3 t0 = texelFetch(inputTexels, at + 4).xyz, t1 = texelFetch(inputTexels, at + 5).xyz,
         t2 = texelFetch(inputTexels, at + 6).xyz;
    vec3 q = o - corner.xyz + passage.enter * d, direction = vec3(dot(t0, d), dot(t1, d), dot(t2, d));
    float scale = length(direction);
    if (scale > 1e-12) {
        MesoRay ray;
        vec3 place = vec3(r0.w, r1.w, r2.w) + vec3(dot(t0, q), dot(t1, q), dot(t2, q));  // in tile space
        ray.o = vec3(place.xy, clamp(place.z, 0.0, meso.extent.z));
        ray.o.xy -= meso.extent.xy * floor(ray.o.xy / meso.extent.xy);
        ray.d = direction / scale;
        ray.tMax = (passage.leave - passage.enter) * scale;
        ray.atTop = false;
        // A ray that comes from another piece was outside there, or had its hit there.
        ray.isOutside = entered >= 0;
        vec3 cut = entered == 0 ? r0.xyz + r1.xyz + r2.xyz : entered == 1 ? -r0.xyz : entered == 2 ? -r1.xyz : -r2.xyz;
        bool far = kFromFar != 0u && isFar(t0, t1, t2, pixelWidth(start + passage.enter));
        if (cutNormal != vec3(0.0) && start + passage.enter <= kCutSlack * pixelWidth(0.0)) {
            // The ray begins in a section plane: what is solid there shows its cut.
            fromCut = true;
            cut = cutNormal;
        }
        if (fromCut && (far ? ray.o.z < view.meanHeight : isSolidAt(ray.o))) {
            best = ShellHit(start + passage.enter, cut, best.iterations, best.unresolved, at, false);
            return;
        }
        MesoResult found;
        if (far)
            found = meetMean(ray);
        else
            found = marchMeso(ray);
        best.iterations += found.iterations;
        best.unresolved = best.unresolved || found.state == kMesoUnresolved;
        float t = start + passage.enter + found.t / scale;
        if (found.state == kMesoHit && t < best.t) {
            vec3 n = found.normal != vec3(0.0) ? found.normal : fallbackNormal(ray.o + found.t * ray.d, ray.d);
            // On a ridge, rounding may have chosen the side that is turned away.
            if (ray.d.z < 0.0 && dot(n, ray.d) > 0.1 * length(n)) n = vec3(0.0, 0.0, 1.0);
            n = t0 * n.x + t1 * n.y + t2 * n.z;
            best = ShellHit(t, fromCut && found.t == 0.0 ? cut : n, best.iterations, best.unresolved, at, far);
            return;
        }
    }
    if (passage.toBase && view.withBase != 0u) {
        best = ShellHit(start + passage.leave, r2.xyz, best.iterations, best.unresolved, at, false);
    }
}

float boxEntry(uint node, vec3 o, vec3 inverse, float leave, out vec4 low, out vec4 high) {
    low = texelFetch(inputTexels, int(kShellNodeTexels * node));
    high = texelFetch(inputTexels, int(kShellNodeTexels * node + 1u));
    vec3 a = (low.xyz - o) * inverse, b = (high.xyz - o) * inverse, near = min(a, b), far = max(a, b);
    float first = max(0.0, max(near.x, max(near.y, near.z))), last = min(leave, min(far.x, min(far.y, far.z)));
    return first <= last ? first : kMesoNoHit;
}

ShellHit castShell(vec3 eye, vec3 d, float tMax) {
    ShellHit best = ShellHit(tMax, vec3(0.0), 0u, false, 0, false);
    vec3 inverse = 1.0 / mix(d, vec3(1e-18), lessThan(abs(d), vec3(1e-18)));
    vec4 low, high;
    float start = boxEntry(0u, eye, inverse, tMax, low, high);
    if (start >= kMesoNoHit) return best;
    // The ray starts at the shell's box, where numbers are small.
    vec3 o = eye + start * d;
    uint stack[kShellDepth];
    stack[0] = 0u;
    int depth = 1;
    uint piece = 0u, left = 0u, visits = 0u;
    // All rays of a group look for their next piece, then all march: a piece takes long, and would otherwise run for
    // one ray at a time.
    while ((left > 0u || depth > 0) && visits < kMostVisits && best.iterations < kMostVisits) {
        Passage passage;
        bool passes = false;
        while (!passes && (left > 0u || depth > 0) && visits < kMostVisits) {
            visits++;
            if (left > 0u) {
                passes = passesPiece(piece, o, d, start, best.t, passage);
                piece++;
                left--;
                continue;
            }
            uint node = stack[--depth];
            if (boxEntry(node, o, inverse, best.t - start, low, high) >= kMesoNoHit) continue;
            uint first = uint(low.w), pieces = uint(high.w);
            if (pieces > 0u) {
                piece = first;
                left = pieces;
                continue;
            }
            uint child = first;
            vec4 l, h;
            float e0 = boxEntry(child, o, inverse, best.t - start, l, h),
                  e1 = boxEntry(child + 1u, o, inverse, best.t - start, l, h);
            // The nearer child goes on top.
            uint swapped = e1 < e0 ? 1u : 0u;
            if (max(e0, e1) < kMesoNoHit) stack[depth++] = child + 1u - swapped;
            if (min(e0, e1) < kMesoNoHit) stack[depth++] = child + swapped;
        }
        if (passes) castPiece(passage, o, d, start, best);
        if (kShadow != 0u && best.t < tMax) return best;
    }
    // This also covers devices that end a long loop by themselves, as software ones do.
    if (left > 0u || depth > 0) best.unresolved = true;
    return best;
}

// Returns the encoded colour at a hit, and the part of the light that reaches it; bends its normal. `width`: of a pixel
// there, world units.
vec4 lookAt(ShellHit hit, vec3 p, vec3 d, float width, inout vec3 n) {
    vec4 look = vec4(view.colour, 1.0);
    if (kTextures == 0u && !hit.far) return look;
    vec4 corner = texelFetch(inputTexels, hit.piece), q0 = texelFetch(inputTexels, hit.piece + 1),
         q1 = texelFetch(inputTexels, hit.piece + 2);
    mat3 gradients = mat3(texelFetch(inputTexels, hit.piece + 4).xyz, texelFetch(inputTexels, hit.piece + 5).xyz,
                          texelFetch(inputTexels, hit.piece + 6).xyz);
    vec2 cornerPlace = vec2(q0.w, q1.w), at = cornerPlace + ((p - corner.xyz) * gradients).xy;
    // The footprint is measured along the slab, whatever stands on it.
    float slope = abs(dot(normalize(gradients[2]), d)),
          footprint = width * max(length(gradients[0]), length(gradients[1])) / max(slope, kLeastSlope);
    if (hit.far) {
        look.w = farLight(tileFrame(gradients), d, n);
    } else if ((kTextures & kMesoNormals) != 0u) {
        mat3 frame = tileFrame(gradients);
        n = normalize(frame * bentNormal(n * frame, sampleTexture(view.normals, at, footprint).xyz));
    }
    if ((kTextures & kMesoColours) != 0u) look.xyz = encodedColour(sampleTexture(view.colours, at, footprint).xyz);
    return look;
}

// The part of a ray that section planes leave.
struct KeptPart {
    float first, last;
};
KeptPart keptPart(vec3 o, vec3 d) {
    KeptPart kept = KeptPart(0.0, kMesoNoHit);
    for (uint i = 0u; i < view.sectionCount; i++) {
        vec4 plane = view.sections[i];
        float above = dot(plane.xyz, o) + plane.w, climb = dot(plane.xyz, d);
        if (climb > 0.0 && -above > climb * kept.first) {
            kept.first = -above / climb;
            cutNormal = -plane.xyz;
        }
        if (climb < 0.0) kept.last = min(kept.last, -above / climb);
        if (climb == 0.0 && above < 0.0) kept.last = -1.0;
    }
    return kept;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    vec2 at = vec2(pixel) + 0.5;
    uint index = pixel.y * view.width + pixel.x, plane = view.width * view.height;
    vec3 eye = view.eye.xyz + at.x * view.eyeX.xyz + at.y * view.eyeY.xyz;
    vec3 towards = view.forward.xyz + at.x * view.forwardX.xyz + at.y * view.forwardY.xyz, d = normalize(towards);
    float depth = uintBitsToFloat(hits[kMesoPlaneDepth * plane + index]);
    widthAtStart = length(view.eyeX.xyz);
    widthGrowth = length(view.forwardX.xyz) / length(towards);
    if (kShadow != 0u) {
        uint colour = hits[kMesoPlaneLook * plane + index];
        // Only mesostructure that is not yet in the dark casts a shadow ray.
        if (hits[kMesoPlaneNormal * plane + index] == 0u || colour >> 24 == 0u) return;
        vec3 n = unpackHitNormal(hits[kMesoPlaneNormal * plane + index]);
        if (dot(n, view.light) <= 0.0) return;
        widthAtStart = pixelWidth(depth);
        widthGrowth = 0.0;
        vec3 from = eye + depth * d + view.shadowLift * n;
        KeptPart kept = keptPart(from, view.light);
        float reach = kept.last - kept.first;
        if (reach <= 0.0) return;
        ShellHit hit = castShell(from + kept.first * view.light, view.light, reach);
        if (hit.unresolved) atomicAdd(counters[0], 1u);
        if (hit.t < reach) hits[kMesoPlaneLook * plane + index] = colour & 0xffffffu;
        return;
    }
    KeptPart kept = keptPart(eye, d);
    float reach = min(depth, kept.last) - kept.first;
    if (reach <= 0.0) return;
    eye += kept.first * d;
    widthAtStart += widthGrowth * kept.first;
    ShellHit hit = castShell(eye, d, reach);
    hits[kMesoPlaneIterations * plane + index] += hit.iterations;
    if (hit.unresolved) atomicAdd(counters[0], 1u);
    if (!(hit.t < reach)) return;
    if (hit.far) atomicAdd(counters[1], 1u);
    vec3 n = normalize(hit.normal);
    vec4 look = lookAt(hit, eye + hit.t * d, d, pixelWidth(hit.t), n);
    if (dot(n, d) > 0.0) n -= dot(n, d) * d;
    hits[kMesoPlaneDepth * plane + index] = floatBitsToUint(kept.first + hit.t);
    // 0 means that a pixel has no mesostructure.
    hits[kMesoPlaneNormal * plane + index] = max(packHitNormal(normalize(n)), 1u);
    hits[kMesoPlaneLook * plane + index] = packUnorm4x8(look);
}
