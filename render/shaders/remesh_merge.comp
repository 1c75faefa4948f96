// Takes the pixels of a remeshed surface into the hits, where they are nearer (passes/remesh_raster.h).
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"

layout(constant_id = 5) const uint kTextures = 0u;  // kMesoColours
layout(constant_id = 7) const uint kScene = 0u;     // 1: surfaces and datasets shade each other
layout(constant_id = 8) const uint kTransfer = 0u;
layout(local_size_x = 8, local_size_y = 8) in;

uint fetchHit(uint i) { return hits[i]; }
#include "render/shaders/hit_records.glsl"
#include "render/shared/meso_texture_lookup.h"
#include "render/shared/hit_light.h"
#include "render/shaders/meso_scene.glsl"

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    uint index = pixel.y * view.width + pixel.x, plane = view.width * view.height;
    vec4 hit = texelFetch(inputTexels, int(index));
    if (hit.w == 0.0 || !(hit.x < uintBitsToFloat(hits[kMesoPlaneDepth * plane + index]))) return;
    vec4 surface = uintBitsToFloat(fetchQuad(index));
    vec4 look = vec4(view.colour, 1.0);
    if (kTextures != 0u) look.xyz = encodedColour(sampleTexture(view.colours, hit.yz, surface.w).xyz);
    uint code = max(packHitNormal(surface.xyz), 1u);  // 0 means that a pixel has no mesostructure
    hits[kMesoPlaneDepth * plane + index] = floatBitsToUint(hit.x);
    hits[kMesoPlaneNormal * plane + index] = code;
    hits[kMesoPlaneLook * plane + index] = packUnorm4x8(look);
    hits[kMesoPlaneLight * plane + index] = ~0u;  // before shadows, all of each light arrives
    hits[kMesoPlaneIterations * plane + index] += 1u;
    if (kTransfer != 0u) hits[kMesoPlaneTransfer * plane + index] = 0u;
    if (kScene == 0u) return;
    // Triangles are as large as pixels: rays of light begin half a pixel above them.
    keepInScene(index, hit.x, code, max(view.shadowLift, 0.5 * widthAt(pixel, hit.x)), false);
}
