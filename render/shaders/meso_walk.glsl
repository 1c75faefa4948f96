// A ray among the cells of a grid, in integers; the GLSL of mesostructure/grid_walk.h.

const float kFar = 1e30;
const uint kMostIterations = 8192u;

struct MesoRay {
    vec3 o, d;       // tile space, in the first tile; unit direction
    float tMax;      // tile units
    bool atTop;      // starts on the slab's top, or above it
    bool isOutside;  // known to be outside the solid before the start, as a ray that comes from another piece of a
                     // shell is
};

struct MesoResult {
    uint state;
    float t;
    vec3 normal;  // 0 where the method knows none
    uint iterations, fetches, tests;
};

struct Walk {
    vec3 o, d, inverse;  // cells
    float t, tMax;
    ivec3 cell, sign;
    bool startsAtTop;
};

// Returns i modulo n, for n > 0.
int wrapped(int i, int n) {
    int rest = i - n * int(floor((float(i) + 0.5) / float(n)));
    return rest < 0 ? rest + n : rest >= n ? rest - n : rest;
}
ivec2 wrapped2(ivec2 i, ivec2 n) { return ivec2(wrapped(i.x, n.x), wrapped(i.y, n.y)); }

uint gridIndex(ivec3 at, ivec2 cells) { return uint(wrapped(at.x, cells.x) + cells.x * (wrapped(at.y, cells.y) + cells.y * at.z)); }

Walk startWalk(MesoRay ray, ivec3 cells) {
    Walk w;
    vec3 scale = vec3(cells) / meso.extent.xyz;
    w.o = ray.o * scale;
    w.d = ray.d * scale;
    w.t = 0.0;
    w.tMax = min(ray.tMax, 1e6);
    w.startsAtTop = ray.atTop && w.d.z < 0.0;
    // The slab's top is a wall, however it rounds.
    w.o.z = ray.atTop ? float(cells.z) : clamp(w.o.z, 0.0, float(cells.z));
    w.sign = ivec3(sign(w.d));
    w.inverse = mix(vec3(0.0), 1.0 / w.d, notEqual(w.sign, ivec3(0)));
    w.cell = ivec3(floor(w.o));
    // On a wall, the cell is the one that the ray enters.
    w.cell -= ivec3(lessThan(w.sign, ivec3(0))) * ivec3(equal(w.o, floor(w.o)));
    return w;
}

vec3 walkAt(Walk w, float time) { return w.o + time * w.d; }

float walkEntry(Walk w) {
    vec3 walls = (vec3(w.cell + ivec3(lessThan(w.sign, ivec3(0)))) - w.o) * w.inverse;
    walls = mix(walls, vec3(0.0), equal(w.sign, ivec3(0)));
    return max(0.0, max(walls.x, max(walls.y, walls.z)));
}

// axisOut is -1 where the ray never leaves.
float walkExit(Walk w, ivec3 further, out int axisOut) {
    ivec3 next = mix(w.cell - further, w.cell + further + 1, greaterThan(w.sign, ivec3(0)));
    vec3 walls = mix((vec3(next) - w.o) * w.inverse, vec3(kFar), equal(w.sign, ivec3(0)));
    float first = min(kFar, min(walls.x, min(walls.y, walls.z)));
    axisOut = first >= kFar ? -1 : first == walls.x ? 0 : first == walls.y ? 1 : 2;
    return first;
}

// Moves never backwards, and by at most `further` cells.
ivec3 movedTo(Walk w, vec3 p, ivec3 further) {
    ivec3 target = ivec3(floor(p));
    ivec3 forwards = clamp(target, w.cell, w.cell + further), back = clamp(target, w.cell - further, w.cell);
    return mix(mix(w.cell, back, lessThan(w.sign, ivec3(0))), forwards, greaterThan(w.sign, ivec3(0)));
}

void walkLeave(inout Walk w, ivec3 further, float time, int axisOut) {
    w.t = max(w.t, time);
    w.cell = mix(movedTo(w, walkAt(w, w.t), further), w.cell + w.sign * (further + 1), equal(ivec3(axisOut), ivec3(0, 1, 2)));
}

void walkJump(inout Walk w, float time) {
    w.t = time;
    w.cell = movedTo(w, walkAt(w, time), ivec3(1 << 28));
}
