// Takes the pixels of a remeshed surface into the hits, where they are nearer (passes/remesh_raster.h).
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"

layout(constant_id = 5) const uint kTextures = 0u;  // kMesoColours
layout(constant_id = 7) const uint kScene = 0u;     // 1: surfaces and datasets shade each other
layout(constant_id = 8) const uint kTransfer = 0u;
layout(constant_id = 9) const uint kStarts = 0u;
layout(constant_id = 10) const uint kAllTiles = 0u;
layout(local_size_x = 8, local_size_y = 8) in;

uint fetchHit(uint i) { return hits[i]; }
#include "render/shaders/hit_records.glsl"
#include "render/shared/meso_texture_lookup.h"
#include "render/shared/hit_light.h"
#include "render/shaders/meso_scene.glsl"

// The levels of the heights, and what the base triangles are over the map.
#define CONSTANT const
#define PRECISE
#include "mesostructure/shared/remesh_layout.h"
int remeshLevels() { return int(fetchBaseLight(0).x); }
uvec4 fetchHeightQuad(int i) { return fetchQuad(uint(i)); }
void markHeightTile(int entry) {
    if (heightMarks[entry] != heightMarks[0]) heightMarks[entry] = heightMarks[0];
}
#include "render/shaders/remesh_levels.glsl"
#include "mesostructure/shared/remesh_heights.h"
#include "mesostructure/shared/remesh_normal.h"

RemeshFrame frameOf(uint triangle) {
    int first = 1 + int(triangle * kRemeshFrameQuads);
    vec4 u = fetchBaseLight(first), v = fetchBaseLight(first + 1), byU = fetchBaseLight(first + 2),
         byV = fetchBaseLight(first + 3), direction = fetchBaseLight(first + 4), facet = fetchBaseLight(first + 5),
         place = fetchBaseLight(first + 6);
    RemeshFrame frame;
    frame.byU = u.xyz;
    frame.byV = v.xyz;
    frame.directionByU = byU.xyz;
    frame.directionByV = byV.xyz;
    frame.place = place.xyz;
    frame.direction = direction.xyz;
    frame.at = vec2(u.w, v.w);
    frame.toSecond = vec2(byV.w, direction.w);
    frame.toLast = vec2(facet.w, place.w);
    frame.facet = facet.xyz;
    frame.turned = byU.w;
    return frame;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    uint index = pixel.y * view.width + pixel.x, plane = view.width * view.height;
    vec4 hit = texelFetch(inputTexels, int(index));
    if (hit.w == 0.0 || !(hit.x < uintBitsToFloat(hits[kMesoPlaneDepth * plane + index]))) return;
    vec2 at = vec2(pixel) + 0.5;
    vec3 d = normalize(view.forward.xyz + at.x * view.forwardX.xyz + at.y * view.forwardY.xyz);
    RemeshFrame frame = frameOf(uint(hit.w) - 1u);
    // Gradients of the place in the tile; along the base, whatever stands on it.
    vec3 across = cross(frame.byU, frame.byV);
    float square = max(dot(across, across), 1e-30);
    vec3 byU = cross(frame.byV, across) / square, byV = cross(across, frame.byU) / square;
    float width = widthAt(pixel, hit.x) * max(length(byU), length(byV));
    vec3 n = remeshNormal(frame, width * float(remeshLevel(0).size.x), hit.yz);
    vec4 look = vec4(view.colour, 1.0);
    if (kTextures != 0u) {
        float footprint = width / max(abs(dot(frame.facet, d)), kLeastSlope);
        if ((kTextures & kMesoNormals) != 0u) {
            mat3 tile = tileFrame(mat3(byU, byV, frame.facet));
            n = normalize(tile * bentNormal(n * tile, sampleTexture(view.normals, hit.yz, footprint).xyz));
        }
        if ((kTextures & kMesoColours) != 0u)
            look.xyz = encodedColour(sampleTexture(view.colours, hit.yz, footprint).xyz);
    }
    // A normal that points away from the eye is turned until it does not.
    if (dot(n, d) > 0.0) n = dot(n, d) > 0.99 ? -d : normalize(n - dot(n, d) * d);
    uint code = max(packHitNormal(n), 1u);  // 0 means that a pixel has no mesostructure
    hits[kMesoPlaneDepth * plane + index] = floatBitsToUint(hit.x);
    hits[kMesoPlaneNormal * plane + index] = code;
    hits[kMesoPlaneLook * plane + index] = packUnorm4x8(look);
    hits[kMesoPlaneLight * plane + index] = ~0u;  // before shadows, all of each light arrives
    hits[kMesoPlaneIterations * plane + index] += 1u;
    if (kTransfer != 0u) hits[kMesoPlaneTransfer * plane + index] = 0u;
    if (kStarts != 0u) {
        vec3 eye = view.eye.xyz + at.x * view.eyeX.xyz + at.y * view.eyeY.xyz;
        keepStart(index, frame.turned != 0.0 ? remeshShellPoint(frame, hit.yz) - (eye + hit.x * d) : vec3(0.0));
    }
    if (kScene == 0u) return;
    // Triangles err by up to a part of a pixel: rays of light begin half a pixel above them.
    keepInScene(index, hit.x, code, max(view.shadowLift, 0.5 * widthAt(pixel, hit.x)), false);
}
