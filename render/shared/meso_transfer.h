// Light from everywhere on a hit whose surface has a volume of transfer (mesostructure/transfer_volume.h). Compiles as
// shell_cast.h does, which includes it; mesostructure/shared/transfer_lookup.h is before both.

// Returns what a white surface gives back at a hit. `n`: its unit normal in the world.
INLINE vec3 transferredLight(ShellHit hit, vec3 p, vec3 n) {
    vec4 corner = fetchInput(hit.piece), q0 = fetchInput(hit.piece + 1), q1 = fetchInput(hit.piece + 2),
         q2 = fetchInput(hit.piece + 3);
    mat3 gradients =
        mat3(vec3(fetchInput(hit.piece + 4)), vec3(fetchInput(hit.piece + 5)), vec3(fetchInput(hit.piece + 6)));
    vec3 part = (vec3(q0.w, q1.w, q2.w) + (p - vec3(corner)) * gradients) / meso.extent;
    part.x -= floor(part.x);
    part.y -= floor(part.y);
    mat3 frame = tileFrame(gradients);
    MesoTransfer of = view.transfer;
    Harmonics arrives = turnedHarmonics(transferAt(of.first, uvec3(of.across, of.back, of.up), part, n * frame), frame);
    vec3 light = vec3(0.0f);
    for (int i = 0; i < 16; i++) light += arrives.c[i] * vec3(view.harmonics[i]);
    return max(light, vec3(0.0f));
}
