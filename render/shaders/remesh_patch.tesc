// Says what a piece's edges are split into: as many parts as in the sweep, so that neighbours agree.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_patch.glsl"

layout(vertices = 3) out;
layout(location = 0) in uint piece[];
layout(location = 0) patch out uint patchPiece;

void main() {
    gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
    if (gl_InvocationID > 0) return;
    patchPiece = piece[0];
    firstPieceQuad = patchPiece * kRemeshPieceQuads;
    RemeshPlan plan = remeshPlan(remeshCell(0), remeshCell(1), remeshCell(2));
    // The i-th level is that of the edge across from corner i.
    for (int k = 0; k < 3; ++k) gl_TessLevelOuter[(k + 2) % 3] = plan.isWhole != 0 ? 1.0 : float(cellsOfEdge(k));
    int area = remeshArea(remeshCell(plan.first), remeshCell(plan.second), remeshCell(plan.apex), plan.sweep, plan.side);
    // Three halves of the square of the inner level are triangles, of which the sweep makes `area`.
    gl_TessLevelInner[0] = clamp(round(sqrt(float(area) / 1.5)), 1.0, 64.0);
}
