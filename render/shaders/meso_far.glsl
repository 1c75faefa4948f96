// Surfaces that are not marched because they stray from their mean height by less than a part of a pixel, and tiles are
// a few pixels wide: the ray meets the mean height, and sees the light of the tile from there
// (mesostructure/appearance.h).

// Pixels that a tile may be wide, over those that the surface may stray: docs/mesostructure.md has the measurement.
const float kFarTile = 8.0;

// `t0`, `t1`, `t2`: gradients of tile space; `width`: the pixel's width in world units.
bool isFar(vec3 t0, vec3 t1, vec3 t2, float width) {
    float most = view.strayPixels * width;
    return max(view.meanHeight, meso.extent.z - view.meanHeight) <= most * length(t2) &&
           max(meso.extent.x / length(t0), meso.extent.y / length(t1)) <= kFarTile * most;
}

// Meets the mean height from above. A ray that comes from a piece that was marched may be below it: it hits where it
// is.
MesoResult meetMean(MesoRay ray) {
    MesoResult result = MesoResult(kMesoMiss, 0.0, vec3(0.0, 0.0, 1.0), 0u, 0u, 0u);
    if (ray.d.z >= 0.0 || !ray.isOutside) return result;
    result.t = max((view.meanHeight - ray.o.z) / ray.d.z, 0.0);
    if (result.t <= ray.tMax) result.state = kMesoHit;
    return result;
}

// The nine coefficients and the mean normal of a view of the grid.
struct FarView {
    vec4 a, b, c;
};

FarView fetchView(ivec2 at) {
    int first = int(kAppearanceTexels) * (at.x + int(kAppearanceViews) * at.y) + (view.farShadows != 0u ? 3 : 0);
    return FarView(texelFetch(lookTexels, first), texelFetch(lookTexels, first + 1), texelFetch(lookTexels, first + 2));
}

FarView mixViews(FarView x, FarView y, float w) {
    return FarView(mix(x.a, y.a, w), mix(x.b, y.b, w), mix(x.c, y.c, w));
}

// `towards` points to the eye, z out of the slab.
FarView farView(vec3 towards) {
    vec2 p = towards.xy / (abs(towards.x) + abs(towards.y) + max(towards.z, 0.0));
    vec2 at = (vec2(p.x + p.y, p.x - p.y) * 0.5 + 0.5) * float(kAppearanceViews - 1u),
         low = min(floor(at), float(kAppearanceViews - 2u)), w = at - low;
    ivec2 i = ivec2(low);
    return mixViews(mixViews(fetchView(i), fetchView(i + ivec2(1, 0)), w.x),
                    mixViews(fetchView(i + ivec2(0, 1)), fetchView(i + 1), w.x), w.y);
}

// The part of the light, which is that of the tile's visible points; a shader of hits multiplies it by n . l, so `n`
// becomes their mean normal, turned towards the light where n . l is less than their mean.
float farLight(mat3 frame, vec3 d, inout vec3 n) {
    vec3 l = view.light * frame;
    FarView v = farView(-d * frame);
    // Spherical harmonics of l, in the order of the coefficients.
    float light = v.a.x * 0.282095 + 0.488603 * dot(v.a.yzw, l) +
                  1.092548 * dot(v.b.xyz, vec3(l.x * l.y, l.y * l.z, l.x * l.z)) +
                  0.315392 * v.b.w * (3.0 * l.z * l.z - 1.0) + 0.546274 * v.c.x * (l.x * l.x - l.y * l.y);
    // No more light is seen than falls on the slab: where it is low, what three bands leave out would glow.
    if (view.farShadows != 0u) light = min(light, max(l.z, 0.0) / max(-dot(d, frame[2]), 1e-3));
    // A unit normal sees more of the sky than the many normals that it stands for.
    vec3 mean = frame * v.c.yzw;
    n = normalize(mean);
    light = clamp(light - 0.5 * kMesoSky / kMesoSun * dot(n - mean, view.up), 0.0, 1.0);
    float direct = dot(n, view.light);
    if (light <= direct) return light / direct;
    n = light * view.light + sqrt(1.0 - light * light) * normalize(n - direct * view.light);
    return 1.0;
}
