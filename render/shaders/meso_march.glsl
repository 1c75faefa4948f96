// The marchers (mesostructure/march.h), one a pipeline by kWalk, kSkip, kSurface and kRefinement: the same arrays, the
// same order of steps, the same counted fetches as the reference on the CPU. A ray that used up its iterations is
// unresolved.
#include "render/shaders/meso_walk.glsl"
#include "render/shaders/meso_solve.glsl"

const uint kOccupied = 255u;
const uint kSmallCells = 0x4000u;  // OctantBoxes::kSmallCells

struct Space {
    bool occupied;
    ivec3 further;
    float reach;
    uint marks;  // which small cells of an occupied cell the surface passes (meso::markSmallCells); 0: not known
};

// coneOf (mesostructure/distance_map.h): signs and products, which no device may round further off than it says there.
int coneOf(vec3 d) {
    int azimuth = 0, elevation = 0;
    bool isLower = d.y < 0.0;
    for (int k = 1; k < meso.cones.x; k++) {
        float along = meso.borders[k].x * d.y, across = meso.borders[k].y * d.x;
        azimuth += int(2 * k < meso.cones.x ? isLower || along > across : isLower && along >= across);
    }
    float flatness = d.x * d.x + d.y * d.y, height = d.z * abs(d.z);
    for (int k = 1; k < meso.cones.y; k++) elevation += int(height * meso.borders[k].z >= meso.borders[k].w * flatness);
    return elevation * meso.cones.x + azimuth;
}

// Looks up a cell, as CompressedMap::lookUp does.
Space lookUp(uint cone, ivec3 cell, inout uint fetches) {
    ivec3 at = ivec3(wrapped2(cell.xy, meso.cells.xy), cell.z), block = at / int(meso.levels[0].z >> 16);
    uint entry = uint(block.x + meso.top.x * (block.y + meso.top.y * block.z));
    for (int i = 0; i < meso.cones.z; i++) {
        uvec4 level = meso.levels[i];
        uint step = fetchByte(level.x, cone * level.y + entry);
        fetches++;
        if (step != kOccupied) return Space(false, ivec3(0), float(step) * meso.extent.w, 0u);
        if (i + 1 == meso.cones.z) break;
        uvec4 below = meso.levels[i + 1];
        int edge = int(level.z >> 16), factor = int(below.z & 0xffffu);
        ivec3 local = at % edge / int(below.z >> 16);
        entry = fetchWord(level.w + entry) * uint(factor * factor * factor) + uint(local.x + factor * (local.y + factor * local.z));
        fetches++;
    }
    return Space(true, ivec3(0), 0.0, 0u);
}

Space spaceAt(int direction, ivec3 cell, inout uint fetches) {
    if (kSkip == kMesoCompressed) return lookUp(uint(direction), cell, fetches);
    fetches++;
    uint slot = uint(direction) * uint(meso.cells.w) + gridIndex(cell, meso.cells.xy);
    if (kSkip == kMesoBoxes) {
        int box = int(fetchShort(meso.at.x, slot));
        if ((box & 0x8000) != 0) return Space(true, ivec3(0), 0.0, uint(box & 0x7fff));
        return Space(false, ivec3(box & 31, (box >> 5) & 31, (box >> 10) & 31), 0.0, 0u);
    }
    uint step = fetchByte(meso.at.x, slot);
    return kSkip == kMesoDistances ? Space(step == kOccupied, ivec3(0), float(step) * meso.extent.w, 0u) : Space(step != 0u, ivec3(0), 0.0, 0u);
}

struct Side {
    bool outside, inRun;
};

bool meetPatches(Walk w, float from, float to, inout MesoResult result) {
    result.fetches++;
    uint cell = gridIndex(w.cell, meso.cells.xy), bit = 1u << (cell & 31u), rank = meso.at.y + 2u * (cell >> 5);
    uint mask = fetchWord(rank);
    if ((mask & bit) == 0u) return false;
    result.fetches++;
    uint row = fetchWord(meso.at.z + fetchWord(rank + 1u) + uint(bitCount(mask & (bit - 1u))));
    vec3 o = walkAt(w, from) - vec3(w.cell), gradient = vec3(0.0);
    float best = kFar;
    for (uint i = row >> 4; i < (row >> 4) + (row & 15u); i++) {
        result.fetches += 5u;
        result.tests++;
        Patch q = fetchPatch(i);
        float s = crossPatch(q, o, w.d, to - from);
        if (s >= 0.0 && s < best) {
            best = s;
            gradient = patchGradient(q, o + s * w.d);
        }
    }
    if (best >= kFar) return false;
    result.t = from + best;
    vec3 normal = gradient / meso.cell.xyz;
    if (dot(normal, w.d * meso.cell.xyz) > 0.0) normal = -normal;
    result.normal = normalize(normal);
    return true;
}

// Returns the heights of the bilinear cell at a texel, in 16-bit steps.
vec4 heightsAt(int x, int y) {
    ivec2 a = wrapped2(ivec2(x, y), meso.fine.xy), b = wrapped2(ivec2(x, y) + 1, meso.fine.xy);
    uint row0 = uint(meso.fine.x * a.y), row1 = uint(meso.fine.x * b.y);
    return vec4(fetchShort(meso.at.y, row0 + uint(a.x)), fetchShort(meso.at.y, row0 + uint(b.x)), fetchShort(meso.at.y, row1 + uint(a.x)), fetchShort(meso.at.y, row1 + uint(b.x)));
}

float signedShort(uint bits) { return float(int(bits << 16) >> 16); }

// Returns the samples at the corners of a field's cell, below and above.
void fieldAt(ivec3 cell, out vec4 v0, out vec4 v1) {
    ivec2 a = wrapped2(cell.xy, meso.fine.xy), b = wrapped2(cell.xy + 1, meso.fine.xy);
    uvec4 at = uvec4(a.x + meso.fine.x * a.y, b.x + meso.fine.x * a.y, a.x + meso.fine.x * b.y, b.x + meso.fine.x * b.y);
    uint plane = uint(meso.fine.x * meso.fine.y), z = uint(cell.z) * plane;
    for (int i = 0; i < 4; i++) {
        v0[i] = signedShort(fetchShort(meso.at.y, z + at[i]));
        v1[i] = signedShort(fetchShort(meso.at.y, z + plane + at[i]));
    }
}

// Serves the methods that have samples and look only at cells with surface.
bool isSolidAt(vec3 p) {
    if (kSurface != kMesoHeights && kSurface != kMesoField) return false;
    vec3 at = p / meso.extent.xyz * vec3(meso.fine.xyz), w = fract(at);
    if (kSurface == kMesoHeights) {
        vec4 h = heightsAt(int(floor(at.x)), int(floor(at.y)));
        return p.z <= mix(mix(h.x, h.y, w.x), mix(h.z, h.w, w.x), w.y) * meso.scale.x;
    }
    int z = min(int(at.z), meso.fine.z - 1);
    vec4 v0, v1;
    fieldAt(ivec3(floor(at.xy), z), v0, v1);
    vec4 v = mix(v0, v1, at.z - float(z));
    return mix(mix(v.x, v.y, w.x), mix(v.z, v.w, w.x), w.y) <= 0.0;
}

CellHit solveHeights(Walk w, ivec3 at, vec3 o, vec3 d, float from, float to, bool outside, inout MesoResult result) {
    result.fetches++;
    ivec2 texel = w.cell.xy * meso.ratio.xy + at.xy;
    vec4 h = heightsAt(texel.x, texel.y) * meso.scale.x - float(w.cell.z) * meso.cell.z;
    vec3 scale = vec3(1.0, 1.0, meso.cell.z);
    o *= scale;
    d *= scale;
    CellHit found = firstEntryBilinear(h, o, d, from, to, outside);
    if (found.hit) {
        vec3 p = o + found.t * d;
        vec2 slope = vec2(mix(h.y - h.x, h.w - h.z, p.y), mix(h.z - h.x, h.w - h.y, p.x));
        result.normal = normalize(vec3(-slope * vec2(meso.ratio.xy) / meso.cell.xy, 1.0));
    }
    return found;
}

CellHit solveField(Walk w, ivec3 at, vec3 o, vec3 d, float from, float to, bool outside, inout MesoResult result) {
    result.fetches += 2u;
    vec4 v0, v1;
    fieldAt(w.cell * meso.ratio.xyz + at, v0, v1);
    bvec4 in0 = lessThanEqual(v0, vec4(0.0)), in1 = lessThanEqual(v1, vec4(0.0));
    if (!any(in0) && !any(in1)) return CellHit(false, 0.0, true);
    if (all(in0) && all(in1) && !outside) return CellHit(false, 0.0, false);
    CellHit found = firstEntryTrilinear(v0, v1, o, d, from, to, outside);
    if (found.hit) result.normal = normalize(gradientTrilinear(v0, v1, o + found.t * d) * vec3(meso.ratio.xyz) / meso.cell.xyz);
    return found;
}

// Meets the texels of a height map within a cell of the grid, from wall to wall.
bool meetHeights(Walk w, float from, float to, inout Side side, inout MesoResult result) {
    ivec3 ratio = ivec3(meso.ratio.xy, 1);
    vec3 scale = vec3(ratio), o = (walkAt(w, from) - vec3(w.cell)) * scale, d = w.d * scale;
    float span = to - from, s = 0.0;
    ivec3 at = clamp(ivec3(floor(o)), ivec3(0), ratio - 1);
    bvec3 still = bvec3(equal(w.sign.xy, ivec2(0)), true);
    // A line crosses at most so many texels.
    for (int i = 0; i < ratio.x + ratio.y; i++) {
        vec3 walls = mix((vec3(at + ivec3(greaterThan(w.sign, ivec3(0)))) - o) / d, vec3(kFar), still);
        float first = min(walls.x, walls.y), end = max(s, min(first, span));
        result.tests++;
        CellHit found = solveHeights(w, at, o - vec3(at), d, s, end, side.outside, result);
        if (found.hit) {
            result.t = from + found.t;
            return true;
        }
        side.outside = found.outside;
        if (first >= kFar || end >= span) return false;
        at += w.sign * ivec3(equal(ivec3(first == walls.x ? 0 : 1), ivec3(0, 1, 2)));
        if (any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, ratio))) return false;
        s = end;
    }
    return false;
}

// Meets the small cells of a field within a cell of the grid, from wall to wall; where marks say so, only those that
// the surface passes.
bool meetField(Walk w, float from, float to, uint marks, inout Side side, inout MesoResult result) {
    ivec3 ratio = meso.ratio.xyz;
    if (ratio != ivec3(2) || (marks & kSmallCells) == 0u) marks = 0u;
    vec3 scale = vec3(ratio), o = (walkAt(w, from) - vec3(w.cell)) * scale, d = w.d * scale;
    float span = to - from, s = 0.0;
    ivec3 at = clamp(ivec3(floor(o)), ivec3(0), ratio - 1), forwards = ivec3(greaterThan(w.sign, ivec3(0)));
    bvec3 still = equal(w.sign, ivec3(0));
    // A line crosses at most so many cells.
    int left = ratio.x + ratio.y + ratio.z;
    while (left > 0) {
        float end;
        bool passes = false;
        ivec3 small;
        // As in marchGrid, all rays look first, then all solve.
        while (!passes && left > 0) {
            vec3 walls = mix((vec3(at + forwards) - o) / d, vec3(kFar), still);
            float first = min(walls.x, min(walls.y, walls.z));
            end = max(s, min(first, span));
            passes = marks == 0u || ((marks >> uint(at.x + 2 * at.y + 4 * at.z)) & 1u) != 0u;
            small = at;
            at += w.sign * ivec3(equal(ivec3(first == walls.x ? 0 : first == walls.y ? 1 : 2), ivec3(0, 1, 2)));
            left--;
            if (first >= kFar || end >= span || any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, ratio))) left = 0;
            if (!passes) s = end;
        }
        if (!passes) return false;
        result.tests++;
        CellHit found = solveField(w, small, o - vec3(small), d, s, end, side.outside, result);
        if (found.hit) {
            result.t = from + found.t;
            return true;
        }
        side.outside = found.outside;
        s = end;
    }
    return false;
}

bool meetSurface(Walk w, float from, float to, uint marks, inout Side side, inout MesoResult result) {
    if (kSurface == kMesoPatches) return meetPatches(w, from, to, result);
    if (kSurface == kMesoHeights) return meetHeights(w, from, to, side, result);
    if (kSurface == kMesoField) return meetField(w, from, to, marks, side, result);
    if (side.inRun && !w.startsAtTop) return false;
    result.t = from;
    return true;
}

void marchGrid(MesoRay ray, inout MesoResult result) {
    Walk w = startWalk(ray, meso.cells.xyz);
    int direction = kSkip == kMesoOccupancy ? 0 : kSkip == kMesoBoxes ? int(w.d.x < 0.0) | int(w.d.y < 0.0) << 1 | int(w.d.z < 0.0) << 2 : coneOf(w.d * meso.cell.xyz);
    Side side = Side(w.startsAtTop || ray.isOutside, !ray.isOutside);
    // All rays of a group look for their next occupied cell, then all solve: solving takes long, and would otherwise
    // run for one ray at a time.
    while (true) {
        bool found = false;
        float exit = kFar;
        int axisOut = -1;
        uint marks = 0u;
        while (!found && w.cell.z >= 0 && w.cell.z < meso.cells.z && w.t <= w.tMax) {
            if (result.iterations++ == kMostIterations) {
                result.state = kMesoUnresolved;
                return;
            }
            Space space = spaceAt(direction, w.cell, result.fetches);
            exit = walkExit(w, space.further, axisOut);
            found = space.occupied;
            marks = space.marks;
            if (found) break;
            side.inRun = false;
            if (space.reach > 0.0 && w.t + space.reach > exit) walkJump(w, w.t + space.reach);
            else if (exit >= kFar) break;
            else walkLeave(w, space.further, exit, axisOut);
        }
        if (!found) break;
        float entry = walkEntry(w), end = max(entry, min(exit, w.tMax));
        if (meetSurface(w, entry, end, marks, side, result)) {
            result.state = kMesoHit;
            return;
        }
        if (exit >= kFar) break;
        walkLeave(w, ivec3(0), exit, axisOut);
    }
    if (kSurface == kMesoHeights && w.cell.z < 0 && w.sign.z < 0 && side.outside && w.t <= w.tMax) {
        result.state = kMesoHit;
        result.t = w.t;
        result.normal = vec3(0.0, 0.0, 1.0);
    }
}

// f > 0 above the height field; texels along x and y, the slab's height along z.
float reliefHeight(vec2 p) {
    vec2 i = floor(p), w = p - i;
    vec4 h = heightsAt(int(i.x), int(i.y)) * (1.0 / 65535.0);
    return mix(mix(h.x, h.y, w.x), mix(h.z, h.w, w.x), w.y);
}

float reliefF(vec3 o, vec3 d, float t, inout MesoResult result) {
    result.fetches++;
    vec3 p = o + t * d;
    return p.z - reliefHeight(p.xy);
}

float refineRelief(vec3 o, vec3 d, float low, float fLow, float high, float fHigh, inout MesoResult result) {
    if (kRefinement == kMesoUnrefined) return high;
    float t = high;
    int kept = 0;
    for (int i = 0; i < meso.ratio.w; i++) {
        float chord = low + (high - low) * (fLow / (fLow - fHigh));
        t = kRefinement == kMesoBinary || !(chord >= low && chord <= high) ? 0.5 * (low + high) : chord;
        result.iterations++;
        result.tests++;
        float f = reliefF(o, d, t, result);
        if (abs(f) < meso.scale.z || f == 0.0) break;
        if (f > 0.0) {
            if (kRefinement == kMesoIllinois && kept == 1) fHigh *= 0.5;
            low = t;
            fLow = f;
            kept = 1;
        } else {
            if (kRefinement == kMesoIllinois && kept == -1) fLow *= 0.5;
            high = t;
            fHigh = f;
            kept = -1;
        }
    }
    return t;
}

bool isFinite(float x) { return !isnan(x) && !isinf(x); }

// Refines as the listing prints it, with depths from the top.
float refineAsPrinted(vec3 o, vec3 d, float low, float fLow, float high, float fHigh, inout MesoResult result) {
    float slope = -d.z, depth0 = 1.0 - o.z;
    float upperD = low, upperH = depth0 + slope * low + fLow, lowerD = high, lowerH = depth0 + slope * high + fHigh, best = upperH;
    for (int i = 0; i < meso.ratio.w; i++) {
        float lineSlope = (upperH - lowerH) / (upperD - lowerD), at = (upperH - lineSlope * upperD - depth0) / (slope - lineSlope);
        if (!isFinite(at)) break;
        result.iterations++;
        result.tests++;
        float f = reliefF(o, d, at, result), depth = depth0 + slope * at, surface = depth + f;
        best = surface;
        if (surface < depth) {
            upperH = surface;
            upperD = at;
        } else {
            lowerH = surface;
            lowerD = at;
        }
        if (abs(f) <= meso.scale.z) break;
    }
    float t = (best - depth0) / slope;
    return isFinite(t) ? t : high;
}

void marchRelief(MesoRay ray, inout MesoResult result) {
    vec3 scale = vec3(vec2(float(meso.fine.x)), 1.0 / meso.scale.y), o = ray.o * scale, d = ray.d * scale;
    if (ray.atTop) o.z = 1.0;
    float leaves = d.z < 0.0 ? -o.z / d.z : d.z > 0.0 ? (1.0 - o.z) / d.z : 64.0;
    float end = clamp(leaves, 0.0, min(ray.tMax, 64.0));
    bool bottomIsEnd = d.z < 0.0 && end == leaves;
    int steps = meso.fine.w;
    // A piece of a shell has its part of the steps between top and bottom.
    if (ray.isOutside) steps = clamp(int(ceil(float(steps) * end / min(1.0 / max(abs(d.z), 1e-9), 64.0))), 1, steps);
    float low = 0.0, fLow = reliefF(o, d, 0.0, result);
    if (ray.isOutside && fLow <= 0.0) {
        result.state = kMesoHit;
        return;
    }
    for (int i = 1; i <= steps; i++) {
        result.iterations++;
        float high = end * (float(i) / float(steps)), fHigh = reliefF(o, d, high, result);
        // The slab's bottom is below every height, however it rounds.
        if (i == steps && bottomIsEnd) fHigh = min(fHigh, 0.0);
        if (fLow > 0.0 && fHigh <= 0.0) {
            result.state = kMesoHit;
            if (kRefinement == kMesoAsPrinted) result.t = refineAsPrinted(o, d, low, fLow, high, fHigh, result);
            else result.t = refineRelief(o, d, low, fLow, high, fHigh, result);
            return;
        }
        low = high;
        fLow = fHigh;
    }
}

bool solvePyramid(Walk w, float end, inout bool outside, inout MesoResult result) {
    result.fetches++;
    result.tests++;
    float entry = min(walkEntry(w), end);
    vec4 h = heightsAt(w.cell.x, w.cell.y) * (1.0 / 65535.0);
    vec3 o = walkAt(w, entry) - vec3(w.cell);
    CellHit found = firstEntryBilinear(h, o, w.d, 0.0, end - entry, outside);
    outside = found.outside;
    if (!found.hit) return false;
    result.state = kMesoHit;
    result.t = entry + found.t;
    vec3 p = o + found.t * w.d;
    vec2 slope = vec2(mix(h.y - h.x, h.w - h.z, p.y), mix(h.z - h.x, h.w - h.y, p.x));
    result.normal = normalize(vec3(-slope * float(meso.fine.x) * meso.scale.y, 1.0));
    return true;
}

void marchPyramid(MesoRay ray, inout MesoResult result) {
    Walk w = startWalk(ray, ivec3(meso.fine.xy, 1));
    bool outside = w.startsAtTop || ray.isOutside;
    int top = meso.cones.z - 1, level = top;
    while (w.cell.z == 0 && w.t <= w.tMax) {
        if (result.iterations++ == kMostIterations) {
            result.state = kMesoUnresolved;
            return;
        }
        ivec2 home = wrapped2(w.cell.xy, meso.fine.xy), first = (home >> level) << level, last = min(first + (1 << level), meso.fine.xy) - 1;
        ivec3 further = ivec3(mix(home - first, last - home, greaterThan(w.sign.xy, ivec2(0))), 0);
        int axisOut;
        float exit = walkExit(w, further, axisOut), end = max(w.t, min(exit, w.tMax));
        result.fetches++;
        uvec4 maxima = meso.levels[level];
        ivec2 entry = home >> level;
        float most = float(fetchShort(maxima.x, uint(entry.y) * maxima.y + uint(entry.x))) * (1.0 / 65535.0);
        // Where the ray leaves by the slab's bottom its height is 0, however that rounds: ground at 0 is a tie there.
        float atEnd = axisOut == 2 && end == exit ? float(w.sign.z > 0) : walkAt(w, end).z, lowest = min(walkAt(w, w.t).z, atEnd);
        bool isAbove = lowest > most && (outside || level > 0 || w.t > 0.0);
        if (!isAbove && level > 0) {
            level--;
            continue;
        }
        if (isAbove) outside = true;
        else if (solvePyramid(w, end, outside, result)) return;
        if (exit >= kFar) break;
        walkLeave(w, further, exit, axisOut);
        if (isAbove) level = min(level + 1, top);
    }
    if (w.cell.z < 0 && w.sign.z < 0 && outside && w.t <= w.tMax) {
        result.state = kMesoHit;
        result.t = w.t;
        result.normal = vec3(0.0, 0.0, 1.0);
    }
}

// Returns the distances at the cells' centres, trilinear between them; z does not repeat.
void sphereCorners(vec3 p, out vec4 v0, out vec4 v1, out vec3 w) {
    vec3 at = p / meso.cell.xyz - 0.5, first = floor(at);
    w = at - first;
    ivec3 cell = ivec3(first);
    ivec2 a = wrapped2(cell.xy, meso.cells.xy), b = wrapped2(cell.xy + 1, meso.cells.xy), z = clamp(ivec2(cell.z, cell.z + 1), 0, meso.cells.z - 1);
    for (int i = 0; i < 4; i++) {
        uint column = uint(((i & 1) == 0 ? a.x : b.x) + meso.cells.x * ((i & 2) == 0 ? a.y : b.y)), plane = uint(meso.cells.x * meso.cells.y);
        v0[i] = signedShort(fetchShort(meso.at.y, column + uint(z.x) * plane));
        v1[i] = signedShort(fetchShort(meso.at.y, column + uint(z.y) * plane));
    }
}

float sphereSample(vec3 p, inout MesoResult result) {
    result.fetches++;
    vec4 v0, v1;
    vec3 w;
    sphereCorners(p, v0, v1, w);
    vec4 v = mix(v0, v1, w.z);
    return mix(mix(v.x, v.y, w.x), mix(v.z, v.w, w.x), w.y) * meso.scale.x;
}

void marchSphere(MesoRay ray, inout MesoResult result) {
    bool outside = ray.isOutside;
    float top = meso.extent.z;
    for (float t = 0.0; t <= ray.tMax;) {
        vec3 p = ray.o + t * ray.d;
        if (p.z < 0.0 ? ray.d.z <= 0.0 : p.z > top && ray.d.z >= 0.0) return;
        if (result.iterations++ == uint(meso.fine.w)) {
            result.state = kMesoUnresolved;
            return;
        }
        float len = sphereSample(p, result);
        if (len >= meso.cell.w) outside = true;
        else if (outside || (t == 0.0 && (p.z >= top || ray.atTop))) {
            result.state = kMesoHit;
            result.t = t;
            return;
        }
        t += max(len, outside ? 0.0 : meso.cell.x * 0.25);
    }
}

MesoResult marchMeso(MesoRay ray) {
    MesoResult result = MesoResult(kMesoMiss, 0.0, vec3(0.0), 0u, 0u, 0u);
    if (kWalk == kMesoRelief) marchRelief(ray, result);
    else if (kWalk == kMesoPyramid) marchPyramid(ray, result);
    else if (kWalk == kMesoSphere) marchSphere(ray, result);
    else marchGrid(ray, result);
    return result;
}
