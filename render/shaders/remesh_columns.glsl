// What remesh_count.comp, remesh_scan.comp and remesh_emit.comp have in common (passes/remesh_sweep.h). An invocation
// has a column.
#include "render/shaders/remesh_maths.glsl"

layout(push_constant) uniform RemeshBlock {
    RemeshView view;
    uint levels, mapWidth;  // of the heights
    uint pieces, columns;
    uint mostVertices, mostIndices;  // that there is room for
};
layout(set = 0, binding = 2) uniform utextureBuffer firstColumns;
// Vertices and indices before a column within its workgroup; then before the workgroup, and their sum.
layout(set = 0, binding = 3, std430) buffer CountBlock { uvec2 counts[]; };
layout(set = 0, binding = 4, std430) buffer DrawBlock { uint drawn[]; };  // VkDrawIndexedIndirectCommand, and vertices
layout(set = 0, binding = 5, std430) buffer VertexBlock { uvec2 vertices[]; };
layout(set = 0, binding = 6, std430) buffer IndexBlock { uint indices[]; };
layout(set = 0, binding = 7, std430) buffer HeightMarkBlock { uint heightMarks[]; };  // as in meso_bindings.glsl

layout(constant_id = 0) const uint kAllTiles = 0u;

const uint kCounted = 256u;  // columns of a workgroup of remesh_count.comp

uint nextIndex;  // of the invocation's triangles

uint pieceTriangle();

void remeshAddVertex(uint number, vec3 position, vec2 uv, float height) {
    if (number >= mostVertices) return;
    vertices[3u * number] = floatBitsToUint(position.xy);
    vertices[3u * number + 1u] = floatBitsToUint(vec2(position.z, uv.x));
    vertices[3u * number + 2u] = uvec2(floatBitsToUint(uv.y), pieceTriangle());
}

void remeshAddTriangle(uint a, uint b, uint c) {
    if (nextIndex + 3u > mostIndices) return;
    indices[nextIndex] = a;
    indices[nextIndex + 1u] = b;
    indices[nextIndex + 2u] = c;
    nextIndex += 3u;
}

void markHeightTile(int entry) {
    if (heightMarks[entry] != heightMarks[0]) heightMarks[entry] = heightMarks[0];
}

#include "render/shaders/remesh_piece.glsl"

// Finds the piece of a column, and returns the piece's first column.
uint findPiece(uint column) {
    uint low = 0u, high = pieces;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (texelFetch(firstColumns, int(middle)).x <= column)
            low = middle;
        else
            high = middle;
    }
    firstPieceQuad = low * kRemeshPieceQuads;
    return texelFetch(firstColumns, int(low)).x;
}

// Where the counts of workgroups are, after those of columns.
uint groupCount(uint column) { return columns + column / kCounted; }
