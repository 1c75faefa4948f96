// Light from everywhere on a hit whose surface has a volume of transfer (mesostructure/transfer_volume.h). Compiles as
// shell_cast.h does, which includes it; mesostructure/shared/transfer_lookup.h is before both.

// Adds what the corners of a piece have of anything to the columns that they are on.
INLINE vec3 ofColumns(uint bits, vec4 corners) {
    uint part = bits >> kShellPart & 3u;
    return part == 0u   ? vec3(corners.x, corners.y, corners.z + corners.w)
           : part == 1u ? vec3(corners.x, corners.y + corners.z, corners.w)
                        : vec3(corners.x + corners.y, corners.z, corners.w);
}

// Returns the part of a hit's base that each of the columns of its piece has; the sum is 1.
INLINE vec3 columnWeights(int piece, vec3 p) {
    vec4 corner = fetchInput(piece);
    vec3 at = p - vec3(corner);
    float b = dot(vec3(fetchInput(piece + 1)), at), c = dot(vec3(fetchInput(piece + 2)), at),
          d = dot(vec3(fetchInput(piece + 3)), at);
    vec3 weights = max(ofColumns(uint(corner.w), vec4(1.0f - b - c - d, b, c, d)), vec3(0.0f));
    return weights / (weights.x + weights.y + weights.z);
}

// Returns the light of a channel that a transfer, in the world's axes, lets through of what is over a place of the
// base.
INLINE float lightOverBase(Harmonics arrives, vec3 columns, vec3 weights, int channel) {
    float light = 0.0f;
    for (int i = 0; i < 4; i++) {
        vec4 over = vec4(0.0f);
        for (int k = 0; k < 3; k++)
            over += weights[k] * fetchBaseLight(int(kBaseLightTexels) * int(columns[k]) + 4 * channel + i);
        light += dot(over, vec4(arrives.c[4 * i], arrives.c[4 * i + 1], arrives.c[4 * i + 2], arrives.c[4 * i + 3]));
    }
    return light;
}

// Returns what a white surface gives back at a hit. `n`: its unit normal in the world.
INLINE vec3 transferredLight(ShellHit hit, vec3 p, vec3 n) {
    vec4 corner = fetchInput(hit.piece), q0 = fetchInput(hit.piece + 1), q1 = fetchInput(hit.piece + 2),
         q2 = fetchInput(hit.piece + 3);
    vec4 t0 = fetchInput(hit.piece + 4), t1 = fetchInput(hit.piece + 5), t2 = fetchInput(hit.piece + 6);
    mat3 gradients = mat3(vec3(t0), vec3(t1), vec3(t2));
    vec3 part = (vec3(q0.w, q1.w, q2.w) + (p - vec3(corner)) * gradients) / meso.extent;
    part.x -= floor(part.x);
    part.y -= floor(part.y);
    mat3 frame = tileFrame(gradients);
    MesoTransfer of = view.transfer;
    Harmonics arrives = turnedHarmonics(transferAt(of.first, uvec3(of.across, of.back, of.up), part, n * frame), frame);
    vec3 light = vec3(0.0f);
    if (view.hasBaseLight != 0u) {
        vec3 weights = columnWeights(hit.piece, p), columns = vec3(t0.w, t1.w, t2.w);
        for (int channel = 0; channel < 3; channel++)
            light[channel] = lightOverBase(arrives, columns, weights, channel);
    } else {
        for (int i = 0; i < 16; i++) light += arrives.c[i] * vec3(view.harmonics[i]);
    }
    return max(light, vec3(0.0f));
}
