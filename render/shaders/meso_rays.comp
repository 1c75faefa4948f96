// Marches a list of rays through one asset, which `vcp bench meso --device` times and the tests compare with the
// reference. A ray is three texels: origin and tMax, direction and 1 where it starts on the slab's top, its bend; a
// result is eight words.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/meso_bindings.glsl"
#include "render/shaders/meso_march.glsl"

layout(local_size_x = 64) in;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= view.width) return;
    vec4 a = texelFetch(inputTexels, int(3u * i)), b = texelFetch(inputTexels, int(3u * i + 1u));
    float tMax = a.w, startsAtTop = b.w, bend = texelFetch(inputTexels, int(3u * i + 2u)).x;
    MesoResult r = marchMeso(MesoRay(a.xyz, b.xyz, tMax, startsAtTop > 0.0, false, bend));
    uint at = 8u * i;
    hits[at] = r.state;
    hits[at + 1u] = floatBitsToUint(r.t);
    hits[at + 2u] = floatBitsToUint(r.normal.x);
    hits[at + 3u] = floatBitsToUint(r.normal.y);
    hits[at + 4u] = floatBitsToUint(r.normal.z);
    hits[at + 5u] = r.iterations;
    hits[at + 6u] = r.fetches;
    hits[at + 7u] = r.tests;
}
