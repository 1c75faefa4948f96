// Surfaces that are not marched because they stray from their mean height by less than a part of a pixel, and tiles are
// a few pixels wide: the ray meets the mean height, and sees the light of the tile from there
// (mesostructure/appearance.h). Compiles as shell_cast.h does, which includes it.

// `t0`, `t1`, `t2`: gradients of tile space; `width`: the pixel's width in world units.
INLINE bool isFar(vec3 t0, vec3 t1, vec3 t2, float width) {
    float most = view.strayPixels * width;
    return max(view.meanHeight, meso.extent.z - view.meanHeight) <= most * length(t2) &&
           max(meso.extent.x / length(t0), meso.extent.y / length(t1)) <= kFarTile * most;
}

// Meets the mean height from above. A ray that comes from a piece that was marched may be below it: it hits where it
// is.
INLINE MesoResult meetMean(MesoRay ray) {
    MesoResult result;
    result.state = kMesoMiss;
    result.t = 0.0f;
    result.normal = vec3(0.0f, 0.0f, 1.0f);
    result.iterations = 0u;
    result.fetches = 0u;
    result.tests = 0u;
    if (ray.d.z >= 0.0f || !ray.isOutside) return result;
    result.t = max((view.meanHeight - ray.o.z) / ray.d.z, 0.0f);
    if (result.t <= ray.tMax) result.state = kMesoHit;
    return result;
}

INLINE FarView fetchView(int x, int y) {
    int first = int(kAppearanceTexels) * (x + int(kAppearanceViews) * y) + (view.farShadows != 0u ? 3 : 0);
    FarView fetched;
    fetched.a = fetchLook(first);
    fetched.b = fetchLook(first + 1);
    fetched.c = fetchLook(first + 2);
    return fetched;
}

INLINE FarView mixViews(FarView x, FarView y, float w) {
    x.a = mix(x.a, y.a, w);
    x.b = mix(x.b, y.b, w);
    x.c = mix(x.c, y.c, w);
    return x;
}

// `towards` points to the eye, z out of the slab.
INLINE FarView farView(vec3 towards) {
    float across = abs(towards.x) + abs(towards.y) + max(towards.z, 0.0f), a = towards.x / across,
          b = towards.y / across;
    vec2 at = (vec2(a + b, a - b) * 0.5f + 0.5f) * float(kAppearanceViews - 1u),
         low = min(floor(at), vec2(float(kAppearanceViews - 2u))), w = at - low;
    int x = int(low.x), y = int(low.y);
    return mixViews(mixViews(fetchView(x, y), fetchView(x + 1, y), w.x),
                    mixViews(fetchView(x, y + 1), fetchView(x + 1, y + 1), w.x), w.y);
}

// Returns the light of strength 1 from direction `l`, in the tile's axes, on the tile's visible points.
INLINE float farLight(FarView v, vec3 l, float slope) {
    // Spherical harmonics of l, in the order of the coefficients.
    float light = v.a.x * 0.282095f + 0.488603f * dot(vec3(v.a.y, v.a.z, v.a.w), l) +
                  1.092548f * dot(vec3(v.b), vec3(l.x * l.y, l.y * l.z, l.x * l.z)) +
                  0.315392f * v.b.w * (3.0f * l.z * l.z - 1.0f) + 0.546274f * v.c.x * (l.x * l.x - l.y * l.y);
    // No more light is seen than falls on the slab: where it is low, what three bands leave out would glow.
    if (view.farShadows != 0u) light = min(light, max(l.z, 0.0f) / max(slope, 1e-3f));
    return clamp(light, 0.0f, 1.0f);
}

// Finds the light of the tile's visible points, and the sky that they face; `n` becomes their mean normal. `frame`: the
// tile's axes in the world.
INLINE void seeFar(mat3 frame, vec3 d, INOUT(vec3) n, INOUT(ShellLook) look) {
    FarView v = farView(-d * frame);
    for (uint i = 0u; i < view.lightCount; i++)
        look.light[i] = farLight(v, vec3(view.lights[i]) * frame, -dot(d, frame[2]));
    vec3 mean = frame * vec3(v.c.y, v.c.z, v.c.w);
    // A unit normal would face more of the sky than the many normals that it stands for.
    look.sky = min(0.5f + 0.5f * dot(mean, view.up), kMesoMostSky);
    n = normalize(mean);
}
