// Light on a hit in a shell, encoded for the screen. Compiles as GLSL and, as a member beside a MesoView `view`, as C++
// (render/host/shell_caster.h). `sky`, `light`: as ShellLook has them, `light` with shadows; `skySeen`: what occlusion
// leaves.
// `arrives`: a word of packedLight, what comes from everywhere where that is known, with what the mesostructure keeps
// away; else 0.
INLINE vec3 mesoLight(vec3 n, float sky, vec4 light, float skySeen, uint arrives) {
    bool isFar = sky < 1.0f;
    float sun = 0.0f;
    for (uint i = 0u; i < view.lightCount; i++) {
        vec4 from = view.lights[i];
        sun += from.w * (isFar ? kMesoSun * light[i] : sunlightOf(n, vec3(from), light[i]));
    }
    if (arrives != 0u) return lightInEnvironment(unpackedLight(arrives), sun, 1.0f);
    if (view.hasEnvironment != 0u) return lightInEnvironment(environmentLight(n, view.environment), sun, skySeen);
    if (!isFar) return vec3(encodedLight(n, view.up, sun, skySeen));
    return vec3(lightUnderSky(sky / kMesoMostSky, sun, skySeen));
}
