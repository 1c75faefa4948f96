// What a ray does in an occupied cell of a grid. Compiles as march_data.h does.

// What a surface remembers of a ray from cell to cell.
struct Side {
    bool outside;
    bool inRun;  // all cells since the ray's start were occupied
};

INLINE bool meetPatches(CONST_REF(Walk) w, float from, float to, INOUT(MesoResult) result) {
    result.fetches++;
    uint cell = cellIndex(w.cell, meso.cells), bit = 1u << (cell & 31u), rank = meso.data + 2u * (cell >> 5);
    uint mask = fetchWord(rank);
    if ((mask & bit) == 0u) return false;
    result.fetches++;
    uint row = fetchWord(meso.rows + fetchWord(rank + 1u) + uint(bitCount(mask & (bit - 1u))));
    vec3 o = walkAt(w, from) - vec3(w.cell), gradient = vec3(0.0f);
    vec2 at = vec2(0.0f);
    uint number = 0u, isTriangle = 0u;
    float best = kFar;
    for (uint i = row >> 4; i < (row >> 4) + (row & 15u); ++i) {
        // A patch is read in groups of four words: ten coefficients, two linear forms.
        result.fetches += 5u;
        result.tests++;
        Patch it = fetchPatch(i);
        float s = crossPatch(it, o, w.d, to - from);
        if (s >= 0.0f && s < best) {
            vec3 p = o + s * w.d;
            best = s;
            gradient = patchGradient(it, p);
            at = vec2(dot(it.u, vec4(p, 1.0f)), dot(it.v, vec4(p, 1.0f)));
            number = i;
            isTriangle = it.isTriangle;
        }
    }
    if (best >= kFar) return false;
    result.t = from + best;
    vec3 normal = gradient / meso.cell;
    // It is read once a ray and changes no hit, so it is not counted.
    if (meso.patchNormals != 0u)
        normal = blendNormals(fetchQuad(meso.patchNormals + number), at, isTriangle != 0u, normal);
    // A patch has no inside: it shows the side that the ray comes to.
    result.normal = normalize(dot(gradient, w.d) > 0.0f ? -normal : normal);
    return true;
}

INLINE CellHit solveHeights(CONST_REF(Walk) w, ivec3 at, vec3 o, vec3 d, float from, float to, bool outside,
                            INOUT(MesoResult) result) {
    result.fetches++;
    result.tests++;
    vec4 h = heightsAt(w.cell.x * meso.ratio.x + at.x, w.cell.y * meso.ratio.y + at.y) * meso.step -
             float(w.cell.z) * meso.cell.z;
    vec3 scale = vec3(1.0f, 1.0f, meso.cell.z);
    CellHit found = firstEntryBilinear(h, o * scale, d * scale, from, to, outside);
    if (found.hit) {
        vec2 slope = slopeBilinear(h, o + found.t * d) * vec2(ivec2(meso.ratio)) / vec2(meso.cell);
        result.normal = normalize(vec3(-slope, 1.0f));
    }
    return found;
}

// Returns the gradient of a field at p in a cell, over the cell's edges, without the jumps of gradientTrilinear at
// walls. Along its own axis a part of that is constant in a cell, and right in the middle: it is blended from middle to
// middle. It changes no hit, so its three reads are not counted.
INLINE vec3 gradientOfField(ivec3 cell, vec4 v0, vec4 v1, vec3 p) {
    vec3 inside = gradientTrilinear(v0, v1, p), beyond = inside;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 next = cell;
        next[axis] += p[axis] > 0.5f ? 1 : -1;
        if (next.z < 0 || next.z >= meso.fine.z) continue;
        fieldAt(next, v0, v1);
        beyond[axis] = gradientTrilinear(v0, v1, p)[axis];
    }
    return mix(inside, beyond, abs(p - 0.5f));
}

INLINE CellHit solveField(CONST_REF(Walk) w, ivec3 at, vec3 o, vec3 d, float from, float to, bool outside,
                          INOUT(MesoResult) result) {
    result.fetches += 2u;
    result.tests++;
    vec4 v0, v1;
    fieldAt(w.cell * meso.ratio + at, v0, v1);
    int side = sideTrilinear(v0, v1);
    if (side > 0) return noEntry(true);
    if (side < 0 && !outside) return noEntry(false);
    CellHit found = firstEntryTrilinear(v0, v1, o, d, from, to, outside);
    if (found.hit) {
        vec3 gradient = gradientOfField(w.cell * meso.ratio + at, v0, v1, o + found.t * d);
        result.normal = normalize(gradient * vec3(meso.ratio) / meso.cell);
    }
    return found;
}

// The small cells of finer data within a cell of the grid, which a ray meets from wall to wall.
struct SmallWalk {
    vec3 o, d;    // in small cells; the ray starts at the wall of the grid's cell, where numbers are small
    float s;      // tile units from there
    ivec3 ratio;  // small cells along the axes
    ivec3 at, sign;
    int left;  // small cells that a line may yet cross
};

INLINE SmallWalk startSmallWalk(CONST_REF(Walk) w, float from, ivec3 ratio) {
    SmallWalk small;
    small.o = (walkAt(w, from) - vec3(w.cell)) * vec3(ratio);
    small.d = w.d * vec3(ratio);
    small.s = 0.0f;
    small.ratio = ratio;
    small.at = clamp(ivec3(floor(small.o)), ivec3(0), ratio - 1);
    small.sign = w.sign;
    small.left = ratio.x + ratio.y + ratio.z;
    return small;
}

// Moves on to the next small cell, at its wall; without one, or after `span`, none is left.
INLINE void leaveSmallCell(INOUT(SmallWalk) small, float span) {
    bvec3 still = equal(small.sign, ivec3(0));
    vec3 ahead = vec3(small.at + ivec3(greaterThan(small.sign, ivec3(0))));
    vec3 walls = mix((ahead - small.o) / small.d, vec3(kFar), still);
    float first = min(walls.x, min(walls.y, walls.z)), end = max(small.s, min(first, span));
    int axis = first == walls.x ? 0 : first == walls.y ? 1 : 2;
    small.at += small.sign * ivec3(equal(ivec3(axis), ivec3(0, 1, 2)));
    small.left--;
    bool isOut = any(lessThan(small.at, ivec3(0))) || any(greaterThanEqual(small.at, small.ratio));
    if (first >= kFar || end >= span || isOut) small.left = 0;
    small.s = end;
}

// Meets the texels of a height map.
INLINE bool meetHeights(CONST_REF(Walk) w, float from, float to, INOUT(Side) side, INOUT(MesoResult) result) {
    SmallWalk small = startSmallWalk(w, from, ivec3(ivec2(meso.ratio), 1));
    // A texel is as high as the cell.
    small.sign.z = 0;
    while (small.left > 0) {
        ivec3 at = small.at;
        float start = small.s;
        leaveSmallCell(small, to - from);
        CellHit found = solveHeights(w, at, small.o - vec3(at), small.d, start, small.s, side.outside, result);
        if (found.hit) {
            result.t = from + found.t;
            return true;
        }
        side.outside = found.outside;
    }
    return false;
}

// Meets the small cells of a field; where marks say so, only those that the surface passes.
INLINE bool meetField(CONST_REF(Walk) w, float from, float to, uint marks, INOUT(Side) side, INOUT(MesoResult) result) {
    if (meso.ratio != ivec3(2) || (marks & kMesoSmallCells) == 0u) marks = 0u;
    SmallWalk small = startSmallWalk(w, from, meso.ratio);
    while (small.left > 0) {
        float start = small.s;
        bool passes = false;
        ivec3 at = small.at;
        // As in marchGrid, all rays look first, then all solve.
        while (!passes && small.left > 0) {
            at = small.at;
            start = small.s;
            passes = marks == 0u || ((marks >> uint(at.x + 2 * at.y + 4 * at.z)) & 1u) != 0u;
            leaveSmallCell(small, to - from);
        }
        if (!passes) return false;
        CellHit found = solveField(w, at, small.o - vec3(at), small.d, start, small.s, side.outside, result);
        if (found.hit) {
            result.t = from + found.t;
            return true;
        }
        side.outside = found.outside;
    }
    return false;
}

INLINE bool meetSurface(CONST_REF(Walk) w, float from, float to, uint marks, INOUT(Side) side,
                        INOUT(MesoResult) result) {
    if (kSurface == kMesoPatches) return meetPatches(w, from, to, result);
    if (kSurface == kMesoHeights) return meetHeights(w, from, to, side, result);
    if (kSurface == kMesoField) return meetField(w, from, to, marks, side, result);
    if (side.inRun && !w.startsAtTop) return false;
    result.t = from;
    return true;
}
