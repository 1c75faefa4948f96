// Light on a surface whose material has channels: roughness, metalness and emission (glTF 2.0, 3.9.2). Compiles as
// GLSL and as C++ (render/host/channel_light.h), after hit_light.h. Only the common subset of GLSL and GLM is used.
//
// A rough surface without metal is close to what hit_light.h makes of it. A light of strength 1 gives a white matt
// surface that faces it 0.72 (sunlightOf); all that is reflected here is in these terms, so that pi times the
// reflectance (BRDF) stands where a colour does there.

struct LitSurface {
    Real3 albedo;  // light, 0 to 1
    Real roughness, metalness;
    Real3 emission;  // light
};

// Lights and lamps have a size: what is smoother than this looks as if it were as rough.
const float kLeastRoughness = 0.15f;
// What all that is not metal reflects of light from ahead.
const float kMattReflectance = 0.04f;
const float kLeastFacingCosine = 1e-3f;

INLINE Real shownRoughness(LitSurface s) { return max(s.roughness, Real(kLeastRoughness)); }
INLINE Real alphaOf(LitSurface s) { return shownRoughness(s) * shownRoughness(s); }

// Returns what is reflected of light from ahead.
INLINE Real3 reflectanceAhead(LitSurface s) {
    Real matt = Real(kMattReflectance) * (Real(1.0) - s.metalness);
    return Real3(matt, matt, matt) + s.metalness * s.albedo;
}

// How much of the light from everywhere goes into the highlights of a white metal, and the part of that which Schlick's
// term gives where it is dark ahead: least squares over GGX's integrals, off by 0.07 and 0.05 along the surface, and by
// 0.03 elsewhere.
struct HighlightShare {
    Real whole;
    Real grazing;
};
INLINE HighlightShare highlightShare(Real roughness, Real cosine) {
    Real r = roughness, aside = Real(1.0) - min(max(cosine, Real(0.0)), Real(1.0));
    Real aside3 = aside * aside * aside, aside5 = aside3 * aside * aside;
    HighlightShare share;
    share.whole = min(Real(1.005) + r * r * (Real(0.2017) * aside - Real(0.5409) - Real(0.1644) * r) +
                          aside5 * r * (Real(1.0742) * r - Real(0.5716)),
                      Real(1.0));
    Real grazing = aside3 * (Real(0.4885) - Real(0.5053) * r) +
                   aside5 * (Real(0.589) - Real(1.9719) * r + Real(1.4756) * r * r) - Real(0.0036);
    share.grazing = min(max(grazing, Real(0.0)), share.whole);
    return share;
}

// Returns how much of the light from a direction the highlights of what is no metal leave for the ground below.
INLINE Real leftForGround(Real roughness, Real cosine) {
    HighlightShare share = highlightShare(roughness, cosine);
    return Real(1.0) - share.grazing - Real(kMattReflectance) * (share.whole - share.grazing);
}

// Returns pi times the reflectance from `light` to `eye`, both unit and on the side of the normal `n`: GGX with Smith's
// height-correlated shadowing and Schlick's reflectance, above a matt ground, which gets and gives what these leave
// (Kelemen and Szirmay-Kalos 2001). It is the same from `eye` to `light`.
INLINE Real3 reflectedPart(LitSurface s, Real3 n, Real3 light, Real3 eye) {
    Real3 between = light + eye;
    between = between / sqrt(max(dot(between, between), Real(1e-12)));
    Real roughness = shownRoughness(s), alpha = alphaOf(s), alpha2 = alpha * alpha;
    Real ofLight = max(dot(n, light), Real(kLeastFacingCosine)), ofEye = max(dot(n, eye), Real(kLeastFacingCosine));
    Real ofBetween = min(max(dot(n, between), Real(0.0)), Real(1.0));
    // The sine by itself: near the middle of a sharp highlight 1 - cosine^2 would be rounding alone.
    Real3 aside = cross(n, between);
    Real width = max(alpha2 * ofBetween * ofBetween + dot(aside, aside), alpha2);
    Real lobe = alpha2 / (width * width);
    Real shadowed = ofLight * sqrt(alpha2 + (Real(1.0) - alpha2) * ofEye * ofEye) +
                    ofEye * sqrt(alpha2 + (Real(1.0) - alpha2) * ofLight * ofLight);
    Real grazing = Real(1.0) - min(max(dot(light, between), Real(0.0)), Real(1.0));
    Real grazing2 = grazing * grazing;
    Real3 ahead = reflectanceAhead(s);
    Real3 reflected = ahead + (grazing2 * grazing2 * grazing) * (Real3(Real(1.0), Real(1.0), Real(1.0)) - ahead);
    // What is left for the ground on average.
    Real usual = Real(0.905) + Real(0.08) * roughness;
    Real ground = leftForGround(roughness, ofLight) * leftForGround(roughness, ofEye) / usual;
    return ((Real(1.0) - s.metalness) * ground) * s.albedo + (lobe * Real(0.5) / shadowed) * reflected;
}

// Returns which way the surroundings lie that are seen in a surface: the mirror's, where it is smooth, and where it is
// rough towards the normal. The quadratic form of the surroundings (environmentLight) is read there, as if it were what
// comes from there: it is their light over half a sphere, too wide for a smooth metal, which shows colours and no
// pictures; but it is at hand, never below 0, and never more than what there is.
INLINE Real3 seenDirection(LitSurface s, Real3 n, Real3 eye) {
    Real3 mirrored = Real(2.0) * dot(n, eye) * n - eye;
    Real3 seen = mirrored + alphaOf(s) * (n - mirrored);
    return seen / sqrt(max(dot(seen, seen), Real(1e-12)));
}

// Returns how much of the light from everywhere a surface reflects as its matt ground does, and how much as a mirror
// would: together at most 1.
struct ReflectedParts {
    Real3 matt;
    Real3 mirrored;
};
INLINE ReflectedParts reflectedParts(LitSurface s, Real3 n, Real3 eye) {
    Real roughness = shownRoughness(s), cosine = dot(n, eye);
    HighlightShare share = highlightShare(roughness, cosine);
    ReflectedParts parts;
    parts.mirrored =
        (share.whole - share.grazing) * reflectanceAhead(s) + Real3(share.grazing, share.grazing, share.grazing);
    parts.matt = ((Real(1.0) - s.metalness) * leftForGround(roughness, cosine)) * s.albedo;
    return parts;
}

// Returns the light of the sky above a surface that faces it, as lightUnderSky has it, where all of it is seen.
INLINE Real skylight(Real3 n, Real3 up) { return Real(0.10) + Real(0.18) * (Real(0.5) + Real(0.5) * dot(n, up)); }
