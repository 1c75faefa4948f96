// Composes one dataset's picture with that of all: the nearest surface is seen. Reads tile list, hits and the dataset's
// picture;
// writes the target's picture and depths, world units, and counts the pixels that something is hit in. Where datasets
// shade each other there is no picture yet: gathers normals and lifts in its place.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/tiles.glsl"
#include "render/shaders/hit_records.glsl"
#include "render/shared/hit_light.h"
#include "render/shaders/scene_light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 13, std430) readonly buffer OwnPictureBlock { uint ownPixels[]; };
layout(constant_id = 7) const uint kGathers = 0u;  // 1: normals and lifts in place of the picture

void main() {
    uvec2 pixel;
    uint tile;
    if (!listedPixel(tile, pixel)) return;
    uint at = pixel.y * frame.width + pixel.x;
    float depth = fetchPixelHit(at).depth;
    if (depth >= kNoHit) return;
    float distance = depth * frame.worldPerCell;
    float before = uintBitsToFloat(targetDepths[at]);
    if (distance >= before) return;
    if (before >= kNoHit) atomicAdd(targetDepths[frame.width * frame.height], 1u);
    targetDepths[at] = floatBitsToUint(distance);
    if (kGathers == 0u) {
        targetPixels[at] = ownPixels[at];
        return;
    }
    vec3 n = unpackHitNormal(fetchHit(frame.width * frame.height + at));
    float lift = (0.15 + frame.lightLift * pixelEdgeAt(depth)) * frame.worldPerCell;
    sceneLight[sceneAt(kSceneNormal, at)] = packHitNormal(turnedBy(frame.rotation.xyz, frame.rotation.w, n));
    sceneLight[sceneAt(kSceneLift, at)] = floatBitsToUint(lift);
}
