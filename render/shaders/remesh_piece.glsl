// A piece of a remeshed surface, by the shared maths: what the sweep (remesh_columns.glsl) and patches
// (remesh_patch.glsl) have in common. Whoever includes this has pushed `view`, `levels` and `mapWidth`, and has
// remeshAddVertex and remeshAddTriangle (mesostructure/shared/remesh_sweep.h) and markHeightTile (remesh_levels.glsl).
layout(set = 0, binding = 0) uniform utextureBuffer levelQuads;
layout(set = 0, binding = 1) uniform utextureBuffer pieceQuads;

uint firstPieceQuad;  // of the invocation's piece

uvec4 pieceQuad(int i) { return texelFetch(pieceQuads, int(firstPieceQuad) + i); }
vec4 pieceReals(int i) { return uintBitsToFloat(pieceQuad(i)); }

ivec3 remeshCell(int k) { return ivec3(pieceQuad(6 + k).xyz); }

RemeshCorner remeshCorner(int k) {
    vec4 position = pieceReals(k), direction = pieceReals(3 + k), uvs = pieceReals(k < 2 ? 9 : 10);
    uvec4 cell = pieceQuad(6 + k);
    RemeshCorner corner;
    corner.position = position.xyz;
    corner.direction = direction.xyz;
    corner.grid = ivec3(cell.xyz);
    corner.uv = k == 1 ? uvs.zw : uvs.xy;
    corner.density = direction.w;
    corner.height = uintBitsToFloat(cell.w);
    corner.weight = position.w;
    return corner;
}

RemeshSeam remeshSeam(int k) {
    vec4 beyond = pieceReals(11 + k);
    RemeshSeam seam;
    seam.is = (pieceQuad(10).z >> uint(k) & 1u) != 0u;
    seam.start = beyond.xy;
    seam.end = beyond.zw;
    return seam;
}

int remeshParts(int k, int cells) {
    int parts = int(pieceQuad(10).w >> uint(10 * k) & 1023u);
    return parts > 0 ? parts : cells;
}

int remeshHeightLevel(int k) { return int(pieceQuad(14)[k]); }

// The number of the base triangle.
uint pieceTriangle() { return pieceQuad(10).z >> 3; }

int remeshLevels() { return int(levels); }
float remeshMapWidth() { return float(mapWidth); }
uvec4 fetchHeightQuad(int i) { return texelFetch(levelQuads, i); }
#include "render/shaders/remesh_levels.glsl"
#include "mesostructure/shared/remesh_heights.h"
#include "mesostructure/shared/remesh_sweep.h"
