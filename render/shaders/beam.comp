// Finds a start distance for every tile of 8 x 8 pixels, and lists the tiles that are not empty.
//
// A tile's rays are enclosed, axis by axis, between the least and the greatest origin and direction; the
// interval in which such a bundle may be inside a box follows from four divisions an axis. The tile walks
// page tree and octrees front to back, keeps the least distance at which it may enter a leaf, and prunes
// what lies behind. So no ray of the tile hits anything before the start distance, and a tile that meets no
// leaf is empty. Reads pool and table; writes tile starts and list.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/tiles.glsl"

layout(constant_id = 7) const uint kBeam = 1u;  // 0: every tile is listed, from distance 0
layout(local_size_x = 8, local_size_y = 8) in;

const int kMaxDepth = 34;        // page levels and levels of an octree in a page
const uint kInTable = 1u << 31;  // marks a stack entry of the page tree

struct Bundle {
    vec3 originMin, originMax;
    vec3 inverseMin, inverseMax;  // 1 / least and greatest direction
    bvec3 minAhead, maxAhead;     // their signs
};

Bundle tileBundle(uvec2 tile) {
    vec2 lo = vec2(tile * kTileSize) + 0.5;
    vec2 hi = min(lo + float(kTileSize - 1u), vec2(pictureSize()) - 0.5);
    Ray a = rayAt(lo), b = rayAt(vec2(hi.x, lo.y)), c = rayAt(vec2(lo.x, hi.y)), d = rayAt(hi);
    Bundle bundle;
    // Rounding of the rays' own points is relative to their distance (rays.glsl, latticePoint).
    bundle.originMin = min(min(a.origin, b.origin), min(c.origin, d.origin));
    bundle.originMax = max(max(a.origin, b.origin), max(c.origin, d.origin));
    vec3 least = min(min(a.direction, b.direction), min(c.direction, d.direction));
    vec3 greatest = max(max(a.direction, b.direction), max(c.direction, d.direction));
    // A unit direction inside the tile is a blend of the corners' directions divided by its length, which is at least 1
    // - delta^2 for corners delta apart.
    vec3 across = max(abs(a.direction - d.direction), abs(b.direction - c.direction));
    float bulge = dot(across, across) + 4e-7;
    least = withoutZeros(least - bulge);
    greatest = withoutZeros(greatest + bulge);
    bundle.inverseMin = 1.0 / least;
    bundle.inverseMax = 1.0 / greatest;
    bundle.minAhead = greaterThan(least, vec3(0.0));
    bundle.maxAhead = greaterThan(greatest, vec3(0.0));
    return bundle;
}

// Planes of a box, relative to the lattice origin in finest cells, moved apart a little more than the trace
// pass rounds.
vec3 planeBelow(ivec3 plane, float margin) {
    vec3 x = vec3(plane - frame.originLattice.xyz) * frame.cellPerLattice;
    return x - margin - 1e-6 * abs(x);
}
vec3 planeAbove(ivec3 plane, float margin) {
    vec3 x = vec3(plane - frame.originLattice.xyz) * frame.cellPerLattice;
    return x + margin + 1e-6 * abs(x);
}

// For each axis, when some ray of the bundle may be between two planes: from at least x.. to at most y...
struct SlabTimes {
    vec3 first, last;
};

SlabTimes slabTimes(Bundle bundle, vec3 below, vec3 above) {
    // Some ray has come to the lower plane: originMax + t directionMax >= below.
    vec3 t0 = (below - bundle.originMax) * bundle.inverseMax;
    // Some ray has not passed the upper plane: originMin + t directionMin <= above.
    vec3 t1 = (above - bundle.originMin) * bundle.inverseMin;
    SlabTimes s;
    s.first = max(mix(vec3(0.0), t0, bundle.maxAhead), mix(t1, vec3(0.0), bundle.minAhead));
    s.last = min(mix(t0, vec3(kTileEmpty), bundle.maxAhead), mix(vec3(kTileEmpty), t1, bundle.minAhead));
    return s;
}

// When the bundle may be inside the eight octants of a box.
struct OctantTimes {
    SlabTimes lower, upper;
};

OctantTimes octantTimes(Bundle bundle, ivec3 corner, int bits) {
    float margin = 1e-3 * max(frame.cellPerLattice * float(1 << bits) * 0.03125, 1.0);
    ivec3 half3 = ivec3(1 << (bits - 1));
    OctantTimes o;
    o.lower = slabTimes(bundle, planeBelow(corner, margin), planeAbove(corner + half3, margin));
    o.upper = slabTimes(bundle, planeBelow(corner + half3, margin), planeAbove(corner + 2 * half3, margin));
    return o;
}

// First distance at which the bundle may be in an octant; kTileEmpty for never.
float octantStart(OctantTimes o, uint octant) {
    bvec3 upper = bvec3((octant & 1u) != 0u, (octant & 2u) != 0u, (octant & 4u) != 0u);
    float first = maxOf(mix(o.lower.first, o.upper.first, upper));
    float last = minOf(mix(o.lower.last, o.upper.last, upper));
    return first <= last ? first : kTileEmpty;
}

// One group of eight children on the way down: the table's first child or the octree group's texel, the
// children still to visit (bit k: octant k ^ order), and what children exist in the page tree.
uint stackBase[kMaxDepth];
uint stackOpen[kMaxDepth];

// Returns the least distance at which the tile's rays may enter a leaf.
float tileStart(Bundle bundle) {
    // The nearest octant comes first: a bit is set where the bundle goes towards lower coordinates.
    uint order = (bundle.maxAhead.x ? 0u : 1u) | (bundle.maxAhead.y ? 0u : 2u) | (bundle.maxAhead.z ? 0u : 4u);
    float best = kTileEmpty;
    uint nodesTexel = 0u;
    int depth = 0;
    ivec3 corner = ivec3(0);  // lowest corner of the box at `depth`, on the lattice; its edge is 2^(30 - depth)

    // The pending node: its word or, in the page tree, its record.
    bool inTable = true;
    uint node = 0u;
    int cellBits = 0;  // log2 of a cell of the current page on the lattice
    while (depth >= 0) {
        int bits = int(kLatticeBits) - depth;
        // Arrive at a node whose box is corner, bits; a page's record comes first.
        uint open = 0u, base = 0u;
        TableNode record = fetchTableNode(inTable ? node : 0u);
        bool isPage = inTable && (record.flags & kRecordInCut) != 0u;
        if (isPage) {
            nodesTexel = record.pageTexel + kPageHeaderBytes / 16u;
            node = record.root;
            cellBits = bits - int(frame.log2Cells) + ((record.flags & kRecordIsOctant) != 0u ? 1 : 0);
        }
        OctantTimes times = octantTimes(bundle, corner, bits);
        bool inPage = isPage || !inTable;
        bool internal = inPage && nodeType(node) == kNodeInternal;
        uint group = nodesTexel + 2u * (internal ? node & kNodePayloadMask : 0u);
        uvec4 words0 = fetchTexel(group), words1 = fetchTexel(group + 1u);
        for (uint k = 0u; k < 8u; k++) {
            uint octant = k ^ order;
            float first = octantStart(times, octant);
            if (first >= best) continue;
            if (internal) {
                uint type = nodeType(texelWord((octant & 4u) != 0u ? words1 : words0, octant & 3u));
                // Below a cell there is little to gain: what is there counts as a leaf.
                bool deep = type == kNodeInternal && bits - 1 > cellBits;
                if (deep) open |= 1u << k;
                if (!deep && type != kNodeEmpty) best = min(best, first);
            } else if (!inPage && hasOctant(record, octant)) {
                open |= 1u << k;
            }
        }
        // The page is a single leaf.
        if (inPage && !internal && nodeType(node) != kNodeEmpty) {
            float first = kTileEmpty;
            for (uint octant = 0u; octant < 8u; octant++) first = min(first, octantStart(times, octant));
            best = min(best, first);
        }
        base = inPage ? group : record.firstChild | kInTable;
        stackBase[depth] = base;
        stackOpen[depth] = open | (inPage ? 0u : (record.flags & 255u) << 8);

        // Continue with the nearest open child of the deepest box that has one.
        while (depth >= 0 && (stackOpen[depth] & 255u) == 0u) {
            depth--;
            corner = corner >> (int(kLatticeBits) - depth) << (int(kLatticeBits) - depth);
        }
        if (depth < 0) break;
        uint k = uint(findLSB(stackOpen[depth] & 255u));
        stackOpen[depth] &= ~(1u << k);
        uint octant = k ^ order;
        base = stackBase[depth];
        inTable = (base & kInTable) != 0u;
        uint existing = stackOpen[depth] >> 8;
        uint word = texelWord(fetchTexel(inTable ? 0u : base + (octant >> 2)), octant & 3u);
        node = inTable ? (base & ~kInTable) + bitCount(existing & ((1u << octant) - 1u)) : word;
        int childBits = int(kLatticeBits) - depth - 1;
        corner += ivec3(octant & 1u, octant >> 1 & 1u, octant >> 2 & 1u) << childBits;
        depth++;
    }
    return best;
}

void main() {
    uvec2 tile = ownPlace();
    if (any(greaterThanEqual(tile, uvec2(frame.tilesX, frame.tilesY)))) return;
    float start = 0.0;
    if (kBeam != 0u) {
        start = tileStart(tileBundle(tile));
        if (start < kTileEmpty) start = max(0.0, start * (1.0 - 2e-6) - 2e-3);
    }
    storeTileStart(tile, start);
}
