// The normal of a surface whose material has an image of normals. Compiles as GLSL (Real = float) and as C++ in float
// and double (octree/surface/image_lookup.h), after image_lookup.h. Only the common subset of GLSL and GLM is used.
//
// The axes of the image lie on the triangle as its coordinates change there (TextureSlope), so no tangents are stored,
// and mirrored coordinates are right. Which side of a triangle is outside is not known: what is seen is taken for it.

struct MappedNormal {
    Real3 normal;  // unit
    Real spread;   // what the normals in the footprint add to the square of GGX's alpha, by how much they differ
};

// By how much the square of the length of a normal with 8 bits an axis may be off.
const float kNormalRounding = 0.02f;

// `n`: unit, towards the viewer; `slope`: any length, but the triangle's; `stored`: the mean of the texels, 0 to 1, for
// -1 to 1 to the right, up and away from the surface; `scale`: multiplies right and up.
INLINE MappedNormal mappedNormal(Real3 n, TextureSlope slope, Real3 stored, Real scale) {
    Real3 mean = stored * Real(2.0) - Real3(Real(1.0), Real(1.0), Real(1.0));
    // The shorter the mean of unit vectors is, the more they differ (Toksvig 2005): a lobe of von Mises and Fisher with
    // concentration r (3 - r^2) / (1 - r^2), and GGX's alpha^2 grows by twice its reciprocal.
    Real length2 = min(dot(mean, mean), Real(1.0));
    Real missing = max(Real(1.0) - length2 - Real(kNormalRounding), Real(0.0));
    MappedNormal mapped;
    mapped.spread = Real(2.0) * missing / max(sqrt(length2) * (Real(3.0) - length2), Real(0.1));
    mapped.normal = n;
    // To the right in the image, v stays the same and u grows. The triangle's own normal, of whatever sign, is along
    // the cross product of the two slopes.
    Real3 u = slope.u / sqrt(max(dot(slope.u, slope.u), Real(1e-30)));
    Real3 v = slope.v / sqrt(max(dot(slope.v, slope.v), Real(1e-30)));
    Real3 right = cross(v, cross(u, v));
    right = right - dot(right, n) * n;
    Real size = dot(right, right);
    // Where the coordinates do not change, or too fast for numbers, the surface's own normal stays.
    if (size > Real(1e-10) && size < Real(2.0)) {
        right = right / sqrt(size);
        Real3 up = cross(n, right);
        if (dot(up, v) > Real(0.0)) up = -up;
        Real3 bent = scale * (mean.x * right + mean.y * up) + max(mean.z, Real(0.0)) * n;
        Real bent2 = dot(bent, bent);
        if (bent2 > Real(1e-12)) mapped.normal = bent / sqrt(bent2);
    }
    return mapped;
}

// Returns the perceptual roughness that such a spread makes of another.
INLINE Real roughnessWithin(Real roughness, Real spread) {
    Real alpha = roughness * roughness;
    return sqrt(sqrt(min(alpha * alpha + spread, Real(1.0))));
}
