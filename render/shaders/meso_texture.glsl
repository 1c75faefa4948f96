// Textures over the tile (render/meso_texture.h), trilinear (Williams 1983).

vec4 textureTexel(uint first, ivec2 size, ivec2 at) {
    at = ivec2(at.x < 0         ? at.x + size.x
               : at.x >= size.x ? at.x - size.x
                                : at.x,
               at.y < 0         ? at.y + size.y
               : at.y >= size.y ? at.y - size.y
                                : at.y);
    return texelFetch(lookTexels, int(first) + at.x + size.x * at.y);
}

// `at`: place in the tile, from 0 to 1.
vec4 textureLevel(MesoImage image, uint level, vec2 at) {
    uint first = image.first;
    for (uint i = 0u; i < level; i++) first += max(image.width >> i, 1u) * max(image.height >> i, 1u);
    ivec2 size = ivec2(max(uvec2(image.width, image.height) >> level, uvec2(1u)));
    // The finest texels lie on the grid points i / size.
    vec2 p = (at + 0.5 / vec2(image.width, image.height)) * vec2(size) - 0.5, low = floor(p), w = p - low;
    ivec2 i = ivec2(low);
    vec4 lower = mix(textureTexel(first, size, i), textureTexel(first, size, i + ivec2(1, 0)), w.x);
    vec4 upper = mix(textureTexel(first, size, i + ivec2(0, 1)), textureTexel(first, size, i + 1), w.x);
    return mix(lower, upper, w.y);
}

// Returns the mean over a square of edge `footprint` about `at`, both in tile units.
vec4 sampleTexture(MesoImage image, vec2 at, float footprint) {
    vec2 texel = meso.extent.xy / vec2(image.width, image.height), part = at / meso.extent.xy;
    float level = clamp(log2(max(footprint / min(texel.x, texel.y), 1.0)), 0.0, float(image.levels - 1u));
    uint finer = uint(level);
    part -= floor(part);
    vec4 value = textureLevel(image, finer, part);
    return level > float(finer) ? mix(value, textureLevel(image, finer + 1u, part), level - float(finer)) : value;
}

// Encodes a linear colour as it is shown (sRGB).
vec3 encodedColour(vec3 light) {
    return mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, light * 12.92, lessThanEqual(light, vec3(0.0031308)));
}

// Returns the tile's axes in the world, made orthonormal: z out of the slab, x and y along it.
mat3 tileFrame(mat3 gradients) {
    vec3 z = normalize(gradients[2]), x = normalize(gradients[0] - dot(gradients[0], z) * z);
    // A mirrored map has y on the other side.
    return mat3(x, cross(z, x) * (determinant(gradients) < 0.0 ? -1.0 : 1.0), z);
}

// Turns a texture's normal `bend` (z: away from the surface) as z is turned to the normal of what it lies on.
vec3 bentNormal(vec3 n, vec3 bend) {
    float a = -1.0 / max(1.0 + n.z, 0.05), b = n.x * n.y * a;
    return bend.x * vec3(1.0 + n.x * n.x * a, b, -n.x) + bend.y * vec3(b, 1.0 + n.y * n.y * a, -n.y) + bend.z * n;
}
