// Light on a hit, and the colours that stand for normals and counts. Compiles as GLSL, as C++ (render/host/hit_light.h)
// and, up to the line that says so, for several pixels at once (render/host/tile_shading.cpp). Only the common subset
// of GLSL and GLM is used.

// Returns the light that falls on a surface that faces a part of the sky, encoded for the screen. A power of a product
// is the product of the powers: colours come encoded, so that one power a pixel is enough.
// `sunlight`: sunlightOf, of all lights together.
INLINE Real lightUnderSky(Real sky, Real sunlight, Real skySeen) {
    // Hollows are darker than the sun alone would have them: they see less of what it lights.
    return pow(sunlight * (Real(0.5) + Real(0.5) * skySeen) + (Real(0.10) + Real(0.18) * sky) * skySeen,
               Real(1.0 / 2.2));
}

// Returns the same of a surface with a normal.
INLINE Real encodedLight(Real3 n, Real3 up, Real sunlight, Real skySeen) {
    return lightUnderSky(Real(0.5) + Real(0.5) * dot(n, up), sunlight, skySeen);
}

#ifndef FOR_LANES
INLINE Real3 spread(vec4 v) { return Real3(v.x, v.y, v.z); }
#endif

// Returns the light that comes from everywhere onto a surface with a normal, if nothing is in its way: a quadratic form
// of the normal (Ramamoorthi and Hanrahan 2001, equation 12), where that is not below 0. `rows`: as
// FrameConstants::environment.
INLINE Real3 environmentLight(Real3 n, const vec4 rows[9]) {
    Real3 light = spread(rows[0]) + n.x * (spread(rows[1]) + n.y * spread(rows[4]) + n.x * spread(rows[7])) +
                  n.y * (spread(rows[2]) + n.z * spread(rows[5]) + n.y * spread(rows[8])) +
                  n.z * (spread(rows[3]) + n.x * spread(rows[6]));
    return Real3(max(light.x, Real(0.0)), max(light.y, Real(0.0)), max(light.z, Real(0.0)));
}

// Returns what lightUnderSky does, under such light in place of the sky.
INLINE Real3 lightInEnvironment(Real3 environment, Real sunlight, Real skySeen) {
    Real3 light = skySeen * environment;
    Real sun = sunlight * (Real(0.5) + Real(0.5) * skySeen);
    return Real3(pow(sun + light.x, Real(1.0 / 2.2)), pow(sun + light.y, Real(1.0 / 2.2)),
                 pow(sun + light.z, Real(1.0 / 2.2)));
}

// Returns what a light of strength 1 gives, where a part of it is seen.
INLINE Real sunlightOf(Real3 n, Real3 light, Real sunSeen) {
    Real sun = max(dot(n, light), Real(0.0));
    return Real(0.72) * sun * sunSeen;
}

// Turns a normal by a quaternion: from the dataset's own axes to the world's.
INLINE Real3 turnedBy(Real3 q, Real w, Real3 n) { return n + Real(2.0) * cross(q, cross(q, n) + w * n); }

// What follows is computed pixel by pixel.
#ifndef FOR_LANES

const float kTurn = 6.2831853f;
const float kGoldenTurn = 0.61803399f;
const float kSilverTurn = 0.41421356f;

// Returns the direction of ray `i` of `count` about the z axis, by its cosine (Malley's method on a spiral of the
// disc). Each pixel of a square of 4 x 4, `square` of 16, has its own spiral; shading averages over the square. Each
// sample of the picture gives a pixel the spiral of another, and moves all spirals between their neighbours.
INLINE Real3 spiralDirection(uint i, uint count, uint square, uint sampleNumber) {
    uint mixed = (square + 5u * sampleNumber) & 15u, mixedUp = mixed * 7u & 15u;
    float wider = fract(0.5f + float(sampleNumber) * kGoldenTurn),
          further = fract(0.5f + float(sampleNumber) * kSilverTurn);
    float radius2 = (float(i) + (float(mixedUp) + wider) / 16.0f) / float(count);
    float angle = kTurn * fract(float(i) * kGoldenTurn + (float(mixed) + further) / 16.0f);
    float r = sqrt(radius2);
    return Real3(r * cos(angle), r * sin(angle), sqrt(1.0f - radius2));
}

// Returns which pixel of its square of 4 x 4 one is.
INLINE uint squareOf(uint x, uint y) { return (x & 3u) | (y & 3u) << 2; }

// Turns the z axis to the normal.
INLINE Real3 aboutNormal(Real3 n, Real3 d) {
    Real3 side = normalize(abs(n.z) < 0.7f ? Real3(n.y, -n.x, 0.0f) : Real3(0.0f, n.z, -n.y));
    return d.x * side + d.y * cross(n, side) + d.z * n;
}

// Returns the direction of ray `i` of `count` into the sky over a pixel.
INLINE Real3 skyDirection(Real3 n, uint i, uint count, uint x, uint y, uint sampleNumber) {
    return aboutNormal(n, spiralDirection(i, count, squareOf(x, y), sampleNumber));
}

// Whether a surface that is there in a part of a pixel's samples is left out of this one. Over 16 samples a pixel
// leaves it out in as many as its opacity says, to a sixteenth; over a square of 4 x 4 pixels so does each sample.
INLINE bool isFaded(float opacity, uint x, uint y, uint sampleNumber) {
    uint step = (squareOf(x, y) * 7u + 5u * sampleNumber) & 15u;
    return (float(step) + 0.5f) / 16.0f >= opacity;
}

// Returns what an occlusion ray sees of the sky, where it is blocked at a part of its reach: less, the nearer.
INLINE Real skyBehind(Real part) {
    float near = 1.0f - part;
    return 1.0f - near * near;
}

// Packs light into a word with one exponent for its channels, to a five-hundredth of the brightest; never 0.
INLINE uint packedLight(Real3 light) {
    float most = max(max(light.x, light.y), max(light.z, 1e-4f)), power = clamp(ceil(log2(most)), -15.0f, 15.0f);
    Real3 steps = light * (511.0f * exp2(-power)) + 0.5f;
    return uint(clamp(steps.x, 0.0f, 511.0f)) | uint(clamp(steps.y, 0.0f, 511.0f)) << 9 |
           uint(clamp(steps.z, 0.0f, 511.0f)) << 18 | uint(power + 16.0f) << 27;
}
INLINE Real3 unpackedLight(uint word) {
    return Real3(float(word & 511u), float(word >> 9 & 511u), float(word >> 18 & 511u)) *
           (exp2(float(word >> 27) - 16.0f) / 511.0f);
}

// Returns the light of a colour that is encoded for the screen, and the colour of light.
INLINE Real3 lightOfColour(Real3 encoded) { return pow(encoded, Real3(2.2f)); }
INLINE Real3 colourOfLight(Real3 light) { return pow(light, Real3(1.0f / 2.2f)); }

// Maps 0 to 1 from blue through green to red.
INLINE Real3 heat(Real x) {
    return clamp(Real3(3.0f * x - 1.2f, 1.5f - abs(3.0f * x - 1.2f), 1.4f - 3.0f * x), 0.0f, 1.0f);
}

#endif
