// Casts a ray through pages of the method `paper` (octree/page/paper_page.h): the march of Demir and Westermann 2015,
// as builder/paper/paper_octree.h does it on the CPU. Grid space: finest cells from the root page's lowest corner.
// Where the file has subvolumes, each step looks for the page that counts there; lengths and epsilon are those of its
// cells.
#define INLINE
#define CONST_REF(T) T
#include "octree/shared/paper_math.h"

struct PaperHit {
    float depth;  // finest cells along the ray; kNoHit, kGaveUp
    vec3 normal;  // towards the ray's origin, not normalized
    int level;    // level of the leaf: 0 is that of the finest cells
};

// The work of a ray; counted with kCountSteps only.
struct Work {
    uint steps, cells, fetches;
};

struct PaperPage {
    uint nodes, slices;  // texels
    int rootLevel;
    uvec3 roots;
    ivec3 cells;
    ivec3 low;  // grid space
    int shift;  // its cells are 2^shift finest ones an edge
    uint packing;
    float perDistance;  // cells per unit of an empty node's distance
    float perRoot;      // root of cells per unit of a packed length
    bool isThere;
};

PaperPage fetchPaperPage(TableNode record, ivec3 low) {
    PaperPage page;
    page.isThere = (record.flags & kRecordResident) != 0u;
    uint at = page.isThere ? record.pageTexel : 0u;
    uvec4 words0 = fetchTexel(at), words1 = fetchTexel(at + 1u), words2 = fetchTexel(at + 2u),
          words3 = fetchTexel(at + 3u);
    page.nodes = at + kPaperHeaderBytes / 16u;
    page.slices = page.nodes + (words0.w + 3u) / 4u;
    page.rootLevel = int(words0.y);
    page.packing = words0.z;
    page.roots = words1.xyz;
    page.cells = ivec3(words1.xyz) << page.rootLevel;
    page.low = low;
    page.shift = int(words3.x);
    page.perDistance = uintBitsToFloat(words2.x) / float(kPaperEmpty - 1);
    page.perRoot = sqrt(uintBitsToFloat(words2.y)) / 8191.0;
    return page;
}

PaperPage fetchRootPage() { return fetchPaperPage(fetchTableNode(0u), ivec3(0)); }

// Returns the page that counts in a subvolume: its own, where the cut has that, else the root's.
PaperPage pageAt(ivec3 subvolume) {
    TableNode root = fetchTableNode(0u), record = root;
    uint level = 0u, node = 0u;
    bool below = true;
    while (below) {
        record = fetchTableNode(node);
        ivec3 bits = (subvolume >> (frame.finestLevel - min(level + 1u, frame.finestLevel))) & 1;
        uint octant = uint(bits.x | bits.y << 1 | bits.z << 2);
        below = level < frame.finestLevel && (record.flags & kRecordInCut) == 0u && hasOctant(record, octant);
        node = below ? childIn(record, octant) : node;
        level += below ? 1u : 0u;
    }
    bool isOwn = level == frame.finestLevel && (record.flags & (kRecordInCut | kRecordIsOctant)) == kRecordInCut;
    if (isOwn) return fetchPaperPage(record, subvolume << frame.log2Cells);
    return fetchPaperPage(root, ivec3(0));
}

// A node, its parent, and where they are.
struct PaperPlace {
    ivec3 cell;
    int level, parentLevel;  // -1: none is remembered
    int word, parent;
};

bool holdsCell(int level, ivec3 a, ivec3 b) {
    ivec3 changed = a ^ b;
    return level >= 0 && (changed.x | changed.y | changed.z) >> max(level, 0) == 0;
}

// Finds the leaf or empty node at a cell, from the parent of the last one where that holds it too (4.2).
void findNode(PaperPage page, ivec3 cell, inout PaperPlace at, inout Work work) {
    bool known = holdsCell(at.level, cell, at.cell);
    bool fromParent = holdsCell(at.parentLevel, cell, at.cell);
    ivec3 root = cell >> page.rootLevel;
    int level = fromParent ? at.parentLevel - 1 : page.rootLevel;
    ivec3 bits = (cell >> max(level, 0)) & 1;
    uint octant = uint(bits.x | bits.y << 1 | bits.z << 2);
    uint index = fromParent ? uint(at.parent) + octant
                            : (uint(root.z) * page.roots.y + uint(root.y)) * page.roots.x + uint(root.x);
    if (!known && !fromParent) at.parentLevel = -1;
    bool inner = !known;
    while (inner) {
        int word = int(fetchWord(page.nodes, index));
        if (kCountSteps != 0u) work.fetches++;
        inner = word >= 0 && word < kPaperEmpty;
        at.word = word;
        at.level = level;
        if (inner) {
            at.parent = word;
            at.parentLevel = level;
            level--;
            bits = (cell >> level) & 1;
            index = uint(word) + uint(bits.x | bits.y << 1 | bits.z << 2);
        }
    }
    at.cell = known ? at.cell : cell;
}

vec3 unpackPaperVector(uint code, PaperPage page) {
    float root = float(code & 8191u) * page.perRoot;
    return root * root * (page.packing == kPaperSpherical ? sphericalDirection(code) : octahedralDirection(code));
}

LeafVectors fetchLeafVectors(PaperPage page, int word) {
    uint slice = page.slices + uint(-(word + 1));
    uvec4 low = fetchTexel(slice), high = fetchTexel(slice + 1u);
    LeafVectors corners;
    for (int k = 0; k < 8; k++) {
        vec3 v = unpackPaperVector(k < 4 ? low[k & 3] : high[k & 3], page);
        corners.x[k] = v.x;
        corners.y[k] = v.y;
        corners.z[k] = v.z;
    }
    return corners;
}

// Returns the first hit between two distances along the ray. `page`: the root's.
PaperHit castPaper(Ray ray, PaperPage page, float from, float until, inout Work work) {
    PaperHit hit = PaperHit(kNoHit, -ray.direction, 0);
    int perCell = int(frame.latticePerCell);
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    ivec3 cells = page.cells << page.shift;
    ivec3 high = cells * perCell;
    float first = max(maxOf(planeDistances(ray, mix(high, ivec3(0), ahead))), from);
    float last = min(minOf(planeDistances(ray, mix(ivec3(0), high, ahead))), until);
    vec3 eye = vec3(frame.originLattice.xyz) * frame.cellPerLattice + ray.origin;
    vec3 start = clamp(eye + first * ray.direction, vec3(0.0), vec3(cells));
    float tMax = page.isThere ? last - first : -1.0;
    ivec3 subvolume = ivec3(-1);

    PaperPlace at = PaperPlace(ivec3(0), -1, -1, 0, 0);
    LeafVectors corners;
    for (int k = 0; k < 8; k++) corners.x[k] = corners.y[k] = corners.z[k] = 0.0;
    int loaded = 0;
    float t = 0.0, lastT = 0.0, lastDistance = 0.0;
    uint steps = 0u;
    bool going = t <= tMax, isBack = false;
    while (going) {
        steps++;
        vec3 p = start + t * ray.direction;
        if (kCached == 0u) {
            at.level = -1;
            at.parentLevel = -1;
            loaded = 0;
        }
        ivec3 cell = clamp(ivec3(p), ivec3(0), cells - 1);
        if (frame.finestLevel > 0u && cell >> frame.log2Cells != subvolume) {
            subvolume = cell >> frame.log2Cells;
            uint before = page.nodes;
            page = pageAt(subvolume);
            if (page.nodes != before) {
                at.level = -1;
                at.parentLevel = -1;
                loaded = 0;
            }
        }
        float scale = float(1 << page.shift), epsilon = frame.paperEpsilon * scale;
        vec3 q = (p - vec3(page.low)) / scale;
        findNode(page, clamp(ivec3(q), ivec3(0), page.cells - 1), at, work);
        bool isLeaf = at.word < 0;
        if (isLeaf && at.word != loaded) {
            corners = fetchLeafVectors(page, at.word);
            loaded = at.word;
            if (kCountSteps != 0u) {
                work.cells++;
                work.fetches += 2u;
            }
        }
        float size = float(1 << at.level);
        vec3 low = vec3(at.cell >> at.level << at.level);
        vec3 v = interpolateVectors(corners, size, (q - low) / size, kScheme) * scale;
        float d = isLeaf ? length(v) : float(at.word - kPaperEmpty) * page.perDistance * scale;
        bool isHit = isLeaf && d < epsilon && !isBack;
        // The vector is that of the point moved back to; before, it may point either way, or be too short to point
        // anywhere.
        vec3 facing = dot(v, ray.direction) > 0.0 ? -v : v;
        if ((isHit || (isBack && isLeaf)) && d > 0.0) hit.normal = facing;
        if (isHit) {
            t = kBack != 0u ? lastT + marchBack(lastDistance, d, epsilon) * (t - lastT) : t;
            hit.depth = first + t;
            hit.level = at.level + page.shift;
        }
        bool ends = isBack || (isHit && kBack == 0u);
        isBack = isHit;
        lastT = isHit ? lastT : t;
        lastDistance = d;
        float onward = isLeaf ? marchStep(d, dot(v, ray.direction), epsilon, kStep) : max(d, epsilon);
        t += isHit ? 0.0 : onward;
        going = !ends && (isHit || (t <= tMax && steps < kPaperMostSteps));
        if (!ends && !going && t <= tMax) hit.depth = kGaveUp;
    }
    if (kCountSteps != 0u) work.steps += steps;
    return hit;
}
