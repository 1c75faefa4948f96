// Adds up the counts of the workgroups of remesh_count.comp, in one workgroup, and writes what is drawn.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_columns.glsl"

layout(local_size_x = 256) in;

shared uvec2 sums[kCounted];

void main() {
    uint i = gl_LocalInvocationID.x, groups = (columns + kCounted - 1u) / kCounted,
         each = (groups + kCounted - 1u) / kCounted, from = min(i * each, groups), to = min(from + each, groups);
    uvec2 own = uvec2(0u);
    for (uint k = from; k < to; ++k) own += counts[columns + k];
    sums[i] = own;
    barrier();
    for (uint step = 1u; step < kCounted; step *= 2u) {
        uvec2 before = i >= step ? sums[i - step] : uvec2(0u);
        barrier();
        sums[i] += before;
        barrier();
    }
    uvec2 before = sums[i] - own;
    for (uint k = from; k < to; ++k) {
        uvec2 group = counts[columns + k];
        counts[columns + k] = before;
        before += group;
    }
    if (i + 1u < kCounted) return;
    drawn[0] = min(sums[i].y, mostIndices);
    drawn[1] = 1u;
    drawn[2] = 0u;
    drawn[3] = 0u;
    drawn[4] = 0u;
    drawn[5] = min(sums[i].x, mostVertices);
}
