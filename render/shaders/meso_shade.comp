// Colours of the mesostructure's hits, over what the picture shows already.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"

layout(constant_id = 7) const uint kScene = 0u;  // 1: surfaces and datasets shade each other
layout(constant_id = 8) const uint kTransfer = 0u;
const uint kStarts = 0u;
layout(local_size_x = 8, local_size_y = 8) in;

uint fetchHit(uint i) { return hits[i]; }
#include "render/shaders/hit_records.glsl"
#include "render/shared/hit_light.h"
#include "render/shared/meso_light.h"
#include "render/shaders/meso_scene.glsl"

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    uint index = pixel.y * view.width + pixel.x, plane = view.width * view.height;
    if (uintBitsToFloat(hits[kMesoPlaneDepth * plane + index]) < kMesoNoHit) atomicAdd(counters[2], 1u);
    uint shown = view.shows;
    if (shown == kMesoShowHeat) {
        uint iterations = hits[kMesoPlaneIterations * plane + index];
        if (iterations > 0u)
            picturePixels[index] = packUnorm4x8(vec4(heat(min(float(iterations) / kMesoHottest, 1.0)), 1.0));
        return;
    }
    uint code = hits[kMesoPlaneNormal * plane + index];
    if (code == 0u) return;
    vec3 n = unpackHitNormal(code);
    vec4 look = unpackUnorm4x8(hits[kMesoPlaneLook * plane + index]);
    vec3 result = look.xyz;
    if (shown == kMesoShowNormals)
        result = n * 0.5 + 0.5;
    else if (shown == kMesoShowLit) {
        vec4 light = unpackUnorm4x8(hits[kMesoPlaneLight * plane + index]);
        float skySeen = 1.0;
        if (kScene != 0u) {
            uint seen = sceneLight[sceneAt(kSceneLight, index)];
            for (uint i = 0u; i < view.lightCount; i++)
                if ((seen & lightBits(i)) == 0u) light[i] = 0.0;
            float depth = sceneDepth(index);
            if (ray.occlusionRays > 0u)
                skySeen = sceneSkyAbout(pixel, uvec2(view.width, view.height), depth, 8.0 * widthAt(pixel, depth));
        }
        uint arrives = kTransfer != 0u ? hits[kMesoPlaneTransfer * plane + index] : 0u;
        result *= mesoLight(n, look.w, light, skySeen, arrives);
    }
    picturePixels[index] = packUnorm4x8(vec4(result, 1.0));
}
