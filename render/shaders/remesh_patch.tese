// Displaces the points of a patch; those of its edges are the sweep's.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_patch.glsl"

layout(triangles, equal_spacing, cw) in;
layout(location = 0) patch in uint patchPiece;

layout(location = 0) out vec3 at;
layout(location = 1) out vec2 place;
layout(location = 2) flat out uint triangle;

// A point within the patch, with perspective, without its height.
RemeshPoint insidePoint(vec3 weights) {
    RemeshCorner a = remeshCorner(0), b = remeshCorner(1), c = remeshCorner(2);
    vec3 w = weights * vec3(a.weight, b.weight, c.weight);
    w /= w.x + w.y + w.z;
    RemeshPoint point;
    point.position = w.x * a.position + w.y * b.position + w.z * c.position;
    point.direction = w.x * a.direction + w.y * b.direction + w.z * c.direction;
    point.uv = w.x * a.uv + w.y * b.uv + w.z * c.uv;
    point.density = w.x * a.density + w.y * b.density + w.z * c.density;
    point.height = 0.0;
    return point;
}

RemeshPoint cornerPoint(int k) {
    RemeshCorner corner = remeshCorner(k);
    return RemeshPoint(corner.position, corner.direction, corner.uv, corner.density, corner.height);
}

void main() {
    firstPieceQuad = patchPiece * kRemeshPieceQuads;
    vec3 w = gl_TessCoord;
    int corner = w.x == 1.0 ? 0 : w.y == 1.0 ? 1 : w.z == 1.0 ? 2 : -1;
    int edge = w.x == 0.0 ? 1 : w.y == 0.0 ? 2 : w.z == 0.0 ? 0 : -1;
    RemeshPoint point;
    vec2 beyond;
    bool hasSeam = false;
    if (corner >= 0) {
        point = cornerPoint(corner);
    } else if (edge >= 0) {
        int n = cellsOfEdge(edge), i = int(round((edge == 0 ? w.y : edge == 1 ? w.z : w.x) * float(n)));
        RemeshSeam seam = remeshSeam(edge);
        point = remeshEdgePoint(edge, i, n);
        hasSeam = seam.is;
        if (hasSeam) beyond = remeshBeyond(seam, edge, i, n);
    } else {
        point = insidePoint(w);
    }
    float texels = remeshTexelsAt(point.position, point.density);
    RemeshFootprint footprint = remeshFootprint(texels);
    if (corner < 0) {
        point.height = remeshHeightAt(footprint, texels, point.uv, point.position, point.direction);
        if (hasSeam)
            point.height =
                max(point.height, remeshHeightAt(footprint, texels, beyond, point.position, point.direction));
    }
    precise vec3 position = point.position + point.height * point.direction;
    precise float z = depth.z * position.z + depth.w;
    gl_Position = vec4(position.xy * plane.xy + plane.zw * z, depth.x * position.z + depth.y, z);
    at = position;
    place = point.uv;
    triangle = pieceTriangle();
}
