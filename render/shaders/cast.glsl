// Casts a ray through the pages of the frame's cut: finds the first hit, and what is seen of it.
//
// Control flow is laid out for devices that run eight rays in lock step and skip nothing: what is rare
// (triangles, changing the page) stands outside of the loops that are not.
#include "render/shaders/leaves.glsl"

const float kLastBelowOne = 0.99999994, kFirstAboveOne = 1.00000012;
const float kSeamErrors = 8.0;  // a coarser surface reaches so many certified errors of the two pages beyond its page

// A page of the cut, or one octant of a page, as the walk needs it.
struct Page {
    uint nodesTexel, root;
    TableSections sections;
    ivec3 corner;  // lattice
    int bits;      // log2 of its edge on the lattice
    int partBits;  // of the part's edge: one less where the part is an octant
    ivec3 part;    // lowest corner of the part
    float cell;    // finest cells
    uint record;   // number in the table
};

// How far the ray has come: along each axis, planes up to this distance are behind it. The three differ by the last
// bit at most: a ray through an edge or a corner crosses one plane after the other, so that it meets the pages beside
// the edge too (as leaveBox does with leaves).
vec3 reachedBehind(float s, vec3 crossed) {
    float before = s > 0.0 ? uintBitsToFloat(floatBitsToUint(s) - 1u) : -1e-30;
    bvec3 first = equal(crossed, vec3(s));
    return vec3(s, first.x ? before : s, first.x || first.y ? before : s);
}

// Steps beyond the wall by which the ray leaves a box of the lattice.
vec3 leaveLatticeBox(Ray ray, ivec3 corner, int bits) {
    vec3 t = planeDistances(ray, mix(corner, corner + (1 << bits), greaterThan(ray.direction, vec3(0.0))));
    return reachedBehind(minOf(t), t);
}

// A box of the page tree: a page of the cut, or an octant without one.
struct Region {
    ivec3 corner;
    int bits;
    bool isPage;
    float error;  // certified error of the page; finest cells
};
const int kNoRegion = 64;  // bits before the first one

// Whether the surface steps from one level to another between two regions, one after the other on a ray, so that a ray
// could pass between the two: pages of a covering dataset leave no such gap.
bool levelChanges(Region before, Region after) {
    return kSeams != 0u && before.bits != kNoRegion &&
           ((before.isPage && after.bits < before.bits) || (after.isPage && after.bits > before.bits));
}

// Sets what a record says of the page whose part is in the box of page.corner and page.bits.
void usePage(uint node, TableNode record, inout Page page) {
    page.part = page.corner;
    page.partBits = page.bits;
    page.bits += (record.flags & kRecordIsOctant) != 0u ? 1 : 0;
    page.corner = page.corner >> page.bits << page.bits;
    page.root = record.root;
    page.nodesTexel = record.pageTexel + kPageHeaderBytes / 16u;
    page.sections = fetchTableSections(node);
    page.record = node;
    page.cell = powerOfTwo(int(frame.finestLevel) + page.bits - int(kLatticeBits));
}

// Goes down the frame's page tree to the page that the ray has reached. Steps over octants without a page, except where
// such an octant follows on a coarser page. Returns false where nothing comes before `last`. The distance to a plane,
// never a rounded place, tells the ray's side of the plane: a ray in a wall, or nearly parallel to it, would be sent to
// a page that it enters much later.
bool findPage(Ray ray, inout vec3 reached, float last, inout Region before, out Region region, out Page page,
              inout uint steps) {
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    uint node = 0u;
    TableNode record = TableNode(0u, 0u, 0u, 0u);
    bool inside = true, found = false;
    while (inside && !found) {
        // Go down to a page of the cut or an octant without one.
        node = 0u;
        region.corner = ivec3(0);
        region.bits = int(kLatticeBits);
        bool exists = true;
        record.flags = 0u;
        while (exists && (record.flags & kRecordInCut) == 0u) {
            record = fetchTableNode(node);
            if (kCountSteps != 0u) steps++;
            if ((record.flags & kRecordInCut) == 0u) {
                region.bits--;
                ivec3 upper = ivec3(
                    equal(ahead, lessThanEqual(planeDistances(ray, region.corner + (1 << region.bits)), reached)));
                region.corner += upper << region.bits;
                uint octant = uint(upper.x | upper.y << 1 | upper.z << 2);
                exists = hasOctant(record, octant);
                node = childIn(record, octant);
            }
        }
        region.isPage = exists;
        region.error = exists ? uintBitsToFloat(record.flags & kRecordErrorMask) : 0.0;
        found = exists || levelChanges(before, region);
        if (!found) {
            before = region;
            reached = leaveLatticeBox(ray, region.corner, region.bits);
            inside = reached.x < last;
        }
    }
    page.corner = region.corner;
    page.bits = region.bits;
    usePage(node, record, page);
    return inside;
}

// A part of the ray beside a change of level, where the coarser surface counts as well.
struct Seam {
    ivec3 corner;  // lowest corner of a box of the coarser level's pages that the part runs through
    int bits;
    bool behind;  // the coarser region lies ahead: boxes are looked at from its wall backwards
    float first, last;
};

// Between two levels the surfaces are apart by as much as their errors, and a ray could pass between them. So the
// coarser surface is continued some way beyond the wall, in the finer one's region.
Seam seamBetween(Region before, Region after, float wall) {
    Seam seam;
    seam.behind = after.isPage && after.bits > before.bits;
    seam.bits = max(before.bits, after.bits);
    // It reaches no farther than a page's edge, whatever a file says.
    float edge = powerOfTwo(int(frame.finestLevel + frame.log2Cells) + seam.bits - int(kLatticeBits));
    float reach = min(kSeamErrors * max(before.error, after.error), edge);
    seam.corner = (seam.behind ? before.corner : after.corner) >> seam.bits << seam.bits;
    seam.first = seam.behind ? max(wall - reach, 0.0) : wall;
    seam.last = seam.behind ? wall : wall + reach;
    return seam;
}

// Steps to the next box of the seam. Returns false where there is none.
bool nextBox(Ray ray, inout Seam seam) {
    ivec3 edge = ivec3(1 << seam.bits), far = seam.corner + edge;
    bvec3 upward = notEqual(greaterThan(ray.direction, vec3(0.0)), bvec3(seam.behind));
    vec3 t = planeDistances(ray, mix(seam.corner, far, upward));
    float wall = seam.behind ? maxOf(t) : minOf(t);
    seam.corner += mix(ivec3(0), mix(-edge, edge, upward), oneOf(equal(t, vec3(wall))));
    bool inLattice =
        all(greaterThanEqual(seam.corner, ivec3(0))) && all(lessThan(seam.corner, ivec3(1 << kLatticeBits)));
    return inLattice && (seam.behind ? wall > seam.first : wall < seam.last);
}

// Finds the page of a seam's box, which is above pages of the cut, if there is one. Returns false where it is not
// resident.
bool coarserPage(Seam seam, inout Page page, inout uint steps) {
    uint node = 0u;
    TableNode record = TableNode(0u, 0u, 0u, 0u);
    bool exists = true;
    page.bits = int(kLatticeBits) + 1;
    while (exists && page.bits > seam.bits) {
        record = fetchTableNode(node);
        if (kCountSteps != 0u) steps++;
        page.bits--;
        if (page.bits > seam.bits) {
            uint octant = octantAt(seam.corner, page.bits - 1);
            exists = hasOctant(record, octant);
            node = childIn(record, octant);
        }
    }
    page.corner = seam.corner;
    usePage(node, record, page);
    return exists && (record.flags & kRecordResident) != 0u;
}

// Brings the ray into page space. Both points at the page's walls come from the lattice, as its neighbours see them. No
// point is rounded onto a wall other than the one that the ray leaves by: its walk would end there.
PageRay enterPage(Ray ray, Page page, out float sStart) {
    ivec3 edge = ivec3(1 << page.partBits);
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    ivec3 nearWalls = mix(page.part + edge, page.part, ahead), farWalls = mix(page.part, page.part + edge, ahead);
    vec3 t0 = planeDistances(ray, nearWalls), t1 = planeDistances(ray, farWalls);
    float first = maxOf(t0), last = max(minOf(t1), first);
    sStart = max(first, 0.0);
    ivec3 from = clamp(latticePoint(ray, sStart), page.part, page.part + edge);
    ivec3 to = clamp(latticePoint(ray, last), page.part, page.part + edge);
    float toCells = powerOfTwo(int(frame.log2Cells) - page.bits);
    PageRay local;
    local.low = vec3(page.part - page.corner) * toCells;
    local.high = vec3(page.part + edge - page.corner) * toCells;
    local.farWalls = mix(local.low, local.high, ahead);
    vec3 nearest = mix(local.high, local.low, ahead);
    vec3 inside = max(local.low * kFirstAboveOne, local.high - kLastBelowOne * local.high);
    vec3 low = mix(inside, local.low, ahead), high = mix(local.high, kLastBelowOne * local.high, ahead);
    local.start = clamp(vec3(from - page.corner) * toCells, low, high);
    if (first > 0.0) local.start = mix(local.start, nearest, equal(t0, vec3(first)));
    local.exit = clamp(vec3(to - page.corner) * toCells, low, high);
    local.exit = mix(local.exit, local.farWalls, equal(t1, vec3(last)));
    local.direction = ray.direction;
    local.inverse = ray.inverse;
    local.tauExit = (last - sStart) / page.cell;
    local.beginsHere = first <= 0.0;
    return local;
}

// Returns the first hit in a page from distance `s` on, or kNoHit. Leaves that begin after `until` are not looked at.
float castPage(Ray ray, Page page, float s, float until, inout Hit hit, inout Work work) {
    float sStart;
    PageRay local = enterPage(ray, page, sStart);
    Place at;
    at.tau = max(0.0, (s - sStart) / page.cell);
    at.subcell = clamp(ivec3((local.start + at.tau * local.direction) * kSubcells), ivec3(local.low * kSubcells),
                       ivec3(local.high * kSubcells) - 1);
    at.inPage = true;
    float tauUntil = (until - sStart) / page.cell;

    int rootBits = int(frame.log2Cells + kMaxSubcellDepth) - (page.bits - page.partBits);
    uint rootOnly = page.root >> kNodeTypeShift == kNodeInternal ? 0u : 1u;
    uint rootGroup = page.nodesTexel + (rootOnly != 0u ? 0u : 2u * (page.root & kNodePayloadMask));
    if (rootOnly != 0u) rootBits++;
    Descent descent = Descent(rootGroup, kNoGroup, kNoGroup, rootBits, page.root);

    float found = -1.0;
    vec3 lo = vec3(0.0), boxLo = vec3(0.0), boxHi = vec3(0.0);  // lowest corner of the node, and the box to leave
    float edge = 0.0;
    bool leave = false;
    LeafSegment segment;
    while (at.inPage && found < 0.0) {
        // Pass slab and soft leaves until a hit or a hard leaf.
        while (true) {
            // Pass empty nodes until a leaf.
            while (true) {
                if (leave) {
                    Place next = leaveBox(local, at, boxLo, boxHi);
                    ascend(descent, at.subcell, next.subcell, rootGroup, rootBits);
                    at = next;
                    at.inPage = at.inPage && at.tau <= tauUntil;
                    if (!at.inPage) break;
                }
                descend(descent, page.nodesTexel, rootOnly, page.root, at.subcell, work.steps);
                int bits = descent.bits - 1;
                lo = vec3(at.subcell >> bits << bits) * (1.0 / kSubcells);
                edge = float(1 << bits) * (1.0 / kSubcells);
                bool isEmpty = nodeType(descent.node) == kNodeEmpty;
                float clearance = isEmpty ? float(descent.node & kNodePayloadMask) / kClearancePerCell : 0.0;
                boxLo = max(lo - clearance, local.low);
                boxHi = min(lo + (edge + clearance), local.high);
                leave = true;
                if (!isEmpty) break;
            }
            if (!at.inPage) break;
            segment = segmentInLeaf(local, lo, edge, at.tau);
            uint type = nodeType(descent.node);
            if (type == kNodeHard) break;
            // Each kind is in a loop of its own, as in surfaceAt.
            bool slab = type == kNodeSlab, soft = type == kNodeSoft;
            while (slab) {
                found = castSlab(page.sections.faces, descent.node, lo, edge, segment, hit, work);
                slab = false;
            }
            while (soft) {
                found = castSoft(page.sections.faces, descent.node, lo, edge, segment, hit, work);
                soft = false;
            }
            if (found >= 0.0) break;
        }
        if (!at.inPage || found >= 0.0) break;
        found = castHard(page.sections, descent.node, segment, local.direction, hit, work);
    }
    hit.leaf = descent.node;
    int cellBits = page.bits - int(frame.log2Cells);
    int leafBits = cellBits - int(kMaxSubcellDepth) + descent.bits - 1;
    bool slab = nodeType(descent.node) == kNodeSlab;
    if (slab) hit.at.w = float(leafBits);
    if (slab) hit.corners = uvec3(page.corner + ivec3(lo * powerOfTwo(cellBits)));
    if (kFalseColour != 0u && nodeType(descent.node) == kNodeSoft) hit.corners.x = uint(leafBits);
    return found >= 0.0 ? sStart + found * page.cell : kNoHit;
}

// Notes that the rays of this shader, which are of kind kHitBy, hit a page or begin in it.
void markPage(uint record, bool isMet) {
    bool marks = isMet && frame.firstHitMark != 0u;
    while (marks) {
        storeMark(record, kHitBy);
        marks = false;
    }
}

// Returns the ray's first hit in the dataset at distance `from` or farther. Pages from `until` on are not looked at.
// The shader that includes this says in kHitBy what its rays are.
Hit castRay(Ray ray, float from, float until, inout Work work) {
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    ivec3 root = ivec3(1 << kLatticeBits);
    float first = maxOf(planeDistances(ray, mix(root, ivec3(0), ahead)));
    float last = min(minOf(planeDistances(ray, mix(ivec3(0), root, ahead))), until);
    vec3 reached = vec3(max(max(first, 0.0), from));

    Hit hit = Hit(kNoHit, 0u, 0, 0u, vec4(0.0), uvec3(0u));
    Region before = Region(ivec3(0), kNoRegion, false, 0.0), region;
    Seam seam;
    bool inside = reached.x < last, fromNew = true, onSeam = false;
    while (inside) {
        Page page;
        if (!findPage(ray, reached, last, before, region, page, work.steps)) break;
        // A ray that begins in a page may miss it and hit what is below.
        markPage(page.record, region.isPage && reached.x <= 0.0);
        if (fromNew) seam = seamBetween(before, region, reached.x);
        onSeam = fromNew ? levelChanges(before, region) : onSeam;
        float first = onSeam ? seam.first : 0.0, start = onSeam ? seam.first : reached.x,
              stop = onSeam ? seam.last : kNoHit;
        bool look = onSeam ? coarserPage(seam, page, work.steps) : region.isPage;
        if (look) {
            Hit found = hit;
            found.record = page.record;
            found.pageBits = page.bits;
            found.depth = castPage(ray, page, start, stop, found, work);
            float slack = kIntervalSlack * page.cell;
            if (found.depth < hit.depth && found.depth >= first - slack && found.depth <= stop + slack) hit = found;
        }
        if (onSeam) {
            // Next is the seam's next box, or the region itself.
            onSeam = nextBox(ray, seam);
            fromNew = false;
            inside = onSeam || hit.depth > reached.x;
        } else {
            before = region;
            reached = leaveLatticeBox(ray, region.corner, region.bits);
            inside = reached.x < last && hit.depth > reached.x;
            fromNew = true;
        }
    }
    markPage(hit.record, hit.depth < kNoHit);
    return hit;
}
