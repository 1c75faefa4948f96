// The surfaces that a picture of several datasets shows, and the light there (passes/scene_light.h).

layout(set = 0, binding = 16, std430) buffer TargetPictureBlock { uint targetPixels[]; };
// Bits of floats, world units; behind them the count of pixels that something is hit in.
layout(set = 0, binding = 17, std430) buffer TargetDepthBlock { uint targetDepths[]; };
layout(set = 0, binding = 20, std430) buffer SceneLightBlock { uint sceneLight[]; };

uint scenePlane() { return frame.width * frame.height; }
#include "render/shaders/scene_planes.glsl"

// Light of all datasets at a pixel, as the hits' plane of light.
uint sceneLightAt(uint pixel) { return sceneLight[sceneAt(kSceneLight, pixel)]; }

void storeScenePicture(uint pixel, uint colour) { targetPixels[pixel] = colour; }
