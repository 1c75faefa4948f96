// Composes one dataset's picture with that of all: the nearest surface is seen. Reads tile list, hits and the dataset's
// picture;
// writes the target's picture and depths, world units, and counts the pixels that something is hit in.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/tiles.glsl"
#include "render/shaders/hit_records.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 13, std430) readonly buffer OwnPictureBlock { uint ownPixels[]; };
layout(set = 0, binding = 16, std430) buffer TargetPictureBlock { uint targetPixels[]; };
// The bits of floats; behind them the count.
layout(set = 0, binding = 17, std430) buffer TargetDepthBlock { uint targetDepths[]; };

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
    targetPixels[at] = ownPixels[at];
}
