// Textures over the tile (render/meso_texture.h), trilinear (Williams 1983). Compiles as shell_cast.h does.

INLINE vec4 textureTexel(uint first, int width, int height, int x, int y) {
    x = x < 0 ? x + width : x >= width ? x - width : x;
    y = y < 0 ? y + height : y >= height ? y - height : y;
    return fetchLook(int(first) + x + width * y);
}

// `at`: place in the tile, from 0 to 1.
INLINE vec4 textureLevel(MesoImage image, uint level, vec2 at) {
    uint first = image.first;
    for (uint i = 0u; i < level; i++) first += max(image.width >> i, 1u) * max(image.height >> i, 1u);
    int width = int(max(image.width >> level, 1u)), height = int(max(image.height >> level, 1u));
    // The finest texels lie on the grid points i / size.
    vec2 p = (at + 0.5f / vec2(image.width, image.height)) * vec2(width, height) - 0.5f, low = floor(p), w = p - low;
    int x = int(low.x), y = int(low.y);
    vec4 lower = mix(textureTexel(first, width, height, x, y), textureTexel(first, width, height, x + 1, y), w.x);
    vec4 upper =
        mix(textureTexel(first, width, height, x, y + 1), textureTexel(first, width, height, x + 1, y + 1), w.x);
    return mix(lower, upper, w.y);
}

// Returns the mean over a square of edge `footprint` about `at`, both in tile units.
INLINE vec4 sampleTexture(MesoImage image, vec2 at, float footprint) {
    vec2 extent = vec2(meso.extent), texel = extent / vec2(image.width, image.height), part = at / extent;
    float level = clamp(log2(max(footprint / min(texel.x, texel.y), 1.0f)), 0.0f, float(image.levels - 1u));
    uint finer = uint(level);
    part -= floor(part);
    vec4 value = textureLevel(image, finer, part);
    return level > float(finer) ? mix(value, textureLevel(image, finer + 1u, part), level - float(finer)) : value;
}

// Encodes a linear colour as it is shown (sRGB).
INLINE vec3 encodedColour(vec3 light) {
    return mix(1.055f * pow(light, vec3(1.0f / 2.4f)) - 0.055f, light * 12.92f, lessThanEqual(light, vec3(0.0031308f)));
}

// Returns the tile's axes in the world, made orthonormal: z out of the slab, x and y along it.
INLINE mat3 tileFrame(mat3 gradients) {
    vec3 z = normalize(gradients[2]), x = normalize(gradients[0] - dot(gradients[0], z) * z);
    // A mirrored map has y on the other side.
    return mat3(x, cross(z, x) * (determinant(gradients) < 0.0f ? -1.0f : 1.0f), z);
}

// Turns a texture's normal `bend` (z: away from the surface) as z is turned to the normal of what it lies on.
INLINE vec3 bentNormal(vec3 n, vec3 bend) {
    float a = -1.0f / max(1.0f + n.z, 0.05f), b = n.x * n.y * a;
    return bend.x * vec3(1.0f + n.x * n.x * a, b, -n.x) + bend.y * vec3(b, 1.0f + n.y * n.y * a, -n.y) + bend.z * n;
}
