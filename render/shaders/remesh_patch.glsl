// What the stages of patches have in common (render/remesh_meter.h): a patch is a piece, without columns.
#include "render/shaders/remesh_maths.glsl"

layout(push_constant) uniform PatchBlock {
    vec4 plane;  // as in remesh_view.glsl
    vec4 depth;
    RemeshView view;
    uint levels, mapWidth;  // of the heights
};

// The tessellator makes vertices and triangles.
void remeshAddVertex(uint number, vec3 position, vec2 uv, float height) {}
void remeshAddTriangle(uint a, uint b, uint c) {}

const uint kAllTiles = 1u;
void markHeightTile(int entry) {}

#include "render/shaders/remesh_piece.glsl"

int cellsOfEdge(int k) { return remeshEdge(remeshCell(k), remeshCell((k + 1) % 3)).cells; }
