// The lines in which a picture shows leaves and triangles.
#include "render/shared/wireframe.h"

float triangleLines(Hit hit, vec3 direction) {
    TableSections sections = fetchTableSections(hit.record);
    vec3 corners[3];
    for (int i = 0; i < 3; i++) {
        uvec2 code = fetchPair(sections.vertices, hit.corners[i]);
        corners[i] = decodeVertex(code.x, code.y);
    }
    float cell = powerOfTwo(int(frame.finestLevel) + hit.pageBits - int(kLatticeBits));
    return linesOfTriangle(corners[0], corners[1], corners[2], vec3(1.0 - hit.at.x - hit.at.y, hit.at.xy), direction,
                           pixelEdgeAt(hit.depth) / cell);
}

float leafLines(Hit hit, vec3 n, int leafBits, vec3 direction) {
    float edge = powerOfTwo(int(frame.finestLevel + frame.log2Cells) + leafBits - int(kLatticeBits));
    return linesOfLeaf(hit.at.xyz, n, direction, pixelEdgeAt(hit.depth) / edge);
}

// Returns how much of a line is seen at a hit, 0 to 1; below 0 where it is of a leaf. `normal`: of the surface, unit. A
// kind of leaf that none of the rays in lock step has hit is skipped, as in surfaceAt.
float lineOf(Hit hit, vec3 normal, vec3 direction) {
    bool found = hit.depth < kNoHit;
    float line = 0.0;
    bool soft = found && nodeType(hit.leaf) == kNodeSoft;
    while (soft) {
        line = -leafLines(hit, normal, int(hit.corners.x), direction);
        soft = false;
    }
    bool slab = found && nodeType(hit.leaf) == kNodeSlab;
    while (slab) {
        vec3 n = slabDirection(hit.leaf, fetchTableSections(hit.record).faces);
        line = -leafLines(hit, n, int(hit.at.w), direction);
        slab = false;
    }
    bool hard = found && nodeType(hit.leaf) == kNodeHard;
    while (hard) {
        line = triangleLines(hit, direction);
        hard = false;
    }
    return line;
}
