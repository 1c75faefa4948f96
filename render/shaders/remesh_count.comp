// Counts the vertices and indices of each column of a batch, and adds them up within a workgroup.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_columns.glsl"

layout(local_size_x = 256) in;

shared uvec2 sums[kCounted];

// Vertices and indices of a column; a piece's corners and edges are its first column's.
uvec2 countColumn(uint column) {
    uint first = findPiece(column);
    RemeshSweep s = remeshSweep(0u);
    uint edges = column == first ? uint(s.firstInside) : 0u;
    if (s.plan.isWhole != 0) return uvec2(edges, 3u);
    int at = s.first.x + int(column - first);
    RemeshStrip strip = remeshStrip(s, at, 0u, 0u);
    return uvec2(edges + uint(strip.left.insideCount), 3u * uint(remeshTriangles(strip)));
}

void main() {
    uint i = gl_LocalInvocationID.x, column = gl_GlobalInvocationID.x;
    uvec2 own = column < columns ? countColumn(column) : uvec2(0u);
    sums[i] = own;
    barrier();
    for (uint step = 1u; step < kCounted; step *= 2u) {
        uvec2 before = i >= step ? sums[i - step] : uvec2(0u);
        barrier();
        sums[i] += before;
        barrier();
    }
    if (column < columns) counts[column] = sums[i] - own;
    if (i + 1u == kCounted) counts[columns + gl_WorkGroupID.x] = sums[i];
}
