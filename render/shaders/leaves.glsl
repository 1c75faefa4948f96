// Casts a ray against the leaves of a page, and finds what is seen of a hit.
#include "octree/shared/leaf_math.h"
#include "octree/shared/slab_blend.h"
#include "render/shaders/images.glsl"
#include "render/shaders/page_walk.glsl"

const int kIllinoisSteps = 8;

struct Hit {
    float depth;   // finest cells; kNoHit
    uint record;   // record of the hit page in the table
    int pageBits;  // log2 of the page's edge on the lattice
    uint leaf;     // its node
    // Soft: the point in leaf space, and the side the ray came from (sideBefore). Hard: weights of the second and third
    // vertex. Slab: the point in leaf space, and log2 of the leaf's edge on the lattice.
    vec4 at;
    // Hard: the triangle's vertices. Slab: the leaf's lowest corner on the lattice. Soft, where numbers of hits are
    // shown: log2 of the leaf's edge on the lattice, first.
    uvec3 corners;
};

// What is seen of a hit.
struct Surface {
    vec3 normal;  // towards the ray's origin, not normalized
    vec4 colour;
};

// The work of a ray; counted with kCountSteps only.
struct Work {
    uint steps, cells, fetches;
};

// Returns an exact power of two.
float powerOfTwo(int exponent) { return uintBitsToFloat(uint(127 + exponent) << 23); }

// Returns the distance along the page's ray of the crossing in a soft leaf, or -1.
float castSoft(uint faces, uint node, vec3 lo, float edge, LeafSegment s, inout Hit hit, inout Work work) {
    uint face = faces + (node & kLeafIndexMask);
    uvec4 face0 = fetchTexel(face), face1 = fetchTexel(face + 1u);
    if (kCountSteps != 0u) {
        work.cells++;
        work.fetches += 2u;
    }
    float scale = 1.0 / edge;  // a power of two: exact
    vec3 p = (s.from - lo) * scale;
    vec3 d = (s.to - s.from) * scale;
    float wall = wallTolerance(node);
    RayField ray = restrictToRay(face0, face1, node >> kSoftAxisShift & 3u, p, d);
    float u = firstCrossing(ray, s.fromWall ? wall : 0.0, wall, dipBound(node), kIllinoisSteps);
    hit.at = vec4(p + u * d, sideBefore(ray, u, d));
    return u >= 0.0 ? s.tauFrom + u * (s.tauTo - s.tauFrom) : -1.0;
}

// Returns the distance along the page's ray of the hit in a slab leaf, or -1. Where the ray begins in the leaf, what
// lies at its begin does not count: it may be the surface that it comes from.
float castSlab(uint faces, uint node, vec3 lo, float edge, LeafSegment s, inout Hit hit, inout Work work) {
    if (kCountSteps != 0u) {
        work.cells++;
        work.fetches++;
    }
    uint code = fetchWord(faces, node & kSlabVectorMask);
    float scale = 1.0 / edge;  // a power of two: exact
    vec3 p = (s.from - lo) * scale, d = (s.to - s.from) * scale;
    float u = intersectSlab(code, node >> kSlabOctantsShift & kSlabOctantsMask, p, d);
    hit.at.xyz = p + u * d;
    bool counts = u > 0.0 || (u == 0.0 && s.fromWall);
    return counts ? s.tauFrom + u * (s.tauTo - s.tauFrom) : -1.0;
}

// Reads the entries of a page's strips, one after the other.
struct StripReader {
    uint strips;  // texel of the first entry
    uint shorts;  // 1 where entries are short, two to a word; else 0
    uint next;    // number of the next entry
    uint texel;   // the latest texel and its words; 0: none
    uvec4 words;
};

StripReader stripReader(TableSections sections, uint first) {
    // The size of the vertices' section tells how many there are.
    uint shorts = sections.normals - sections.vertices <= kShortEntryVertices / 2u ? 1u : 0u;
    return StripReader(sections.strips, shorts, first, 0u, uvec4(0u));
}

// Returns an entry's vertex number, and its step.
uint readEntry(inout StripReader reader, out uint step, inout Work work) {
    uint texel = reader.strips + (reader.next >> (2u + reader.shorts));
    if (texel != reader.texel) {
        reader.words = fetchTexel(texel);
        reader.texel = texel;
        if (kCountSteps != 0u) work.fetches++;
    }
    uint word = texelWord(reader.words, reader.next >> reader.shorts & 3u);
    uint entry = word >> ((reader.next & reader.shorts) << 4) & 0xffffffffu >> (reader.shorts << 4);
    uint bits = reader.shorts != 0u ? kShortVertexBits : kLongVertexBits;
    reader.next++;
    step = entry >> bits;
    return entry & ((1u << bits) - 1u);
}

vec3 fetchVertex(TableSections sections, uint v, inout Work work) {
    if (kCountSteps != 0u) work.fetches++;
    uvec2 code = fetchPair(sections.vertices, v);
    return decodeVertex(code.x, code.y);
}

// Intersects the triangles of a hard leaf. Returns the distance, or -1.
float castHard(TableSections sections, uint node, LeafSegment s, vec3 direction, inout Hit hit, inout Work work) {
    if (kCountSteps != 0u) work.cells++;
    StripReader reader = stripReader(sections, node & kHardFirstMask);
    uint count = node >> kHardCountShift & kHardCountMask, step;
    bool isLong = count == kHardCountLong;
    while (isLong) {
        count = readEntry(reader, step, work);
        count |= readEntry(reader, step, work) << kShortVertexBits;
        isLong = false;
    }
    float lowest = s.fromWall ? -kIntervalSlack : 0.0;
    float best = s.tauTo - s.tauFrom + kIntervalSlack;
    bool found = false;
    // A turn of the loop takes one vertex, so that none waits for another ray's strip to begin. Where a strip begins,
    // two turns have no triangle yet; most leaves have one strip, and its first two vertices come before the loop.
    uvec3 corners = uvec3(0u);
    corners.x = readEntry(reader, step, work);
    corners.y = readEntry(reader, step, work);
    vec3 a = fetchVertex(sections, corners.x, work), b = fetchVertex(sections, corners.y, work), c = b;
    uint known = 2u;  // how many of the triangle's vertices
    while (count > 0u) {
        uint v = readEntry(reader, step, work);
        vec3 p = fetchVertex(sections, v, work);
        known = step != kStepBegin ? 3u : known < 3u ? known + 1u : 1u;
        bvec3 place = equal(uvec3(step != kStepBegin ? step : known), uvec3(1u, 2u, 3u));
        corners = mix(corners, uvec3(v), place);
        a = mix(a, p, bvec3(place.x));
        b = mix(b, p, bvec3(place.y));
        c = mix(c, p, bvec3(place.z));
        vec3 t = intersectTriangle(s.from, direction, a, b, c, kTriangleSlack);
        if (known == 3u && t.x >= lowest && t.x <= best) {
            best = t.x;
            hit.at.xy = t.yz;
            hit.corners = corners;
            found = true;
        }
        count -= known == 3u ? 1u : 0u;
    }
    return found ? max(s.tauFrom + best, 0.0) : -1.0;
}

vec4 blendColours(uvec4 face0, uvec4 face1, vec3 x) {
    vec4 w = faceWeights(x.y, x.z);
    vec4 c0 = w.x * unpackUnorm4x8(face0.x) + w.y * unpackUnorm4x8(face0.y) + w.z * unpackUnorm4x8(face0.z) +
              w.w * unpackUnorm4x8(face0.w);
    vec4 c1 = w.x * unpackUnorm4x8(face1.x) + w.y * unpackUnorm4x8(face1.y) + w.z * unpackUnorm4x8(face1.z) +
              w.w * unpackUnorm4x8(face1.w);
    return mix(c0, c1, x.x);
}

Surface softSurface(Hit hit, uint faces, uint colourFaces, vec3 direction) {
    uint axis = hit.leaf >> kSoftAxisShift & 3u;
    uint face = hit.leaf & kLeafIndexMask;
    LeafField leaf = decodeLeaf(fetchTexel(faces + face), fetchTexel(faces + face + 1u), axis);
    Surface surface;
    surface.normal = facingNormal(leafNormal(leaf, hit.at.xyz), direction, hit.at.w);
    surface.colour = vec4(0.0);
    if (kColour != 0u)
        surface.colour = blendColours(fetchColour(colourFaces + face), fetchColour(colourFaces + face + 1u),
                                      rotateToAxis(hit.at.xyz, axis));
    return surface;
}

// Returns the direction of a slab leaf's planes, to either side.
vec3 slabDirection(uint node, uint faces) {
    return decodeDirection(fetchWord(faces, node & kSlabVectorMask) >> kSlabDirectionShift);
}

vec4 slabColour(uint node, uint colourFaces) {
    uint vector = node & kSlabVectorMask;
    return unpackUnorm4x8(texelWord(fetchColour(colourFaces + (vector >> 2)), vector & 3u));
}

// A box of the page tree, or of a page's octree.
struct TreeBox {
    int bits;     // log2 of its edge on the lattice
    uint record;  // number of its page in the table; or its own, where it is of the page tree
    uint word;    // node word; that of an internal node in the page tree
    uint nodes;   // texel of the page's nodes; 0: a box of the page tree
};

// Goes down to the box of 2^bits lattice units at a place, or to the leaf that holds it. Loads are used as descend()
// of page_walk.glsl says.
TreeBox descendTo(TreeBox box, ivec3 place, int bits) {
    while (box.word >> kNodeTypeShift == kNodeInternal && box.bits > bits) {
        box.bits--;
        uint octant = octantAt(place, box.bits);
        if (box.nodes != 0u) {
            box.word = fetchWord(box.nodes + 2u * (box.word & kNodePayloadMask), octant);
        } else {
            TableNode parent = fetchTableNode(box.record);
            bool exists = hasOctant(parent, octant);
            box.record = exists ? childIn(parent, octant) : box.record;
            TableNode child = fetchTableNode(box.record);
            bool isPage = (child.flags & kRecordInCut) != 0u;
            box.nodes = exists && isPage ? child.pageTexel + kPageHeaderBytes / 16u : 0u;
            box.word = !exists ? kNodeEmpty << kNodeTypeShift : isPage ? child.root : 0u;
        }
    }
    return box;
}

// Returns the root of the hit's page where it holds both points of the lattice, also with octants that are not drawn;
// else that of the page tree.
TreeBox rootAbout(Hit hit, ivec3 below, ivec3 above) {
    ivec3 place = ivec3(hit.corners) >> hit.pageBits;
    bool inPage = below >> hit.pageBits == place && above >> hit.pageBits == place;
    TableNode record = fetchTableNode(inPage ? hit.record : 0u);
    bool isPage = inPage || (record.flags & kRecordInCut) != 0u;
    uint nodes = record.pageTexel + kPageHeaderBytes / 16u;
    uint root = inPage ? fetchWord(record.pageTexel, kPageHeaderRoot) : record.root;
    return TreeBox(inPage ? hit.pageBits : int(kLatticeBits), inPage ? hit.record : 0u, isPage ? root : 0u,
                   isPage ? nodes : 0u);
}

// Returns the blend of the slabs about a hit. `own`: the hit leaf's normal, to whose side others are turned.
SlabBlend blendSlabs(Hit hit, vec3 own, float share) {
    int leafBits = int(hit.at.w);
    vec3 x = hit.at.xyz, corner = nearestCorner(x);
    ivec3 low = ivec3(hit.corners), above = low + (ivec3(corner) << leafBits), below = above - 1;
    ivec3 apart = below ^ above;
    TreeBox holdsAll = descendTo(rootAbout(hit, below, above), below, findMSB(uint(apart.x | apart.y | apart.z)) + 1);
    uint ownOctant = octantOfLeaf(corner);
    vec3 shares = shareAbove(x);
    float edge = powerOfTwo(leafBits);
    SlabBlend sum = SlabBlend(vec3(0.0), vec4(0.0), 0.0);
    DONT_UNROLL for (uint octant = 0u; octant < 8u; octant++) {
        ivec3 place = below + ivec3(octant & 1u, octant >> 1 & 1u, octant >> 2);
        bool inside = all(greaterThanEqual(place, ivec3(0))) && all(lessThan(place, ivec3(1 << kLatticeBits)));
        TreeBox box = holdsAll;
        if (!inside) box.word = kNodeEmpty << kNodeTypeShift;
        box = descendTo(box, place, 0);
        bool slab = nodeType(box.word) == kNodeSlab;
        while (slab) {
            uint code = fetchWord(fetchTableSections(box.record).faces, box.word & kSlabVectorMask);
            vec3 n = decodeDirection(code >> kSlabDirectionShift);
            vec3 boxLow = vec3((place >> box.bits << box.bits) - low);
            vec3 fromCentre = (x * edge - boxLow) * powerOfTwo(-box.bits) - 0.5;
            float weight = slabNearness(n, slabOffset(code), fromCentre) * octantWeight(shares, octant) *
                           (octant == ownOctant ? 1.0 : share);
            vec4 colour = vec4(0.0);
            if (kColour != 0u) colour = slabColour(box.word, fetchTableColours(box.record).faces);
            sum = withSlab(sum, n, colour, weight, own);
            slab = false;
        }
    }
    return sum;
}

Surface slabSurface(Hit hit, uint faces, uint colourFaces, vec3 direction) {
    vec3 own = turnedTo(slabDirection(hit.leaf, faces), -direction);
    Surface surface = Surface(own, vec4(0.0));
    if (kColour != 0u) surface.colour = slabColour(hit.leaf, colourFaces);
    float edge = powerOfTwo(int(frame.finestLevel + frame.log2Cells) + int(hit.at.w) - int(kLatticeBits));
    float share = hit.at.w < 0.0 ? 0.0 : slabBlendShare(edge / pixelEdgeAt(hit.depth));
    bool wide = share > 0.0;
    while (wide) {
        SlabBlend blend = blendSlabs(hit, own, share);
        if (dot(blend.normal, blend.normal) > 0.0) surface = Surface(blend.normal, blend.colour / blend.weight);
        wide = false;
    }
    return surface;
}

// Returns the edge of what a sample is averaged over at a hit, in cells of its page's level.
float footprintEdge(Hit hit) {
    return kFootprintPixels * pixelEdgeAt(hit.depth) *
           powerOfTwo(int(kLatticeBits) - int(frame.finestLevel) - hit.pageBits);
}

// Returns the colour of a hit on a triangle, from its image where it has one. `n`: the triangle's normal.
vec4 triangleColour(Hit hit, vec3 a, vec3 b, vec3 c, vec3 n, uint colourVertices, vec3 direction) {
    vec3 w = vec3(1.0 - hit.at.x - hit.at.y, hit.at.xy);
    vec4 colour = vec4(0.0);
    for (int i = 0; i < 3; i++)
        colour +=
            w[i] * unpackUnorm4x8(texelWord(fetchColour(colourVertices + (hit.corners[i] >> 2)), hit.corners[i] & 3u));
    if (kColour < 2u) return colour;
    TableNode record = fetchTableNode(hit.record);
    bool hasPoints = (record.flags & kRecordHasPoints) != 0u;
    while (hasPoints) {
        uint vertices = fetchWord(record.pageTexel, kPageHeaderVertices);
        ImagePoint first = fetchImagePoint(colourVertices, vertices, hit.corners.x);
        bool hasImage =
            first.material != 0u && first.material <= fetchImageWord(0u) && imageRecord(4u * first.material).x != 0u;
        while (hasImage) {
            ImagedTriangle t = imagedTriangle(first, fetchImagePoint(colourVertices, vertices, hit.corners.y),
                                              fetchImagePoint(colourVertices, vertices, hit.corners.z));
            colour = imageColour(t, ImagedPoint(t.place + w.y * t.toB + w.z * t.toC,
                                                textureSlope(a, b, c, t.toB, t.toC), n, direction, footprintEdge(hit)));
            hasImage = false;
        }
        hasPoints = false;
    }
    return colour;
}

Surface hardSurface(Hit hit, TableSections sections, uint colourVertices, vec3 direction) {
    uvec3 corners = hit.corners;
    uvec2 a = fetchPair(sections.vertices, corners.x), b = fetchPair(sections.vertices, corners.y),
          c = fetchPair(sections.vertices, corners.z);
    vec3 pa = decodeVertex(a.x, a.y), pb = decodeVertex(b.x, b.y), pc = decodeVertex(c.x, c.y);
    vec3 flatNormal = cross(pb - pa, pc - pa);
    flatNormal *= inversesqrt(max(dot(flatNormal, flatNormal), 1e-30));
    flatNormal = turnedTo(flatNormal, -direction);
    vec3 w = vec3(1.0 - hit.at.x - hit.at.y, hit.at.xy);
    Surface surface = Surface(vec3(0.0), vec4(0.0));
    for (int i = 0; i < 3; i++)
        surface.normal += w[i] * cornerNormal(fetchWord(sections.normals, corners[i]), flatNormal);
    if (kColour != 0u) surface.colour = triangleColour(hit, pa, pb, pc, flatNormal, colourVertices, direction);
    return surface;
}

// Finds the normal and colour of a hit. The page is looked up again: see descend() on what is loaded in a loop. A kind
// of leaf that none of the rays in lock step has hit is skipped; only a loop does that on every device.
Surface surfaceAt(Hit hit, vec3 direction) {
    Surface surface = Surface(vec3(0.0, 0.0, 1.0), vec4(0.0));
    bool found = hit.depth < kNoHit;
    TableSections sections = fetchTableSections(hit.record);
    TableColours colours = TableColours(0u, 0u, 0u, 0u);
    if (kColour != 0u) colours = fetchTableColours(hit.record);
    bool soft = found && nodeType(hit.leaf) == kNodeSoft;
    while (soft) {
        surface = softSurface(hit, sections.faces, colours.faces, direction);
        soft = false;
    }
    bool slab = found && nodeType(hit.leaf) == kNodeSlab;
    while (slab) {
        surface = slabSurface(hit, sections.faces, colours.faces, direction);
        slab = false;
    }
    bool hard = found && nodeType(hit.leaf) == kNodeHard;
    while (hard) {
        surface = hardSurface(hit, sections, colours.vertices, direction);
        hard = false;
    }
    return surface;
}
