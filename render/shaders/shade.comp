// Colours the hit pixels from their records. Reads tile list, tile starts and hits; writes those pixels of the picture,
// which holds the background before. Where datasets shade each other, reads the light of all, and writes the pixels of
// the picture of all in which this dataset is nearest.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/tiles.glsl"
#include "render/shaders/hit_records.glsl"
#include "render/shared/hit_light.h"
#include "render/shared/channel_light.h"
#include "render/shared/wireframe.h"
#include "render/shaders/scene_light.glsl"

// 0: none; 1: the hits have a plane of light; 2: the picture of several datasets has.
layout(constant_id = 7) const uint kLight = 0u;
layout(local_size_x = 8, local_size_y = 8) in;

// Returns how much sky is seen, averaged over the pixels around that show the same surface: light.comp gives each pixel
// of a square of 4 x 4 its own directions.
float skyAbout(uvec2 pixel, float depth, uint plane) {
    float reach = 8.0 * pixelEdgeAt(depth);
    float sum = 0.0, count = 0.0;
    for (int i = 0; i < 16; i++) {
        ivec2 p = clamp(ivec2(pixel) + ivec2((i & 3) - 1, (i >> 2) - 1), ivec2(0), ivec2(pictureSize()) - 1);
        uint at = uint(p.y) * frame.width + uint(p.x);
        // Tiles that were not traced have no depths.
        bool traced = fetchTileStart(uint(p.y) / kTileSize * frame.tilesX + uint(p.x) / kTileSize) < kTileEmpty;
        bool same = traced && abs(fetchPixelHit(at).depth - depth) <= reach;
        sum += same ? unpackUnorm4x8(fetchHit(frame.lightPlane * plane + at)).y : 0.0;
        count += same ? 1.0 : 0.0;
    }
    return sum / max(count, 1.0);
}

// Returns the light of all that is seen of them.
float sunlightOfAll(vec3 n, uint seen) {
    float sum = sunlightOf(n, frame.lightDirection.xyz, float(seen & 1u));
    if (frame.lightCount == 1u && frame.lightDirection.w == 1.0) return sum;
    sum *= frame.lightDirection.w;
    for (uint i = 1u; i < frame.lightCount; i++) {
        vec4 light = lightNumbered(i);
        sum += light.w * sunlightOf(n, light.xyz, float(seen >> i & 1u));
    }
    return sum;
}

// Returns all light on a surface, encoded for the screen.
vec3 lightOn(vec3 n, float sunlight, float skySeen) {
    if (frame.hasEnvironment != 0u)
        return lightInEnvironment(environmentLight(n, frame.environment), sunlight, skySeen);
    return vec3(encodedLight(n, frame.upDirection.xyz, sunlight, skySeen));
}

vec3 surroundings(vec3 n) {
    if (frame.hasEnvironment != 0u) return environmentLight(n, frame.environment);
    return vec3(skylight(n, frame.upDirection.xyz));
}

// Returns the colour of a surface whose material has channels, as render/host/tile_channels.cpp finds it.
vec3 channelColour(LitSurface s, vec3 n, vec3 eye, uint seen, float skySeen) {
    vec3 light = s.emission;
    DONT_UNROLL for (uint i = 0u; i < frame.lightCount; i++) {
        vec4 from = lightNumbered(i);
        float falling = from.w * sunlightOf(n, from.xyz, float(seen >> i & 1u)) * (0.5 + 0.5 * skySeen);
        if (falling > 0.0) light += falling * reflectedPart(s, n, from.xyz, eye);
    }
    ReflectedParts parts = reflectedParts(s, n, eye);
    light += skySeen * (parts.matt * surroundings(n) + parts.mirrored * surroundings(seenDirection(s, n, eye)));
    return colourOfLight(light);
}

void main() {
    uvec2 pixel;
    uint tile;
    if (!listedPixel(tile, pixel)) return;
    uint at = pixel.y * frame.width + pixel.x;
    uint plane = frame.width * frame.height;
    PixelHit hit = fetchPixelHit(at);
    float depth = hit.depth;
    bool ofWork = kFalseColour != 0u && (frame.shadingMode >= kShadeSteps && frame.shadingMode <= kShadeFetches);
    if (depth >= kNoHit && !ofWork) return;
    bool wired = kFalseColour != 0u && frame.shadingMode == kShadeWireframe;
    if (kFalseColour != 0u && !wired) {
        float value = uintBitsToFloat(fetchHit(frame.lightPlane * plane + at));
        storePicture(at, packUnorm4x8(vec4(heat(value), 1.0)));
        return;
    }
    vec3 n = unpackHitNormal(fetchHit(plane + at));
    bool coloured = frame.shadingMode == kShadeLit || frame.shadingMode == kShadeUnlit;
    vec3 albedo = frame.clay.xyz;
    if (kColour != 0u && coloured) albedo = unpackUnorm4x8(fetchHit(2u * plane + at)).xyz;
    if (hit.onCap) albedo = frame.cap.xyz;
    float skySeen = 1.0;
    uint seen = 255u;
    if (kLight == 1u) {
        seen = fetchHit(frame.lightPlane * plane + at) & 255u;
        if (frame.occlusionRays > 0u) skySeen = skyAbout(pixel, depth, plane);
    }
    if (kLight == 2u) {
        if (depth * frame.worldPerCell != sceneDepth(at)) return;
        if (frame.hasShadows != 0u) seen = sceneLightAt(at) & 255u;
        float reach = 8.0 * pixelEdgeAt(sceneDepth(at) / frame.worldPerCell) * frame.worldPerCell;
        if (frame.occlusionRays > 0u) skySeen = sceneSkyAbout(pixel, pictureSize(), sceneDepth(at), reach);
    }
    vec3 colour = frame.shadingMode == kShadeNormals ? turnedBy(frame.rotation.xyz, frame.rotation.w, n) * 0.5 + 0.5
                  : frame.shadingMode == kShadeUnlit ? albedo
                                                     : albedo * lightOn(n, sunlightOfAll(n, seen), skySeen);
    bool hasChannels = false;
    uint behind = frame.lightPlane + 1u;
    if (kColour == 3u) hasChannels = hasHitChannels(fetchHit((behind + 1u) * plane + at));
    while (hasChannels) {
        vec2 surface = unpackUnorm4x8(fetchHit((behind + 1u) * plane + at)).xy;
        vec3 emission = lightOfColour(unpackUnorm4x8(fetchHit((behind + 2u) * plane + at)).xyz);
        colour = channelColour(LitSurface(lightOfColour(albedo), surface.x, surface.y, emission),
                               unpackHitNormal(fetchHit(behind * plane + at)), -rayAt(vec2(pixel) + 0.5).direction,
                               seen, skySeen);
        hasChannels = false;
    }
    if (wired) {
        float line = uintBitsToFloat(fetchHit(frame.lightPlane * plane + at));
        colour = mix(colour, line < 0.0 ? leafInk() : triangleInk(), abs(line));
    }
    if (kLight == 2u)
        storeScenePicture(at, packUnorm4x8(vec4(colour, 1.0)));
    else
        storePicture(at, packUnorm4x8(vec4(colour, 1.0)));
}
