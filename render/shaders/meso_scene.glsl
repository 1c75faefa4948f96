// Surfaces in a picture in which they and datasets shade each other.
#include "render/shared/frame_layout.h"

uint scenePlane() { return view.width * view.height; }
#include "render/shaders/scene_planes.glsl"

// Returns a pixel's width at a depth, world units.
float widthAt(uvec2 pixel, float depth) {
    vec2 at = vec2(pixel) + 0.5;
    vec3 towards = view.forward.xyz + at.x * view.forwardX.xyz + at.y * view.forwardY.xyz;
    return length(view.eyeX.xyz) + length(view.forwardX.xyz) / length(towards) * depth;
}

// Bits of a light in a plane of light: the one light has all eight.
uint lightBits(uint number) { return view.lightCount == 1u ? 255u : 1u << number; }

// Makes a hit on the surface what the picture shows. `lift`: by which rays of light begin above it.
void keepInScene(uint pixel, float depth, uint normal, float lift, bool isFar) {
    targetDepths[pixel] = floatBitsToUint(depth);
    sceneLight[sceneAt(kSceneNormal, pixel)] = normal;
    sceneLight[sceneAt(kSceneLift, pixel)] = floatBitsToUint(isFar ? -lift : lift);
}

// By how much rays of light start elsewhere than where a pixel's own ray is at its depth.
void keepStart(uint pixel, vec3 off) {
    for (uint i = 0u; i < kMesoStartPlanes; i++) hits[(kStarts + i) * scenePlane() + pixel] = floatBitsToUint(off[i]);
}
vec3 startOff(uint pixel) {
    if (kStarts == 0u) return vec3(0.0);
    uint at = kStarts * scenePlane() + pixel;
    return uintBitsToFloat(uvec3(hits[at], hits[at + scenePlane()], hits[at + 2u * scenePlane()]));
}
