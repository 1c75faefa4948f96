// A ray among the cells of a grid, in the grid's own units and integer cells; t stays in tile units. Compiles as GLSL
// and as C++ (mesostructure/march_math.h).

const float kFar = 1e30f;       // in place of a wall that a parallel ray never meets
const float kMostReach = 1e6f;  // tile units that a ray travels at most

struct MesoRay {
    vec3 o, d;       // tile space, in the first tile; unit direction
    float tMax;      // tile units
    bool atTop;      // starts on the slab's top, or above it
    bool isOutside;  // known to be outside the solid before the start, as a ray that comes from another piece of a
                     // shell is
    float bend;      // MarchRay::bend; 0: the ray is straight
};

struct MesoResult {
    uint state;
    float t;
    vec3 normal;  // 0 where the method knows none
    uint iterations, fetches, tests;
};

struct Walk {
    vec3 o, d, inverse;  // in cells; 1 / d, where d is not 0
    float t, tMax;
    ivec3 cell, sign;
    bool startsAtTop;
};

// Returns i modulo n, for n > 0. The quotient is off by at most one, as rays travel no more than 2^20 tiles.
INLINE int wrappedCell(int i, int n) {
    int rest = i - n * int(float(i) / float(n));
    return rest < 0 ? rest + n : rest >= n ? rest - n : rest;
}
INLINE ivec2 wrappedCells(int x, int y, ivec2 n) { return ivec2(wrappedCell(x, n.x), wrappedCell(y, n.y)); }

// Returns the cells after those that wrappedCells returned.
INLINE ivec2 nextCells(ivec2 at, ivec2 n) {
    return ivec2(at.x + 1 < n.x ? at.x + 1 : 0, at.y + 1 < n.y ? at.y + 1 : 0);
}

// Returns a cell's index; x is fastest, x and y wrap.
INLINE uint cellIndex(ivec3 at, ivec3 cells) {
    return uint(wrappedCell(at.x, cells.x) + cells.x * (wrappedCell(at.y, cells.y) + cells.y * at.z));
}

INLINE Walk startWalk(MesoRay ray, ivec3 cells, vec3 extent) {
    Walk w;
    vec3 scale = vec3(cells) / extent;
    w.o = ray.o * scale;
    w.d = ray.d * scale;
    w.t = 0.0f;
    w.tMax = min(ray.tMax, kMostReach);
    w.startsAtTop = ray.atTop && w.d.z < 0.0f;
    // The slab's top is a wall, however it rounds.
    w.o.z = ray.atTop ? float(cells.z) : clamp(w.o.z, 0.0f, float(cells.z));
    w.sign = ivec3(sign(w.d));
    w.inverse = mix(vec3(0.0f), 1.0f / w.d, notEqual(w.sign, ivec3(0)));
    w.cell = ivec3(floor(w.o));
    // On a wall, the cell is the one that the ray enters.
    w.cell -= ivec3(lessThan(w.sign, ivec3(0))) * ivec3(equal(w.o, floor(w.o)));
    return w;
}

// Octant o is towards +x, +y, +z where its bits 0, 1, 2 are 0, and towards - where they are 1.
INLINE int octantOf(vec3 d) { return int(d.x < 0.0f) | int(d.y < 0.0f) << 1 | int(d.z < 0.0f) << 2; }

INLINE vec3 walkAt(CONST_REF(Walk) w, float time) { return w.o + time * w.d; }

// Returns when the ray comes through the wall of its cell along one axis, or through that `further` cells ahead.
INLINE float wallBehind(int cell, int sign, float o, float inverse) {
    return sign == 0 ? 0.0f : (float(sign < 0 ? cell + 1 : cell) - o) * inverse;
}
INLINE float wallAhead(int cell, int sign, float o, float inverse, int further) {
    return sign == 0 ? kFar : (float(sign > 0 ? cell + further + 1 : cell - further) - o) * inverse;
}

// Returns when the ray comes through the walls of the cell that it is in.
INLINE float walkEntry(CONST_REF(Walk) w) {
    float x = wallBehind(w.cell.x, w.sign.x, w.o.x, w.inverse.x),
          y = wallBehind(w.cell.y, w.sign.y, w.o.y, w.inverse.y),
          z = wallBehind(w.cell.z, w.sign.z, w.o.z, w.inverse.z);
    return max(0.0f, max(x, max(y, z)));
}

// Returns when it leaves a box of `further` more cells; kFar where it never does. axisOut: by which axis, or -1.
INLINE float walkExit(CONST_REF(Walk) w, ivec3 further, OUT(int) axisOut) {
    float x = wallAhead(w.cell.x, w.sign.x, w.o.x, w.inverse.x, further.x),
          y = wallAhead(w.cell.y, w.sign.y, w.o.y, w.inverse.y, further.y),
          z = wallAhead(w.cell.z, w.sign.z, w.o.z, w.inverse.z, further.z);
    float first = min(kFar, min(x, min(y, z)));
    axisOut = first >= kFar ? -1 : first == x ? 0 : first == y ? 1 : 2;
    return first;
}

// Moves along one axis to a place p, never backwards, and by at most `further` cells.
INLINE int movedTo(int cell, int sign, float p, int further) {
    int target = int(floor(p));
    return sign > 0 ? clamp(target, cell, cell + further) : sign < 0 ? clamp(target, cell - further, cell) : cell;
}

// Leaves the box by whole cells along the axis of its exit; along the others it stays within the box.
INLINE void walkLeave(INOUT(Walk) w, ivec3 further, float time, int axisOut) {
    w.t = max(w.t, time);
    vec3 p = walkAt(w, w.t);
    ivec3 over = w.cell + w.sign * (further + 1);
    w.cell.x = axisOut == 0 ? over.x : movedTo(w.cell.x, w.sign.x, p.x, further.x);
    w.cell.y = axisOut == 1 ? over.y : movedTo(w.cell.y, w.sign.y, p.y, further.y);
    w.cell.z = axisOut == 2 ? over.z : movedTo(w.cell.z, w.sign.z, p.z, further.z);
}

// Moves to a point of the ray that need not be on a wall.
INLINE void walkJump(INOUT(Walk) w, float time) {
    const int kAnywhere = 1 << 28;
    w.t = time;
    vec3 p = walkAt(w, time);
    w.cell = ivec3(movedTo(w.cell.x, w.sign.x, p.x, kAnywhere), movedTo(w.cell.y, w.sign.y, p.y, kAnywhere),
                   movedTo(w.cell.z, w.sign.z, p.z, kAnywhere));
}
