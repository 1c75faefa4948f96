// The way of a straight ray through the slab over a base that bends: in tile space, which follows the base, it is a
// curve. Compiles as GLSL and as C++ (Real: float or double; mesostructure/march_math.h, mesostructure/gdm/bent_ray.h).
//
// In the plane of the ray and the base's normal the base is an arc of normal curvature c = 1 / R, above 0 where it
// bends away from the slab. Heights z are counted from the arc, s along it. With g = 1 + c z0 (a length of the arc is
// so much longer at the start's height), a ray of tile direction (run, rise) is at the time t at
//
//   r = sqrt((g + c t rise)^2 + (c t g run)^2)          its distance from the arc's middle, in radii
//   z = (r - 1) / c,    s = atan(c t g run / (g + c t rise)) / c
//
// exactly. With cot = -rise / run that is z = z0 - s cot + (c g / 2 + c cot^2 / g) s^2 to second order; the second term
// is there since lengths along the arc change with the height. All forms below have c as a factor only, so c = 0 is the
// straight ray.

struct BentPath {
    Real c;          // 1 over tile units; 1 + c z is above 0 wherever the path is asked for
    Real z;          // height of the start
    Real run, rise;  // unit direction at the start in tile space: along the base, not below 0, and up
};

// Returns the angle of a place from the x axis, in turns from 0 to 1. A polynomial, so that devices and processors
// agree: their own functions may be off by thousands of units of the last place (Abramowitz and Stegun 4.4.49).
INLINE Real turnOf(Real x, Real y) {
    Real ax = abs(x), ay = abs(y), most = max(ax, ay);
    if (most == Real(0.0)) return Real(0.0);
    Real a = min(ax, ay) / most, s = a * a;
    Real p = Real(0.0028662257) * s - Real(0.0161657367);
    p = p * s + Real(0.0429096138);
    p = p * s - Real(0.0752896400);
    p = p * s + Real(0.1065626393);
    p = p * s - Real(0.1420889944);
    p = p * s + Real(0.1999355085);
    p = p * s - Real(0.3333314528);
    Real turn = (a + a * s * p) * Real(0.15915494309);
    if (ay > ax) turn = Real(0.25) - turn;
    if (x < Real(0.0)) turn = Real(0.5) - turn;
    return y < Real(0.0) ? Real(1.0) - turn : turn;
}

INLINE Real bentStretch(BentPath p) { return Real(1.0) + p.c * p.z; }

INLINE Real bentRadius(BentPath p, Real t) {
    Real g = bentStretch(p), above = g + p.c * t * p.rise, along = p.c * t * g * p.run;
    return sqrt(above * above + along * along);
}

INLINE Real bentHeight(BentPath p, Real t) {
    Real g = bentStretch(p), square = p.rise * p.rise + g * g * p.run * p.run;
    return p.z + t * (Real(2.0) * g * p.rise + p.c * t * square) / (bentRadius(p, t) + g);
}

// Returns how far along the base the path is at a time; below 0 before the start.
INLINE Real bentAlong(BentPath p, Real t) {
    Real g = bentStretch(p), above = g + p.c * t * p.rise, along = p.c * t * g * p.run;
    if (above > Real(0.0) && abs(along) < Real(1e-4) * above) return t * g * p.run / above;
    Real length = turnOf(above, abs(along)) * Real(6.28318530718) / abs(p.c);
    return t < Real(0.0) ? -length : length;
}

// Returns what the path's tile direction is at a time, not unit: along the base and up.
INLINE Real2 bentHeading(BentPath p, Real t) {
    Real g = bentStretch(p), r = bentRadius(p, t), run = g * p.run;
    return Real2(run * g / (r * r), ((g + p.c * t * p.rise) * p.rise + p.c * t * run * run) / r);
}

// Finds the time nearest to the start at which the path is at a height: before the start for a height that it comes
// down from. A path that bends away before it gets there does not reach it.
INLINE bool bentReaches(BentPath p, Real z, OUT(Real) t) {
    t = Real(0.0);
    if (z == p.z) return true;
    Real g = bentStretch(p), k = (p.z - z) * (g + Real(1.0) + p.c * z), b = g * p.rise,
         a = p.c * (p.rise * p.rise + g * g * p.run * p.run), square = b * b - a * k;
    if (square < Real(0.0)) return false;
    Real root = b > Real(0.0) ? -b - sqrt(square) : sqrt(square) - b;
    if (root == Real(0.0)) return false;
    t = k / root;
    return true;
}

// Returns when a path that goes down from its start leaves the slab: by the bottom, or where the base bends away first,
// by the height that it started at. `byBottom` says which.
INLINE Real bentExit(BentPath p, OUT(bool) byBottom) {
    Real t, g = bentStretch(p);
    byBottom = bentReaches(p, Real(0.0), t);
    if (byBottom) return t;
    return Real(-2.0) * g * p.rise / (p.c * (p.rise * p.rise + g * g * p.run * p.run));
}

// Returns the curvature of a base over which a path along the slab bends upwards by `bend` at a height: its second
// derivative of z over s, c (1 + c z).
INLINE Real curvatureOfBend(Real bend, Real z) {
    return Real(2.0) * bend / (Real(1.0) + sqrt(max(Real(1.0) + Real(4.0) * bend * z, Real(0.0))));
}
