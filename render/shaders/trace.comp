// Finds the first hit of every pixel's ray in the tiles that the beam pass left. Reads pool, table, tile starts and
// list; writes depth, normal and, where asked for, colour and the value of a false colour of each pixel of those
// tiles.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/tiles.glsl"
const uint kHitBy = kHitByCamera;
#include "render/shaders/cast.glsl"
#include "render/shaders/sections.glsl"
#include "render/shaders/hit_records.glsl"

layout(constant_id = 6) const uint kSections = 0u;  // 0: none; 1: planes that cut; 2: with filled caps
layout(local_size_x = 8, local_size_y = 8) in;

const uint kMostCrossings = 64u;
// A ray goes on so far past a hit, in cells of its page: more than leaf walls bridge, less than the thinnest parts.
const float kPastHit = 0.15;

// Slabs whose normals are this near to each other, as a cosine, and of which the second begins so near to the first
// one's plane, in cells, are of one sheet: a ray may cross several where the sheet passes from cell to cell.
const float kOneSheetCosine = 0.6;
const float kOneSheetCells = 0.6;

// A wall that a ray has passed.
struct Wall {
    vec3 normal;  // of a slab; else 0
    float gap;    // how far the ray has come since; finest cells
};

// Returns whether a hit is not of the same sheet as the wall before it, and makes it the wall before the next.
bool isNewWall(Hit hit, float cell, vec3 direction, inout Wall before) {
    vec3 normal = vec3(0.0);
    bool slab = hit.depth < kNoHit && nodeType(hit.leaf) == kNodeSlab;
    while (slab) {
        normal = slabDirection(hit.leaf, fetchTableSections(hit.record).faces);
        slab = false;
    }
    bool isSame = abs(dot(normal, before.normal)) > kOneSheetCosine &&
                  abs(dot(direction, before.normal)) * (before.gap + hit.depth) < kOneSheetCells * cell;
    before = Wall(normal, kPastHit * cell);
    return !isSame;
}

// Whether a point in a section plane, the ray's origin, is inside of the solid: an odd number of walls lies
// behind. Two of three rays decide, for one may graze a wall.
bool isInside(Ray ray, inout Work work) {
    vec3 side = normalize(abs(ray.direction.z) < 0.7 ? vec3(ray.direction.y, -ray.direction.x, 0.0)
                                                     : vec3(0.0, ray.direction.z, -ray.direction.y));
    uint inside = 0u, outside = 0u;
    for (int k = 0; inside < 2u && outside < 2u; k++) {
        Ray onward = ray;
        onward.direction = withoutZeros(normalize(ray.direction + (k == 0 ? 0.0 : k == 1 ? 0.13 : -0.17) * side));
        onward.inverse = 1.0 / onward.direction;
        uint crossings = 0u;
        bool open = true;
        Wall before = Wall(vec3(0.0), 0.0);
        for (uint turn = 0u; open && turn < kMostCrossings; turn++) {
            Hit wall = castRay(onward, 0.0, kNoHit, work);
            open = wall.depth < kNoHit;
            float cell = powerOfTwo(int(frame.finestLevel) + wall.pageBits - int(kLatticeBits));
            crossings += open && isNewWall(wall, cell, onward.direction, before) ? 1u : 0u;
            onward = movedAlong(onward, open ? wall.depth + kPastHit * cell : 0.0);
        }
        inside += crossings & 1u;
        outside += 1u - (crossings & 1u);
    }
    return inside == 2u;
}

// Finds the first hit in what the section planes leave, and on the caps.
Hit castCut(Ray ray, Interval kept, float from, inout bool onCap, inout Work work) {
    Ray rest = movedAlong(ray, kept.first);
    float last = kept.last - kept.first;
    // Where pages are marked, rays are to begin in those that the plane cuts.
    float start = frame.firstHitMark != 0u ? 0.0 : max(from - kept.first, 0.0);
    Hit hit = castRay(rest, start, last, work);
    if (hit.depth > last) hit.depth = kNoHit;
    if (kSections == 2u) {
        // This loop runs once; a device that skips nothing skips it where no ray enters through a plane.
        bool entering = kept.first > 0.0 && kept.first < kept.last;
        while (entering) {
            onCap = isInside(rest, work);
            entering = false;
        }
        if (onCap) hit.depth = 0.0;
    }
    if (hit.depth < kNoHit) hit.depth += kept.first;
    return hit;
}

// Returns what a false colour shows of a hit, 0 to 1 (ShadingMode).
float falseColour(Hit hit, Work work) {
    int level = int(kLatticeBits) - hit.pageBits;
    float error = uintBitsToFloat(fetchTableNode(hit.record).flags & kRecordErrorMask);
    float pixels = error / max(pixelEdgeAt(hit.depth), 1e-30);
    return frame.shadingMode == kShadeSteps     ? float(work.steps) / kMostShownSteps
           : frame.shadingMode == kShadeCells   ? float(work.cells) / kMostShownCells
           : frame.shadingMode == kShadeFetches ? float(work.steps + work.fetches) / kMostShownFetches
           : frame.shadingMode == kShadeLevel   ? float(level) / max(float(frame.finestLevel), 1.0)
                                                : pixels;
}

void main() {
    uvec2 pixel;
    uint tile;
    if (!listedPixel(tile, pixel)) return;

    Ray ray = rayAt(vec2(pixel) + 0.5);
    Work work = Work(0u, 0u, 0u);
    float from = fetchTileStart(tile);
    bool onCap = false;
    Hit hit;
    Surface surface;
    if (kSections == 0u) {
        hit = castRay(ray, from, kNoHit, work);
        surface = surfaceAt(hit, ray.direction);
    } else {
        Interval kept = keptInterval(ray);
        hit = castCut(ray, kept, from, onCap, work);
        surface = surfaceAt(hit, ray.direction);
        if (onCap) surface.normal = kept.plane;
    }

    bool found = hit.depth < kNoHit;
    // A blended normal may lean away from the ray near a silhouette: it is bent back to it.
    vec3 normal = surface.normal * inversesqrt(max(dot(surface.normal, surface.normal), 1e-30));
    normal -= max(dot(normal, ray.direction), 0.0) * ray.direction;
    uint at = pixel.y * frame.width + pixel.x;
    uint plane = frame.width * frame.height;
    hits[at] = floatBitsToUint(onCap ? -hit.depth : hit.depth);
    hits[plane + at] = packHitNormal(normal);
    if (kColour != 0u) hits[2u * plane + at] = packUnorm4x8(surface.colour);
    if (kFalseColour != 0u) hits[frame.lightPlane * plane + at] = floatBitsToUint(falseColour(hit, work));

    uint hitCount = subgroupBallotBitCount(subgroupBallot(found));
    if (subgroupElect()) atomicAdd(counters.hitPixels, hitCount);
    if (kCountSteps != 0u) {
        atomicAdd(counters.steps, work.steps);
        atomicAdd(counters.fetches, work.steps + work.fetches);
    }
}
