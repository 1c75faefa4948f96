// What the trace pass wrote for a pixel.

struct PixelHit {
    float depth;  // finest cells along the ray; kNoHit
    bool onCap;   // the hit is on the cap of a section
};

PixelHit fetchPixelHit(uint pixel) {
    float depth = uintBitsToFloat(fetchHit(pixel));
    return PixelHit(abs(depth), depth < 0.0);
}

// Roughness and metalness of a hit, 8 bits each; bit 16: its material has channels.
uint packHitSurface(bool areThere, float roughness, float metalness) {
    return packUnorm4x8(vec4(roughness, metalness, 0.0, 0.0)) | (areThere ? 0x10000u : 0u);
}
bool hasHitChannels(uint code) { return (code & 0x10000u) != 0u; }

uint packHitNormal(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    vec2 e = n.z >= 0.0 ? n.xy : folded;
    return packUnorm2x16(e * 0.5 + 0.5);
}

vec3 unpackHitNormal(uint code) {
    vec2 e = unpackUnorm2x16(code) * 2.0 - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return n * inversesqrt(dot(n, n));
}
