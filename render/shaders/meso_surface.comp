// Casts a picture's rays through the shell of one surface (mesostructure/shell.h), and rays of light: towards the
// lights from the hits on all surfaces, or, where surfaces and datasets shade each other, one ray from all that is
// seen. Reads and writes the hits: depth, normal, look and light, iterations. A surface replaces what is farther. With
// kScene the depths and planes of light of the whole picture are written, too.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"
#include "render/shaders/meso_march.glsl"

// What is cast. 0: the picture's rays; 1: towards the lights from hits on surfaces; 2: `ray`, towards a light; 3:
// `ray`, into the sky.
layout(constant_id = 4) const uint kRays = 0u;
const uint kShadow = kRays == 1u || kRays == 2u ? 1u : 0u;
layout(constant_id = 5) const uint kTextures = 0u;  // kMesoColours, kMesoNormals
layout(constant_id = 6) const uint kFromFar = 0u;  // 1: slabs that are less high than a part of a pixel are not marched
layout(constant_id = 7) const uint kScene = 0u;    // 1: surfaces and datasets shade each other
layout(constant_id = 8) const uint kTransfer = 0u;  // kMesoTransferKept, kMesoTransferRead
layout(constant_id = 9) const uint kStarts = 0u;    // the planes of starts (kMesoStartPlanes)
layout(local_size_x = 8, local_size_y = 8) in;

uint fetchHit(uint i) { return hits[i]; }
#include "render/shaders/hit_records.glsl"
#include "mesostructure/shared/harmonics.h"
#include "mesostructure/shared/transfer_lookup.h"
#include "render/shared/shell_cast.h"
#include "render/shared/hit_light.h"
#include "render/shaders/meso_scene.glsl"

// Returns where a ray of light is stopped, within `reach`; else `reach`.
float castLight(vec3 from, vec3 direction, float reach) {
    ShellKept kept = keptPart(from, direction);
    float left = min(reach, kept.last) - kept.first;
    if (left <= 0.0) return reach;
    ShellHit hit = castShell(from + kept.first * direction, direction, left);
    if (hit.unresolved) atomicAdd(counters[0], 1u);
    return hit.t < left ? kept.first + hit.t : reach;
}

// Finds which of the lights do not reach a hit.
void castShadows(uint index, vec3 from, vec3 n) {
    uint plane = view.width * view.height, at = kMesoPlaneLight * plane + index, light = hits[at];
    bool isFar = unpackUnorm4x8(hits[kMesoPlaneLook * plane + index]).w < 1.0;
    for (uint i = 0u; i < view.lightCount; i++) {
        // Only mesostructure that is not yet in the dark casts a shadow ray.
        vec3 towards = view.lights[i].xyz;
        if ((light >> 8u * i & 255u) == 0u || (!isFar && dot(n, towards) <= 0.0)) continue;
        if (castLight(from, towards, kMesoNoHit) < kMesoNoHit) light &= ~(255u << 8u * i);
    }
    hits[at] = light;
}

// Casts `ray` from the place that a pixel shows.
void castSceneRay(uvec2 pixel, uint index, vec3 place) {
    vec3 n = unpackHitNormal(sceneLight[sceneAt(kSceneNormal, index)]);
    float lift = uintBitsToFloat(sceneLight[sceneAt(kSceneLift, index)]);
    bool onSurface = hits[kMesoPlaneNormal * scenePlane() + index] != 0u, isFar = lift < 0.0;
    vec3 from = place + (onSurface ? view.shadowLift : lift) * n;
    if (kRays == 2u) {
        uint number = kSunRay - ray.number, bits = lightBits(number);
        vec3 towards = view.lights[number].xyz;
        uint seen = lightBefore(index, number == 0u && ray.isFirst != 0u && ray.occlusionRays == 0u);
        bool blocked = !isFar && dot(n, towards) <= 0.0;
        if (!blocked && (seen & bits) != 0u) blocked = castLight(from, towards, kMesoNoHit) < kMesoNoHit;
        sceneLight[sceneAt(kSceneLight, index)] = blocked ? seen & ~bits : seen;
        return;
    }
    float near =
        ray.isFirst != 0u ? ray.reach : min(ray.reach, uintBitsToFloat(sceneLight[sceneAt(kSceneNear, index)]));
    near = castLight(from, skyDirection(n, ray.number, ray.occlusionRays, pixel.x, pixel.y, ray.sampleNumber), near);
    keepSkyRay(index, near, ray.number, ray.occlusionRays, ray.isLast != 0u, ray.reach);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= view.width || pixel.y >= view.height) return;
    vec2 at = vec2(pixel) + 0.5;
    uint index = pixel.y * view.width + pixel.x, plane = view.width * view.height;
    vec3 eye = view.eye.xyz + at.x * view.eyeX.xyz + at.y * view.eyeY.xyz;
    vec3 towards = view.forward.xyz + at.x * view.forwardX.xyz + at.y * view.forwardY.xyz, d = normalize(towards);
    float depth = uintBitsToFloat(hits[kMesoPlaneDepth * plane + index]);
    widthAtStart = length(view.eyeX.xyz);
    widthGrowth = length(view.forwardX.xyz) / length(towards);
    if (kRays > 1u) {
        if (depth >= kMesoNoHit) return;
        widthAtStart = pixelWidth(depth);
        widthGrowth = 0.0;
        castSceneRay(pixel, index, eye + depth * d + startOff(index));
        return;
    }
    if (kRays == 1u) {
        uint code = hits[kMesoPlaneNormal * plane + index];
        if (code == 0u) return;
        widthAtStart = pixelWidth(depth);
        widthGrowth = 0.0;
        vec3 n = unpackHitNormal(code);
        castShadows(index, eye + depth * d + startOff(index) + view.shadowLift * n, n);
        return;
    }
    ShellKept kept = keptPart(eye, d);
    float reach = min(depth, kept.last) - kept.first;
    if (reach <= 0.0) return;
    eye += kept.first * d;
    widthAtStart += widthGrowth * kept.first;
    ShellHit hit = castShell(eye, d, reach);
    hits[kMesoPlaneIterations * plane + index] += hit.iterations;
    if (hit.unresolved) atomicAdd(counters[0], 1u);
    if (!(hit.t < reach)) return;
    if (hit.far) atomicAdd(counters[1], 1u);
    vec3 n = normalize(hit.normal);
    ShellLook look = lookOf(hit, eye + hit.t * d, d, pixelWidth(hit.t), n);
    if (kTransfer != 0u) {
        bool isRead = kTransfer == kMesoTransferRead && !hit.far && !hit.cut;
        hits[kMesoPlaneTransfer * plane + index] = isRead ? packedLight(transferredLight(hit, eye + hit.t * d, n)) : 0u;
    }
    if (dot(n, d) > 0.0) n -= dot(n, d) * d;
    uint code = max(packHitNormal(normalize(n)), 1u);  // 0 means that a pixel has no mesostructure
    hits[kMesoPlaneDepth * plane + index] = floatBitsToUint(kept.first + hit.t);
    hits[kMesoPlaneNormal * plane + index] = code;
    hits[kMesoPlaneLook * plane + index] = packUnorm4x8(vec4(look.colour, look.sky));
    hits[kMesoPlaneLight * plane + index] = packUnorm4x8(look.light);
    if (kStarts != 0u) keepStart(index, vec3(0.0));
    if (kScene != 0u) keepInScene(index, kept.first + hit.t, code, view.shadowLift, look.sky < 1.0);
}
