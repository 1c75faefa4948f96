// Casts a ray of light from each pixel of a picture of several datasets through one of them: the sun's, or one into the
// sky. Dispatched for each ray and, one after the other, each dataset. Reads the dataset's pool and table, and depths,
// normals and lifts of the picture; reads and writes its planes of light and of nearest hits.
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
#include "render/shaders/scene_light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant) uniform RayBlock { SceneRay light; };

// Turns a vector from the world's axes to the dataset's.
vec3 turnedFromWorld(vec3 v) { return turnedBy(-frame.rotation.xyz, frame.rotation.w, v); }

// Returns the ray from above the hit at a depth. Lengths are world units.
Ray lightRay(uvec2 pixel, float depth, float lift, vec3 normal, vec3 direction) {
    Ray eye = rayAt(vec2(pixel) + 0.5), ray;
    float perWorld = 1.0 / frame.worldPerCell;
    ray.origin = eye.origin + depth * perWorld * eye.direction + lift * perWorld * turnedFromWorld(normal);
    ray.direction = withoutZeros(turnedFromWorld(direction));
    ray.inverse = 1.0 / ray.direction;
    return ray;
}

void main() {
    uvec2 pixel;
    if (!anyPixel(pixel)) return;
    uint at = pixel.y * frame.width + pixel.x;
    float depth = sceneDepth(at);
    if (depth >= kNoHit) return;
    vec3 n = unpackHitNormal(sceneLight[sceneAt(kSceneNormal, at)]);
    float keptLift = uintBitsToFloat(sceneLight[sceneAt(kSceneLift, at)]), lift = abs(keptLift);
    bool isSun = light.number > kSunRay - kMaxLights;
    uint number = isSun ? kSunRay - light.number : 0u, bits = bitsOfLight(number);
    vec3 sun = turnedBy(frame.rotation.xyz, frame.rotation.w, lightNumbered(number).xyz);
    bool lit = keptLift < 0.0 || dot(n, sun) > 0.0;
    uint sky = frame.occlusionRays;

    // Where pages are marked, each ray goes through each dataset.
    bool marks = frame.firstHitMark != 0u;
    float near = isSun || light.isFirst != 0u ? kNoHit : uintBitsToFloat(sceneLight[sceneAt(kSceneNear, at)]);
    uint seen = lightBefore(at, light.number == kSunRay && light.isFirst != 0u && sky == 0u);
    vec3 direction = isSun ? sun : skyDirection(n, light.number, sky, pixel.x, pixel.y, frame.sampleNumber);
    Ray ray = lightRay(pixel, depth, lift, n, direction);
    float radius = isSun ? kNoHit : marks ? frame.occlusionReach : min(frame.occlusionReach, near / frame.worldPerCell);
    float reach = min(radius, keptInterval(ray).last);
    bool needed = !isSun || (lit && (marks || (seen & bits) != 0u));
    Work work = Work(0u, 0u, 0u);
    Hit hit = castRay(ray, needed ? 0.0 : kNoHit, reach, work);
    bool blocked = hit.depth < reach;
    if (isSun) {
        sceneLight[sceneAt(kSceneLight, at)] = blocked || !lit ? seen & ~bits : seen;
        return;
    }
    if (blocked) near = min(near, hit.depth * frame.worldPerCell);
    keepSkyRay(at, near, light.number, sky, light.isLast != 0u, frame.occlusionReach * frame.worldPerCell);
}
