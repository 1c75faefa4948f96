// Walks along a ray through one page, or one octant of it, leaf by leaf. Page space: cells of the page's level, origin
// at its lowest corner. Positions are also kept as integers in eighths of a cell (the smallest leaf), so that rounding
// never decides which node comes next across a face.

struct PageRay {
    vec3 start;  // where the ray enters the page, or the octant, or begins
    vec3 direction, inverse;
    vec3 exit;        // where it leaves the page
    vec3 farWalls;    // coordinates of the walls it may leave by
    vec3 low, high;   // corners of the page, or of the octant
    float tauExit;    // distance from start to exit
    bool beginsHere;  // the ray begins inside the page
};

const float kSubcells = float(1u << kMaxSubcellDepth);
// Walls are whole numbers of clearances, and not below 0: with this added, cutting rounds up subcells.
const float kRoundUp = 1.0 - kSubcells / kClearancePerCell;

// A place on the ray: distance from the page's start, and the subcell.
struct Place {
    float tau;
    ivec3 subcell;
    bool inPage;
};

// Bits of an octree node's box, in subcells, and its group of siblings; two groups above it for going
// back without starting at the root.
struct Descent {
    uint group, parent, grandparent;  // texels; kNoGroup: not remembered
    int bits;                         // log2 of the edge of the group's box
    uint node;
};
const uint kNoGroup = 0xffffffffu;

uint octantAt(ivec3 place, int bit) {
    ivec3 b = (place >> bit) & 1;
    return uint(b.x | b.y << 1 | b.z << 2);
}

// Follows internal nodes down to the leaf or empty node at `subcell`. `steps` counts fetches.
// What is loaded must reach the code after a loop by way of the loop's condition: devices that run rays in
// lock step may load 0 for a ray that has left the loop (seen with storage buffers, Mesa 22.3).
void descend(inout Descent at, uint nodesTexel, uint rootOnly, uint root, ivec3 subcell, inout uint steps) {
    at.node = kNodeInternal << kNodeTypeShift;
    while (at.node >> kNodeTypeShift == kNodeInternal) {
        uint node = fetchWord(at.group, octantAt(subcell, at.bits - 1));
        at.node = rootOnly != 0u ? root : node;
        if (kCountSteps != 0u) steps++;
        if (at.node >> kNodeTypeShift == kNodeInternal) {
            at.grandparent = at.parent;
            at.parent = at.group;
            at.group = nodesTexel + 2u * (at.node & kNodePayloadMask);
            at.bits--;
        }
    }
}

// Goes up to the lowest remembered group that holds the new place.
void ascend(inout Descent at, ivec3 from, ivec3 to, uint rootGroup, int rootBits) {
    ivec3 changed = from ^ to;
    int up = findMSB(uint(changed.x | changed.y | changed.z)) + 1 - at.bits;
    uint group = up <= 0 ? at.group : up == 1 ? at.parent : up == 2 ? at.grandparent : kNoGroup;
    if (up == 1) {
        at.parent = at.grandparent;
        at.grandparent = kNoGroup;
    }
    if (up >= 2) {
        at.parent = kNoGroup;
        at.grandparent = kNoGroup;
    }
    bool lost = group == kNoGroup;
    at.group = lost ? rootGroup : group;
    at.bits = lost ? rootBits : at.bits + max(up, 0);
}

// Keeps one of the components that are true.
bvec3 oneOf(bvec3 b) { return bvec3(b.x, b.y && !b.x, b.z && !b.y && !b.x); }

// Leaves the box lo..hi, which the ray is in, by the wall it meets first; by one wall where it meets several at once:
// what bridges the difference between two leaves at their common wall is in these two, so a ray through an edge has
// to meet a leaf beside it.
Place leaveBox(PageRay ray, Place from, vec3 lo, vec3 hi) {
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    vec3 walls = mix(lo, hi, ahead);
    vec3 t = (walls - ray.start) * ray.inverse;
    float nearest = minOf(t);
    bvec3 through = oneOf(equal(t, vec3(nearest)));
    Place to;
    to.tau = max(from.tau, nearest);
    vec3 p = clamp(ray.start + to.tau * ray.direction, lo, hi);
    ivec3 sideways = clamp(ivec3(p * kSubcells), ivec3(lo * kSubcells), ivec3(hi * kSubcells + kRoundUp) - 1);
    ivec3 across = mix(ivec3(walls * kSubcells + kRoundUp) - 1, ivec3(walls * kSubcells), ahead);
    to.subcell = mix(sideways, across, through);
    bvec3 outer = equal(walls, ray.farWalls);
    to.inPage = !((through.x && outer.x) || (through.y && outer.y) || (through.z && outer.z));
    return to;
}

// The part of the ray inside a leaf. It depends on ray, page and leaf only: however the walk came here, the same leaf
// gives the same answer, and neighbours evaluate the same points at the wall between them. Only where rounding has sent
// a ray along a wall to the wrong side of it does the leaf begin where the walk is (`tau`), not where the ray crosses
// that wall, far ahead.
struct LeafSegment {
    vec3 from, to;  // page space
    float tauFrom, tauTo;
    bool fromWall;  // false where the ray begins inside the leaf
};

LeafSegment segmentInLeaf(PageRay ray, vec3 lo, float edge, float tau) {
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    vec3 hi = lo + edge;
    vec3 nearWalls = mix(hi, lo, ahead), farWalls = mix(lo, hi, ahead);
    vec3 t0 = (nearWalls - ray.start) * ray.inverse, t1 = (farWalls - ray.start) * ray.inverse;
    float first = min(maxOf(t0), tau), last = minOf(t1);
    LeafSegment s;
    s.fromWall = first > 0.0 || !ray.beginsHere;
    s.tauFrom = max(first, 0.0);
    s.from = clamp(ray.start + first * ray.direction, lo, hi);
    s.from = mix(s.from, nearWalls, equal(t0, vec3(first)));
    if (first <= 0.0) s.from = ray.start;
    s.tauTo = max(last, s.tauFrom);
    bvec3 through = equal(t1, vec3(last));
    s.to = clamp(ray.start + last * ray.direction, lo, hi);
    s.to = mix(s.to, farWalls, through);
    bvec3 outer = equal(farWalls, ray.farWalls);
    if ((through.x && outer.x) || (through.y && outer.y) || (through.z && outer.z)) {
        s.to = ray.exit;
        s.tauTo = max(ray.tauExit, s.tauFrom);
    }
    return s;
}
