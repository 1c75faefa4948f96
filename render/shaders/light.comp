// Traces the light that reaches each hit: one ray to each light, and some into the sky above the surface. Reads pool,
// table, tile list and hits; writes the hits' plane of light.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/tiles.glsl"
const uint kHitBy = kHitByLight;
#include "render/shaders/cast.glsl"
#include "render/shaders/sections.glsl"
#include "render/shaders/hit_records.glsl"
#include "render/shared/hit_light.h"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec2 pixel;
    uint tile;
    if (!listedPixel(tile, pixel)) return;
    uint at = pixel.y * frame.width + pixel.x;
    uint plane = frame.width * frame.height;
    float depth = fetchPixelHit(at).depth;
    vec3 n = unpackHitNormal(fetchHit(plane + at));
    Ray eye = rayAt(vec2(pixel) + 0.5);
    bool found = depth < kNoHit;
    // The picture's own error and the roundings stay below the lift.
    float lift = 0.15 + frame.lightLift * pixelEdgeAt(depth);
    Ray ray;
    ray.origin = eye.origin + depth * eye.direction + lift * n;

    uint sky = frame.occlusionRays;
    float radius = frame.occlusionReach;
    uint suns = frame.hasShadows * frame.lightCount, seen = 255u;
    float open = 0.0;
    Work work = Work(0u, 0u, 0u);
    for (uint i = 0u; i < suns + sky; i++) {
        bool isSun = i < suns;
        vec3 direction =
            isSun ? lightNumbered(i).xyz : skyDirection(n, i - suns, sky, pixel.x, pixel.y, frame.sampleNumber);
        bool lit = !isSun || dot(n, direction) > 0.0;
        ray.direction = withoutZeros(direction);
        ray.inverse = 1.0 / ray.direction;
        float reach = min(isSun ? kNoHit : radius, keptInterval(ray).last);
        Hit hit = castRay(ray, found && lit ? 0.0 : kNoHit, reach, work);
        bool blocked = hit.depth < reach;
        if (isSun && (blocked || !lit)) seen &= ~bitsOfLight(i);
        if (!isSun) open += blocked ? skyBehind(hit.depth / radius) : 1.0;
    }
    float skyLight = sky == 0u ? 1.0 : open / float(sky);
    if (found) storeHit(frame.lightPlane * plane + at, packUnorm4x8(vec4(0.0, skyLight, 0.0, 0.0)) | seen);
}
