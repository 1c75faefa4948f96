// How an image is read at a point of a triangle: which of its texels a pixel covers there. Compiles as GLSL (Real =
// float), as C++ in float and double (octree/surface/image_lookup.h), after leaf_math.h, and, from the line that says
// so, for several pixels at once (render/host/tile_colours.cpp). Only the common subset of GLSL and GLM is used, and
// SELECT(condition, yes, no), both of which are computed.
//
// A pixel's footprint is an ellipse on the surface, and in the image. It is filtered at several places along it, each
// from the two levels whose texels are as wide as it is (McCormack et al. 1999, "Feline"; Williams 1983).

#ifndef FOR_LANES

// Word of a page's header with the number of its vertices: behind their colours stand their points.
const uint kPageHeaderVertices = 6u;
// log2 of how many steps of a vertex's coordinates an image has across.
const int kLog2TextureSteps = 20;

const uint kWrapRepeat = 0u;
const uint kWrapClamp = 1u;
const uint kWrapMirror = 2u;

// Returns the texel that is shown at place `at` of a row of `size` texels. |at| < 2^24.
INLINE int wrappedTexel(int at, int size, uint wrap) {
    if (wrap == kWrapClamp) return clamp(at, 0, size - 1);
    int period = wrap == kWrapMirror ? 2 * size : size;
    int inside = at - period * int(floor(Real(at) / Real(period)));
    // Rounding may leave it a period away.
    inside = inside < 0 ? inside + period : inside >= period ? inside - period : inside;
    return inside < size ? inside : period - 1 - inside;
}

#endif  // What follows is computed for several pixels at once, too.

// How the coordinates of a triangle in an image change along the axes of space.
struct TextureSlope {
    Real3 u;
    Real3 v;
};

#ifndef FOR_LANES
// `a`, `b`, `c`: the triangle's corners; `toB`, `toC`: the coordinates of b and c, less those of a.
INLINE TextureSlope textureSlope(Real3 a, Real3 b, Real3 c, Real2 toB, Real2 toC) {
    Real3 n = cross(b - a, c - a);
    Real scale = Real(1.0) / max(dot(n, n), Real(1e-30));
    Real3 alongB = cross(c - a, n) * scale;
    Real3 alongC = cross(n, b - a) * scale;
    TextureSlope slope;
    slope.u = alongB * toB.x + alongC * toC.x;
    slope.v = alongB * toB.y + alongC * toC.y;
    return slope;
}
#endif

// A footprint in an image. `along`: its length as a step of coordinates; `longAxis`, `shortAxis`: those of the ellipse,
// texels.
struct ImageFootprint {
    Real2 along;
    Real longAxis;
    Real shortAxis;
};

// Surfaces that are seen more from the side than this are filtered as if they were not.
const float kLeastCosine = 0.05f;
const int kMostFootprintPlaces = 8;
// What a sample is averaged over, in edges of a pixel: the mean of a pixel's samples is over about a pixel then.
const float kFootprintPixels = 0.5f;

// `n`: the triangle's normal, `direction`: of the ray, both unit; `pixelEdge`: of a pixel at the hit, in the units of
// the slope; `size`: of the image, texels.
INLINE ImageFootprint imageFootprint(TextureSlope slope, Real3 n, Real3 direction, Real pixelEdge, Real2 size) {
    Real3 across = cross(direction, n);
    Real3 any = SELECT(abs(n.z) < Real(0.7), Real3(n.y, -n.x, Real(0.0)), Real3(Real(0.0), n.z, -n.y));
    across = normalize(SELECT(dot(across, across) < Real(1e-6), any, across));
    Real3 away = cross(n, across);
    Real stretched = pixelEdge / max(abs(dot(direction, n)), Real(kLeastCosine));
    Real2 a = pixelEdge * (size * Real2(dot(slope.u, across), dot(slope.v, across)));
    Real2 b = stretched * (size * Real2(dot(slope.u, away), dot(slope.v, away)));
    // The axes of the ellipse, from the matrix a a^T + b b^T.
    Real xx = a.x * a.x + b.x * b.x;
    Real xy = a.x * a.y + b.x * b.y;
    Real yy = a.y * a.y + b.y * b.y;
    Real mean = (xx + yy) * Real(0.5);
    Real difference = (xx - yy) * Real(0.5);
    Real apart = sqrt(difference * difference + xy * xy);
    Real longest = sqrt(mean + apart);
    // There are two ways to write the direction; this one does not cancel.
    Real2 towards = SELECT(xx > yy, Real2(difference + apart, xy), Real2(xy, apart - difference));
    Real scale = longest / sqrt(max(towards.x * towards.x + towards.y * towards.y, Real(1e-30)));
    ImageFootprint footprint;
    footprint.along = scale * towards / size;
    footprint.longAxis = longest;
    footprint.shortAxis = sqrt(max(mean - apart, Real(0.0)));
    return footprint;
}

// Returns at how many places along a footprint the image is read, a whole number.
INLINE Real footprintPlaces(ImageFootprint footprint) {
    Real ratio = footprint.longAxis / max(footprint.shortAxis, Real(1.0));
    return min(max(floor(ratio + Real(0.5)), Real(1.0)), Real(float(kMostFootprintPlaces)));
}

// Returns the level that suits each of so many places, 0 or more; its fraction is the share of the next coarser one.
INLINE Real footprintLevel(ImageFootprint footprint, Real places) {
    return log2(max(max(footprint.shortAxis, footprint.longAxis / places), Real(1.0)));
}

// How an image is read with a footprint: at so many places along it, each from two levels.
struct ImagePlaces {
    Real count;   // a whole number
    Real2 along;  // the footprint's length as a step of coordinates
    Real level;   // number of the finer level; its fraction is the share of the next coarser one
};

// Footprints larger than this are taken for no numbers.
const float kMostFootprint = 3e38f;

// `finest`: number of the finest level in memory; `coarsest`: of the last one.
INLINE ImagePlaces imagePlaces(ImageFootprint footprint, Real finest, Real coarsest) {
    Real count = footprintPlaces(footprint);
    Real level = min(max(footprintLevel(footprint, count), finest), coarsest);
    // Where coordinates change too fast for numbers, as on slivers, an image shows its mean.
    Real extent = footprint.longAxis + footprint.shortAxis + abs(footprint.along.x) + abs(footprint.along.y);
    ImagePlaces places;
    places.count = SELECT(extent <= Real(kMostFootprint), count, Real(1.0));
    places.along = SELECT(extent <= Real(kMostFootprint), footprint.along, Real2(Real(0.0), Real(0.0)));
    places.level = SELECT(extent <= Real(kMostFootprint), level, coarsest);
    return places;
}

// A place in a row of texels for which wrappedTexel is exact; those beyond, and what is no number, are taken for 0.
const float kFarTexel = 8388608.0f;
INLINE Real boundedPlace(Real at) { return SELECT(abs(at) <= Real(kFarTexel), at, Real(0.0)); }
