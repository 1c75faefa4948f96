// Colours of hit pixels from their records. Reads the tile list and hits; writes those pixels of the picture,
// which is the background before.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/tiles.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

vec3 unpackHitNormal(uint code) {
    vec2 e = unpackUnorm2x16(code) * 2.0 - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return n * inversesqrt(dot(n, n));
}

// Blue through green to red.
vec3 heat(float x) { return clamp(vec3(3.0 * x - 1.2, 1.5 - abs(3.0 * x - 1.2), 1.4 - 3.0 * x), 0.0, 1.0); }

// Light that falls on a surface, encoded for the screen. A power of a product is the product of the powers:
// colours come encoded, so that one power a pixel is enough.
float encodedLight(vec3 n) {
    float sun = max(dot(n, frame.lightDirection.xyz), 0.0);
    float sky = 0.5 + 0.5 * dot(n, frame.upDirection.xyz);
    return pow(0.72 * sun + 0.10 + 0.18 * sky, 1.0 / 2.2);
}

void main() {
    uvec2 pixel;
    uint tile;
    if (!listedPixel(tile, pixel)) return;
    uint at = pixel.y * frame.picture.x + pixel.x;
    uint plane = frame.picture.x * frame.picture.y;
    uint code = fetchHit(plane + at);
    if (frame.mode.w == kShadeSteps) {
        picturePixels[at] = packUnorm4x8(vec4(heat(float(code) / 64.0), 1.0));
        return;
    }
    if (uintBitsToFloat(fetchHit(at)) >= kNoHit) return;
    vec3 n = unpackHitNormal(code);
    vec3 albedo = frame.clay.xyz;
    if (kColour != 0u && frame.mode.w == kShadeLit) albedo = unpackUnorm4x8(fetchHit(2u * plane + at)).xyz;
    vec3 colour = frame.mode.w == kShadeNormals ? n * 0.5 + 0.5 : albedo * encodedLight(n);
    picturePixels[at] = packUnorm4x8(vec4(colour, 1.0));
}
