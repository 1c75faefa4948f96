// Writes the vertices and indices of each column of a batch, to where remesh_count.comp and remesh_scan.comp say.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_columns.glsl"

layout(local_size_x = 64) in;

uvec2 countBefore(uint column) { return counts[column] + counts[groupCount(column)]; }

void main() {
    uint column = gl_GlobalInvocationID.x;
    if (column >= columns) return;
    uint first = findPiece(column);
    uvec2 before = countBefore(column);
    RemeshSweep s = remeshSweep(countBefore(first).x);
    uint inside = column == first ? s.firstVertex + uint(s.firstInside) : before.x;
    nextIndex = before.y;
    remeshAddColumn(s, s.first.x + int(column - first), inside);
}
