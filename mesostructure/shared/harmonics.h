// Real spherical harmonics of bands 0 to 3, orthonormal over the sphere: 1; x, y, z; xy, yz, xz, 3 z z - 1, x x - y y;
// y (3 x x - y y), xyz, y (5 z z - 1), z (5 z z - 3), x (5 z z - 1), z (x x - y y), x (x x - 3 y y). Compiles as C++
// (mesostructure/harmonics.h) and as GLSL.
struct Harmonics {
    Real c[16];
};

const float kBand0 = 0.28209479f, kBand1 = 0.48860251f;
const float kBand2Mixed = 1.09254843f, kBand2Axis = 0.31539157f, kBand2Square = 0.54627422f;
const float kBand3Outer = 0.59004359f, kBand3Mixed = 2.89061144f, kBand3Near = 0.45704580f, kBand3Axis = 0.37317633f,
            kBand3Square = 1.44530572f;

// Returns the values of the functions in a direction, a unit vector.
INLINE Harmonics harmonicsOf(Real3 d) {
    Harmonics h;
    Real x = d.x, y = d.y, z = d.z;
    h.c[0] = Real(kBand0);
    h.c[1] = Real(kBand1) * x;
    h.c[2] = Real(kBand1) * y;
    h.c[3] = Real(kBand1) * z;
    h.c[4] = Real(kBand2Mixed) * x * y;
    h.c[5] = Real(kBand2Mixed) * y * z;
    h.c[6] = Real(kBand2Mixed) * x * z;
    h.c[7] = Real(kBand2Axis) * (Real(3.0) * z * z - Real(1.0));
    h.c[8] = Real(kBand2Square) * (x * x - y * y);
    h.c[9] = Real(kBand3Outer) * y * (Real(3.0) * x * x - y * y);
    h.c[10] = Real(kBand3Mixed) * x * y * z;
    h.c[11] = Real(kBand3Near) * y * (Real(5.0) * z * z - Real(1.0));
    h.c[12] = Real(kBand3Axis) * z * (Real(5.0) * z * z - Real(3.0));
    h.c[13] = Real(kBand3Near) * x * (Real(5.0) * z * z - Real(1.0));
    h.c[14] = Real(kBand3Square) * z * (x * x - y * y);
    h.c[15] = Real(kBand3Outer) * x * (x * x - Real(3.0) * y * y);
    return h;
}

// Returns the coefficients of max(0, n . d) / pi: what a flat, white, open surface gives back of the light from d
// (Ramamoorthi and Hanrahan 2001, equation 8). Band 3 is 0.
INLINE Harmonics clampedCosine(Real3 n) {
    Harmonics h = harmonicsOf(n);
    for (int i = 1; i < 4; i++) h.c[i] *= Real(2.0 / 3.0);
    for (int i = 4; i < 9; i++) h.c[i] *= Real(0.25);
    for (int i = 9; i < 16; i++) h.c[i] = Real(0.0);
    return h;
}

// Returns the coefficients of f(transposed frame * d) where `h` are those of f: a function of directions in a frame as
// one of directions in the world. `frame`: orthonormal, its columns are the frame's axes; it may mirror. A band is a
// form whose trace is 0, and turns as one.
INLINE Harmonics turnedHarmonics(Harmonics h, Real3x3 frame) {
    Harmonics t;
    t.c[0] = h.c[0];
    Real3 v = frame * Real3(h.c[1], h.c[2], h.c[3]);
    t.c[1] = v.x;
    t.c[2] = v.y;
    t.c[3] = v.z;

    Real3x3 back = transpose(frame);
    Real xy = Real(kBand2Mixed) / Real(2.0) * h.c[4], yz = Real(kBand2Mixed) / Real(2.0) * h.c[5],
         xz = Real(kBand2Mixed) / Real(2.0) * h.c[6], axis = Real(kBand2Axis) * h.c[7],
         square = Real(kBand2Square) * h.c[8];
    Real3x3 q = frame * Real3x3(square - axis, xy, xz, xy, -square - axis, yz, xz, yz, Real(2.0) * axis) * back;
    t.c[4] = q[0][1] * Real(2.0) / Real(kBand2Mixed);
    t.c[5] = q[1][2] * Real(2.0) / Real(kBand2Mixed);
    t.c[6] = q[0][2] * Real(2.0) / Real(kBand2Mixed);
    t.c[7] = q[2][2] / (Real(2.0) * Real(kBand2Axis));
    t.c[8] = (q[0][0] - q[1][1]) / (Real(2.0) * Real(kBand2Square));

    // The symmetric tensor T of three indices whose cubic form is the band.
    Real outerY = Real(kBand3Outer) * h.c[9], mixed = Real(kBand3Mixed) * h.c[10], nearY = Real(kBand3Near) * h.c[11],
         along = Real(kBand3Axis) * h.c[12], nearX = Real(kBand3Near) * h.c[13], sides = Real(kBand3Square) * h.c[14],
         outerX = Real(kBand3Outer) * h.c[15];
    Real third = Real(1.0 / 3.0);
    Real xxx = outerX - nearX, xxy = outerY - nearY * third, xxz = sides * third - along, xyy = -outerX - nearX * third,
         xyz = mixed / Real(6.0), xzz = Real(4.0) * third * nearX, yyy = -outerY - nearY, yyz = -sides * third - along,
         yzz = Real(4.0) * third * nearY, zzz = Real(2.0) * along;
    Real3x3 sliceX = frame * Real3x3(xxx, xxy, xxz, xxy, xyy, xyz, xxz, xyz, xzz) * back;
    Real3x3 sliceY = frame * Real3x3(xxy, xyy, xyz, xyy, yyy, yyz, xyz, yyz, yzz) * back;
    Real3x3 sliceZ = frame * Real3x3(xxz, xyz, xzz, xyz, yyz, yzz, xzz, yzz, zzz) * back;
    Real3x3 tx = frame[0][0] * sliceX + frame[1][0] * sliceY + frame[2][0] * sliceZ,
            ty = frame[0][1] * sliceX + frame[1][1] * sliceY + frame[2][1] * sliceZ,
            tz = frame[0][2] * sliceX + frame[1][2] * sliceY + frame[2][2] * sliceZ;
    nearX = tx[2][2] * Real(0.75);
    nearY = ty[2][2] * Real(0.75);
    t.c[9] = -(ty[1][1] + nearY) / Real(kBand3Outer);
    t.c[10] = tx[1][2] * Real(6.0) / Real(kBand3Mixed);
    t.c[11] = nearY / Real(kBand3Near);
    t.c[12] = tz[2][2] / (Real(2.0) * Real(kBand3Axis));
    t.c[13] = nearX / Real(kBand3Near);
    t.c[14] = (tz[0][0] - tz[1][1]) * Real(1.5) / Real(kBand3Square);
    t.c[15] = (tx[0][0] + nearX) / Real(kBand3Outer);
    return t;
}
