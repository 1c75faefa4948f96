// Colours of the picture from the pixels' records. Reads tile starts and hits; writes the picture.
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

// The sRGB curve within 1/255, without a power.
vec3 encodeSrgb(vec3 linear) {
    vec3 c = clamp(linear, 0.0, 1.0);
    vec3 s1 = sqrt(c), s2 = sqrt(s1), s3 = sqrt(s2);
    return mix(0.585122381 * s1 + 0.783140355 * s2 - 0.368262736 * s3, 12.92 * c, lessThan(c, vec3(0.0031308)));
}

// Blue through green to red.
vec3 heat(float x) { return clamp(vec3(3.0 * x - 1.2, 1.5 - abs(3.0 * x - 1.2), 1.4 - 3.0 * x), 0.0, 1.0); }

vec3 lit(vec3 albedo, vec3 n) {
    float sun = max(dot(n, frame.lightDirection.xyz), 0.0);
    float sky = 0.5 + 0.5 * dot(n, frame.upDirection.xyz);
    return albedo * (0.75 * sun + mix(0.12, 0.32, sky));
}

void main() {
    uvec2 pixel = gl_WorkGroupID.xy * kTileSize + pixelInTile();
    if (any(greaterThanEqual(pixel, frame.picture.xy))) return;
    uint at = pixel.y * frame.picture.x + pixel.x;
    uint plane = frame.picture.x * frame.picture.y;
    uint tile = gl_WorkGroupID.y * frame.picture.z + gl_WorkGroupID.x;
    bool traced = fetchTileStart(tile) < kTileEmpty;
    bool found = traced && uintBitsToFloat(fetchHit(at)) < kNoHit;
    float y = (float(pixel.y) + 0.5) / float(frame.picture.y);
    vec3 colour = mix(frame.backgroundTop.xyz, frame.backgroundBottom.xyz, y);
    uint code = fetchHit(plane + at);
    if (frame.mode.w == kShadeSteps) {
        if (traced) colour = heat(float(code) / 64.0);
    } else if (found) {
        vec3 n = unpackHitNormal(code);
        vec3 albedo = frame.clay.xyz;
        if (kColour != 0u && frame.mode.w == kShadeLit) {
            // Vertex colours are sRGB; their square is close enough to linear.
            vec3 c = unpackUnorm4x8(fetchHit(2u * plane + at)).xyz;
            albedo = c * c;
        }
        colour = frame.mode.w == kShadeNormals ? n * 0.5 + 0.5 : lit(albedo, n);
    }
    picturePixels[at] = packUnorm4x8(vec4(encodeSrgb(colour), 1.0));
}
