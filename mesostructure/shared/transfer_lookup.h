// Reads a volume of transfer (mesostructure/transfer_volume.h). Compiles as GLSL and as members of a struct in C++.
// Whoever includes it gives fetchLook, which reads texels of four values:
//   two a texel     for each cell of the grid, x fastest: the number of its terms, 0: none, as (low, high) halves
//   17 a number     terms 0 to 3, four texels each: coefficients of spherical harmonics; the mean of the cell's normals
//                   and its length

INLINE uint transferNumber(uint first, uint cell) {
    vec4 pair = fetchLook(int(first + cell / 2u));
    return (cell & 1u) == 0u ? uint(pair.x) + kTransferHalf * uint(pair.y)
                             : uint(pair.z) + kTransferHalf * uint(pair.w);
}

// Returns what reaches a point of the surface of the light from each direction: terms of the cells about it, blended.
// `first`: texel of the volume; `cells`: of its grid; `part`: the place in the tile, from 0 to 1, with z up the slab;
// `n`: unit normal in the tile's axes.
INLINE Harmonics transferAt(uint first, uvec3 cells, vec3 part, vec3 n) {
    vec4 sums[4];
    for (int i = 0; i < 4; i++) sums[i] = vec4(0.0f);
    float weights = 0.0f;
    vec3 at = part * vec3(cells) - 0.5f, low = floor(at), w = at - low;
    uint terms = first + (cells.x * cells.y * cells.z + 1u) / 2u;
    for (int corner = 0; corner < 8; corner++) {
        int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2, z = int(low.z) + dz;
        float weight = (dx == 0 ? 1.0f - w.x : w.x) * (dy == 0 ? 1.0f - w.y : w.y) * (dz == 0 ? 1.0f - w.z : w.z);
        if (z < 0 || z >= int(cells.z) || weight <= 0.0f) continue;
        // x and y repeat.
        uint x = uint(int(low.x) + dx + int(cells.x)) % cells.x, y = uint(int(low.y) + dy + int(cells.y)) % cells.y;
        uint number = transferNumber(first, x + cells.x * (y + cells.y * uint(z)));
        if (number == 0u) continue;
        int texel = int(terms + kTransferTexels * (number - 1u));
        // A cell whose normals all point elsewhere holds another surface: the foot of what stands on this one, say.
        vec4 mean = fetchLook(texel + 16);
        weight *= max(1.0f - mean.w + dot(vec3(mean), n), kLeastLikeness);
        weights += weight;
        for (int i = 0; i < 4; i++)
            sums[i] += weight * (fetchLook(texel + i) + n.x * fetchLook(texel + 4 + i) +
                                 n.y * fetchLook(texel + 8 + i) + n.z * fetchLook(texel + 12 + i));
    }
    // No cell about it has surface, as the volume knows it.
    if (weights <= 0.0f) return clampedCosine(n);
    Harmonics h;
    for (int i = 0; i < 4; i++) {
        vec4 values = sums[i] / weights;
        h.c[4 * i] = values.x;
        h.c[4 * i + 1] = values.y;
        h.c[4 * i + 2] = values.z;
        h.c[4 * i + 3] = values.w;
    }
    return h;
}
