// Casts rays through the shell of a surface with mesostructure (mesostructure/shell.h): first hits, and how they look.
// Compiles as GLSL (shaders/meso_surface.comp) and as members of a struct in C++ (render/host/shell_caster.h); what is
// global in a shader is a member there. The common subset of GLSL and GLM is used: no swizzles, no constructors of
// structs.
//
// Whoever includes it gives: the marcher and its record `meso`, the surface's MesoView `view`; fetchInput, fetchLook
// and fetchBaseLight, which read the texels of the shell, of looks and of the light over the base; kShadow (1: any hit
// does), kTextures and kFromFar, as meso_surface.comp has them.

// A pixel's width in world units: at the start of its ray, and how much it grows along it.
float widthAtStart, widthGrowth;
INLINE float pixelWidth(float t) { return widthAtStart + widthGrowth * t; }

// Where the ray begins in a section plane, the normal of what that cuts; else 0.
vec3 cutNormal;

#include "render/shared/meso_far.h"
#include "render/shared/meso_texture_lookup.h"
#include "render/shared/meso_transfer.h"

// Gives a normal where the method has none: that of the nearest data, or of the voxel's face.
INLINE vec3 fallbackNormal(vec3 p, vec3 d) {
    if (kWalk == kMesoRelief && kSurface == kMesoLayers) {
        // The gradient over a texel and a hundredth of the slab.
        vec3 scale = vec3(float(meso.fine.x), float(meso.fine.x), 1.0f / meso.height), at = p * scale;
        vec3 x = vec3(0.5f, 0.0f, 0.0f), y = vec3(0.0f, 0.5f, 0.0f), z = vec3(0.0f, 0.0f, 0.005f);
        return vec3(aboveLayers(at + x) - aboveLayers(at - x), aboveLayers(at + y) - aboveLayers(at - y),
                    100.0f * (aboveLayers(at + z) - aboveLayers(at - z))) *
               scale;
    }
    if (kWalk == kMesoRelief) {
        vec3 at = p * float(meso.fine.x), i = floor(at);
        vec4 h = heightsAt(int(i.x), int(i.y)) * meso.step;
        return vec3(-slopeBilinear(h, at - i) * float(meso.fine.x), 1.0f);
    }
    if (kWalk == kMesoSphere) {
        vec4 v0, v1;
        vec3 w;
        distancesAt(p, v0, v1, w);
        return gradientTrilinear(v0, v1, w) / meso.cell;
    }
    // Takes the wall that the point is nearest to, among those that the ray may enter by.
    vec3 at = p * vec3(meso.cells) / meso.extent, off = abs(at - round(at));
    off = mix(off, vec3(1.0f), equal(d, vec3(0.0f)));
    float least = min(off.x, min(off.y, off.z));
    return off.x == least   ? vec3(-sign(d.x), 0.0f, 0.0f)
           : off.y == least ? vec3(0.0f, -sign(d.y), 0.0f)
                            : vec3(0.0f, 0.0f, -sign(d.z));
}

// Finds where a ray passes a piece; times count from `o`, which is on the ray at `start`.
INLINE bool passesPiece(uint piece, vec3 o, vec3 d, float start, float tMax, INOUT(ShellPassage) passage) {
    int at = int(kShellNodeTexels * view.nodes + kShellPieceTexels * piece);
    vec4 corner = fetchInput(at);
    vec3 v0 = vec3(corner), r0 = vec3(fetchInput(at + 1)), r1 = vec3(fetchInput(at + 2)), r2 = vec3(fetchInput(at + 3));
    vec3 p = o - v0;
    vec3 a3 = vec3(dot(r0, p), dot(r1, p), dot(r2, p)), b3 = vec3(dot(r0, d), dot(r1, d), dot(r2, d));
    vec4 a = vec4(1.0f - a3.x - a3.y - a3.z, a3), b = vec4(-b3.x - b3.y - b3.z, b3);
    vec3 size = abs(o) + abs(v0), lost = kRounding * vec3(dot(abs(r0), size), dot(abs(r1), size), dot(abs(r2), size));
    vec4 slack = max(vec4(lost.x + lost.y + lost.z, lost), vec4(kPieceSlack));
    a += slack;
    // The passage begins at the eye at the earliest: the piece may reach out of the box whose wall `o` is on.
    passage.at = at;
    passage.enter = -start;
    passage.leave = tMax - start;
    passage.entered = -1;
    passage.left = -1;
    passage.early = 0.0f;
    passage.late = 0.0f;
    passage.toBase = false;
    for (int i = 0; i < 4; i++) {
        float time = -a[i] / b[i];
        if (b[i] > 0.0f && time > passage.enter) {
            passage.entered = i;
            passage.enter = time;
            passage.early = slack[i] / b[i];
        } else if (b[i] < 0.0f && time < passage.leave) {
            passage.left = i;
            passage.late = -slack[i] / b[i];
            passage.toBase = i == 3 && (uint(corner.w) & kShellBaseFace) != 0u;
            passage.leave = time;
        } else if (b[i] == 0.0f && a[i] < 0.0f)
            return false;
    }
    return passage.enter <= passage.leave;
}

INLINE void hitShell(float t, vec3 normal, int piece, bool far, INOUT(ShellHit) best) {
    best.t = t;
    best.normal = normal;
    best.piece = piece;
    best.far = far;
    best.cut = false;
    best.base = false;
    best.asked = kMesoNoHit;
}

// Hits the base, where a ray that was asked for all of its way before has seen nothing else.
INLINE void hitBase(float t, vec3 normal, int piece, INOUT(ShellHit) best) {
    if (t > best.t || best.asked < t) return;
    hitShell(t, normal, piece, false, best);
    best.base = true;
}

// Returns the directions of the base over the columns of a piece; those at sharp edges have the piece's own.
INLINE mat3 columnDirections(int piece, vec3 own) {
    int first = int(kShellNodeTexels * view.nodes + kShellPieceTexels * view.pieces);
    mat3 directions;
    for (int k = 0; k < 3; k++) {
        vec4 column = fetchInput(first + int(fetchInput(piece + 4 + k).w));
        directions[k] = column.w > 0.0f ? vec3(column) : own;
    }
    return directions;
}

// Turns a vector the shortest way, as one unit vector is turned to another that is not far from it.
INLINE vec3 turnedFrom(vec3 from, vec3 to, vec3 v) {
    float same = dot(from, to);
    if (!(same > 0.5f)) return v;
    vec3 sum = from + to;
    return v + 2.0f * dot(from, v) * to - dot(sum, v) / (1.0f + same) * sum;
}

// Returns MesoRay::bend in a piece whose base has these directions: how much they turn along the tile, over how long
// the tile is there against its height.
INLINE float bendOver(int piece, vec3 d, mat3 directions, vec3 up) {
    vec4 corner = fetchInput(piece), r0 = fetchInput(piece + 1), r1 = fetchInput(piece + 2), r2 = fetchInput(piece + 3);
    vec3 t0 = vec3(fetchInput(piece + 4)), t1 = vec3(fetchInput(piece + 5)), t2 = vec3(fetchInput(piece + 6));
    vec3 x = cross(t1, t2), y = cross(t2, t0);
    float volume = dot(t0, x), run = length(vec2(d.x, d.y));
    if (volume == 0.0f || run == 0.0f) return 0.0f;
    vec3 along = (d.x * x + d.y * y) / (run * volume);  // of a unit of the tile, in the world
    float b = dot(vec3(r0), along), c = dot(vec3(r1), along), e = dot(vec3(r2), along);
    vec3 turn = directions * ofColumns(uint(corner.w), vec4(-b - c - e, b, c, e));
    return dot(turn, along) * length(t2) / length(up);
}

// Asks a map of curvatures once for a ray's way, over a base that bends as it does where the ray comes in: all of its
// way where the shell is smooth, or else the piece's part of it.
INLINE void askBent(ShellPassage passage, MesoRay ray, vec3 place, float scale, float start, vec3 d, bool whole,
                    INOUT(ShellHit) best) {
    int at = passage.at;
    vec3 t0 = vec3(fetchInput(at + 4)), t1 = vec3(fetchInput(at + 5)), t2 = vec3(fetchInput(at + 6));
    vec3 own = normalize(t2);
    mat3 directions = columnDirections(at, own);
    vec3 up = directions * columnWeights(at, place), turned = turnedFrom(normalize(up), own, d);
    ray.d = vec3(dot(t0, turned), dot(t1, turned), dot(t2, turned)) / scale;
    float longer = length(ray.d);
    ray.d = ray.d / longer;
    ray.bend = bendOver(at, ray.d, directions, up);
    ray.tMax = whole ? kMostReach : ray.tMax * longer;
    MesoResult found = marchMeso(ray);
    best.iterations += found.iterations;
    // By twice what the piece is wider than it is, it is asked behind the wall of the piece that the ray has left.
    float begins = start + passage.enter, asked = begins + 2.0f * passage.early,
          t = begins + found.t / (scale * longer);
    // The base lies behind whatever is seen over it, however far off that is said to be.
    if (found.state != kMesoHit || !(t < best.t || (best.base && asked < best.t))) return;
    if (best.border > asked && best.border < t) return;
    vec3 n = found.normal != vec3(0.0f) ? found.normal : vec3(0.0f, 0.0f, 1.0f);
    n = t0 * n.x + t1 * n.y + t2 * n.z;
    hitShell(t, turnedFrom(own, normalize(up), n), at, false, best);
    best.asked = asked;
}

// A ray leaves a smooth shell by its border: what was seen beyond is not there.
INLINE void leaveBent(ShellPassage passage, float start, INOUT(ShellHit) best) {
    float t = start + passage.leave - passage.late;
    best.border = min(best.border, t);
    if (best.asked < t && t < best.t) hitShell(kMesoNoHit, vec3(0.0f), 0, false, best);
}

INLINE void castPiece(ShellPassage passage, vec3 o, vec3 d, float start, INOUT(ShellHit) best) {
    int at = passage.at, entered = passage.entered;
    vec4 corner = fetchInput(at), r0 = fetchInput(at + 1), r1 = fetchInput(at + 2), r2 = fetchInput(at + 3);
    uint bits = uint(corner.w);
    // The weight of the corner above, whose row of R r2 is, grows away from the base.
    if (entered == 3 && (bits & kShellBaseFace) != 0u && view.withBase != 0u) {
        hitBase(start + passage.enter, -vec3(r2), at, best);
        return;
    }
    bool fromCut = entered >= 0 && (bits & (1u << uint(entered))) != 0u;
    vec3 t0 = vec3(fetchInput(at + 4)), t1 = vec3(fetchInput(at + 5)), t2 = vec3(fetchInput(at + 6));
    vec3 q = o - vec3(corner) + passage.enter * d, direction = vec3(dot(t0, d), dot(t1, d), dot(t2, d));
    float scale = length(direction);
    if (scale > 1e-12f) {
        MesoRay ray;
        vec3 place = vec3(r0.w, r1.w, r2.w) + vec3(dot(t0, q), dot(t1, q), dot(t2, q));  // in tile space
        vec3 tile = meso.extent * floor(place / meso.extent);
        ray.o = vec3(place.x - tile.x, place.y - tile.y, clamp(place.z, 0.0f, meso.extent.z));
        ray.d = direction / scale;
        ray.tMax = (passage.leave - passage.enter) * scale;
        ray.atTop = false;
        // A ray that comes from another piece was outside there, or had its hit there.
        ray.isOutside = entered >= 0;
        ray.bend = 0.0f;
        vec3 cut = entered == 0   ? vec3(r0) + vec3(r1) + vec3(r2)
                   : entered == 1 ? -vec3(r0)
                   : entered == 2 ? -vec3(r1)
                                  : -vec3(r2);
        bool far = kFromFar != 0u && isFar(t0, t1, t2, pixelWidth(start + passage.enter));
        if (cutNormal != vec3(0.0f) && start + passage.enter <= kCutSlack * pixelWidth(0.0f)) {
            // The ray begins in a section plane: what is solid there shows its cut.
            fromCut = true;
            cut = cutNormal;
        }
        if (fromCut && (far ? ray.o.z < view.meanHeight : isSolidAt(ray.o))) {
            hitShell(start + passage.enter, cut, at, false, best);
            best.cut = true;
            return;
        }
        if (kWalk == kMesoVdm && kRefinement == kMesoBent && !far) {
            // The uppermost face of a prism is opposite to the first corner of its last piece.
            bool whole = (bits & kShellSmooth) != 0u, isTop = entered == 0 && (bits >> kShellPart & 3u) == 2u;
            ray.atTop = isTop && whole;
            if (!whole || isTop || entered < 0 || fromCut)
                askBent(passage, ray, o + passage.enter * d, scale, start, d, whole, best);
            if (whole && passage.left >= 0 && (bits & (1u << uint(passage.left))) != 0u)
                leaveBent(passage, start, best);
            if (passage.toBase && view.withBase != 0u) hitBase(start + passage.leave, vec3(r2), at, best);
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
            vec3 n = found.normal != vec3(0.0f) ? found.normal : fallbackNormal(ray.o + found.t * ray.d, ray.d);
            // On a ridge, rounding may have chosen the side that is turned away.
            if (ray.d.z < 0.0f && dot(n, ray.d) > 0.1f * length(n)) n = vec3(0.0f, 0.0f, 1.0f);
            n = t0 * n.x + t1 * n.y + t2 * n.z;
            bool atCut = fromCut && found.t == 0.0f;
            hitShell(t, atCut ? cut : n, at, far, best);
            best.cut = atCut;
            return;
        }
    }
    if (passage.toBase && view.withBase != 0u) hitBase(start + passage.leave, vec3(r2), at, best);
}

// Returns when a ray comes into a node's box; kMesoNoHit where it does not, or after `leave`.
INLINE float boxEntry(uint node, vec3 o, vec3 inverse, float leave) {
    vec3 low = vec3(fetchInput(int(kShellNodeTexels * node))),
         high = vec3(fetchInput(int(kShellNodeTexels * node + 1u)));
    vec3 a = (low - o) * inverse, b = (high - o) * inverse, near = min(a, b), far = max(a, b);
    float first = max(0.0f, max(near.x, max(near.y, near.z))), last = min(leave, min(far.x, min(far.y, far.z)));
    return first <= last ? first : kMesoNoHit;
}

// Turns the normal of a hit as the base turns between its corners: a piece's own up jumps from piece to piece. Columns
// at sharp edges of the base have no direction and take the piece's.
INLINE vec3 turnedWithBase(int piece, vec3 p, vec3 n) {
    vec3 own = normalize(vec3(fetchInput(piece + 6)));
    return turnedFrom(own, normalize(columnDirections(piece, own) * columnWeights(piece, p)), n);
}

INLINE ShellHit castShell(vec3 eye, vec3 d, float tMax) {
    ShellHit best;
    best.iterations = 0u;
    best.unresolved = false;
    best.border = kMesoNoHit;
    hitShell(tMax, vec3(0.0f), 0, false, best);
    vec3 inverse = 1.0f / mix(d, vec3(1e-18f), lessThan(abs(d), vec3(1e-18f)));
    float start = boxEntry(0u, eye, inverse, tMax);
    if (start >= kMesoNoHit) return best;
    // The ray starts at the shell's box, where numbers are small.
    vec3 o = eye + start * d;
    uint stack[kShellDepth];
    float entries[kShellDepth];  // when the ray comes into the box of each, from `o` on
    stack[0] = 0u;
    entries[0] = 0.0f;
    int depth = 1;
    uint piece = 0u, left = 0u, visits = 0u;
    // All rays of a group look for their next piece, then all march: a piece takes long, and would otherwise run for
    // one ray at a time.
    while ((left > 0u || depth > 0) && visits < kMostVisits && best.iterations < kMostVisits) {
        ShellPassage passage;
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
            if (entries[depth] > best.t - start) continue;
            uint first = uint(fetchInput(int(kShellNodeTexels * node)).w),
                 pieces = uint(fetchInput(int(kShellNodeTexels * node + 1u)).w);
            if (pieces > 0u) {
                piece = first;
                left = pieces;
                continue;
            }
            uint child = first;
            float e0 = boxEntry(child, o, inverse, best.t - start),
                  e1 = boxEntry(child + 1u, o, inverse, best.t - start);
            // The nearer child goes on top.
            uint swapped = e1 < e0 ? 1u : 0u;
            if (max(e0, e1) < kMesoNoHit) {
                stack[depth] = child + 1u - swapped;
                entries[depth++] = max(e0, e1);
            }
            if (min(e0, e1) < kMesoNoHit) {
                stack[depth] = child + swapped;
                entries[depth++] = min(e0, e1);
            }
        }
        if (passes) castPiece(passage, o, d, start, best);
        if (kShadow != 0u && best.t < tMax) return best;
    }
    // This also covers devices that end a long loop by themselves, as software ones do.
    if (left > 0u || depth > 0) best.unresolved = true;
    if (best.t < tMax && !best.cut && best.asked >= kMesoNoHit)
        best.normal = turnedWithBase(best.piece, o + (best.t - start) * d, best.normal);
    return best;
}

// Returns how a hit looks, before shadow rays; bends its normal. `width`: of a pixel there, world units.
INLINE ShellLook lookOf(ShellHit hit, vec3 p, vec3 d, float width, INOUT(vec3) n) {
    ShellLook look;
    look.colour = view.colour;
    look.sky = 1.0f;
    look.light = vec4(1.0f);
    if (kTextures == 0u && !hit.far) return look;
    vec4 corner = fetchInput(hit.piece), q0 = fetchInput(hit.piece + 1), q1 = fetchInput(hit.piece + 2);
    mat3 gradients =
        mat3(vec3(fetchInput(hit.piece + 4)), vec3(fetchInput(hit.piece + 5)), vec3(fetchInput(hit.piece + 6)));
    vec3 place = (p - vec3(corner)) * gradients;
    vec2 at = vec2(q0.w + place.x, q1.w + place.y);
    // The footprint is measured along the slab, whatever stands on it.
    float slope = abs(dot(normalize(gradients[2]), d)),
          footprint = width * max(length(gradients[0]), length(gradients[1])) / max(slope, kLeastSlope);
    if (hit.far) {
        seeFar(tileFrame(gradients), d, n, look);
    } else if ((kTextures & kMesoNormals) != 0u) {
        mat3 frame = tileFrame(gradients);
        n = normalize(frame * bentNormal(n * frame, vec3(sampleTexture(view.normals, at, footprint))));
    }
    if ((kTextures & kMesoColours) != 0u) look.colour = encodedColour(vec3(sampleTexture(view.colours, at, footprint)));
    return look;
}

INLINE ShellKept keptPart(vec3 o, vec3 d) {
    ShellKept kept;
    kept.first = 0.0f;
    kept.last = kMesoNoHit;
    cutNormal = vec3(0.0f);
    for (uint i = 0u; i < view.sectionCount; i++) {
        vec3 normal = vec3(view.sections[i]);
        float above = dot(normal, o) + view.sections[i].w, climb = dot(normal, d);
        if (climb > 0.0f && -above > climb * kept.first) {
            kept.first = -above / climb;
            cutNormal = -normal;
        }
        if (climb < 0.0f) kept.last = min(kept.last, -above / climb);
        if (climb == 0.0f && above < 0.0f) kept.last = -1.0f;
    }
    return kept;
}
