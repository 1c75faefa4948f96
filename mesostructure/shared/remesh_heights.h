// Heights of filter levels (mesostructure/remesh/height_levels.h) in C++ and GLSL. A level is read as RemeshLevel: its
// `size` in texels, and its `texels` in a tile unit along x and y. Whoever includes this has
//   RemeshLevel remeshLevel(int level)                             a level's size and where it is stored
//   uvec4 remeshTexels(CONST_REF(RemeshLevel) level, ivec2 at)     its heights at a texel, of 65535, and after it along
//                                                                  x, along y, and along both: from all sides, it
//                                                                  repeats
//   RemeshLevel remeshThere(CONST_REF(RemeshLevel) level, Real2 at)  the level, or the next coarser one that is there
//   at
//                                                                  a place
//   int remeshLevels()                                             how many there are

// Returns the height of a texel: one product, rounded alike everywhere.
INLINE Real remeshTexelHeight(uint texel) {
    PRECISE Real height = Real(texel) * Real(1.5259021896696422e-5);
    return height;
}

// Returns the remainder of a whole number by n, from 0 to n - 1.
INLINE int remeshWrapped(Real x, int n) {
    PRECISE Real turns = floor((x + Real(0.5)) / Real(n));
    return clamp(int(x - turns * Real(n)), 0, n - 1);
}

// Returns the height of a level at a place in tile units, bilinear; levels repeat as the map does.
INLINE Real remeshLevelHeight(CONST_REF(RemeshLevel) wanted, Real2 at) {
    RemeshLevel level = remeshThere(wanted, at);
    PRECISE Real x = at.x * level.texels.x, y = at.y * level.texels.y;
    PRECISE Real left = floor(x), lower = floor(y), u = x - left, v = y - lower;
    uvec4 texels = remeshTexels(level, ivec2(remeshWrapped(left, level.size.x), remeshWrapped(lower, level.size.y)));
    PRECISE Real low = remeshTexelHeight(texels.x) * (Real(1) - u) + remeshTexelHeight(texels.y) * u;
    PRECISE Real high = remeshTexelHeight(texels.z) * (Real(1) - u) + remeshTexelHeight(texels.w) * u;
    PRECISE Real height = low * (Real(1) - v) + high * v;
    return height;
}

// Returns log2 of a number of at least 1 within 1e-10, of sums and products alone: the same on every device, where
// log2 itself may be off by 3 units of the last place. The series of the inverse hyperbolic tangent.
INLINE Real remeshLog2(Real x) {
    int exponent = 0;
    while (x >= Real(1.4142135) && exponent < 64) {
        x = x * Real(0.5);
        ++exponent;
    }
    PRECISE Real s = (x - Real(1)) / (x + Real(1)), t = s * s;
    PRECISE Real sum =
        Real(1) +
        t * (Real(1.0 / 3) + t * (Real(1.0 / 5) + t * (Real(1.0 / 7) + t * (Real(1.0 / 9) + t * Real(1.0 / 11)))));
    PRECISE Real logarithm = Real(exponent) + Real(2.8853900817779268) * s * sum;
    return logarithm;
}

// The two levels whose texels are as large as a footprint, and the part of the coarser one, by the logarithm.
struct RemeshFootprint {
    RemeshLevel fine, coarse;
    Real part;
};

// `texels`: the footprint's edge, in texels.
INLINE RemeshFootprint remeshFootprint(Real texels) {
    int top = remeshLevels() - 1;
    PRECISE Real level = texels > Real(1) ? min(remeshLog2(min(texels, Real(1e12))), Real(top)) : Real(0);
    PRECISE Real whole = floor(level), part = level - whole;
    RemeshFootprint made;
    made.fine = remeshLevel(int(whole));
    made.coarse = remeshLevel(min(int(whole) + 1, top));
    made.part = part;
    return made;
}

// Returns the height at a place for a footprint.
INLINE Real remeshHeight(CONST_REF(RemeshFootprint) footprint, Real2 at) {
    Real fine = remeshLevelHeight(footprint.fine, at);
    if (footprint.part <= Real(0)) return fine;
    PRECISE Real height = fine * (Real(1) - footprint.part) + remeshLevelHeight(footprint.coarse, at) * footprint.part;
    return height;
}
