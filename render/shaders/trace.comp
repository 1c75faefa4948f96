// Finds the first hit of every pixel's ray in the tiles that the beam pass left. Reads pool, table, tile starts and
// list; writes depth, normal and, where asked for, colour and the value of a false colour of each pixel of those
// tiles.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/tiles.glsl"
#include "render/shaders/counts.glsl"
const uint kHitBy = kHitByCamera;
#include "render/shaders/cast.glsl"
#include "render/shaders/sections.glsl"
#include "render/shaders/hit_records.glsl"
#include "render/shaders/wireframe.glsl"
#include "render/shared/hit_light.h"
#include "render/shaders/channels.glsl"

layout(constant_id = 7) const uint kSections =
    0u;  // 0: none; 1: planes that cut; 2: with filled caps; 3: of closed parts
layout(local_size_x = 8, local_size_y = 8) in;

const uint kMostCrossings = 64u;
// A ray goes on so far past a hit, in cells of its page: more than leaf walls bridge, less than the thinnest parts.
const float kPastHit = 0.15;
// Triangles bridge nothing, and large ones may be the two sides of a thin plate: past a hit with one a ray goes on by
// twice what triangles are widened by, either way, and by what rounding may move the hit, in edges of the root.
const float kPastTriangle = 4e-4;
const float kRounding = 4.76837158e-7;  // 2^-21

// Slabs whose normals are this near to each other, as a cosine, and of which the second begins so near to the first
// one's plane, in cells, are of one sheet: a ray may cross several where the sheet passes from cell to cell.
const float kOneSheetCosine = 0.6;
const float kOneSheetCells = 0.6;

// A wall that a ray has passed.
struct Wall {
    vec3 normal;  // of a slab; else 0
    float gap;    // how far the ray has come since; finest cells
};

// Returns how far a ray goes on past a hit; finest cells. `cell`: edge of a cell of the hit's page.
float wayPast(Hit hit, float cell) {
    float root = powerOfTwo(int(frame.finestLevel + frame.log2Cells));
    return nodeType(hit.leaf) == kNodeHard ? kPastTriangle * cell + kRounding * root : kPastHit * cell;
}

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
    before = Wall(normal, wayPast(hit, cell));
    return !isSame;
}

// Half the width of the line in which an open surface is cut, in pixels.
const float kLinePixels = 1.0;
// Planes that are seen from so near their edge, as a cosine, show no such lines.
const float kLeastPlaneCosine = 1e-3;

// Whether a hit has an open mark. The kind of leaf that none of the rays in lock step has hit is skipped.
bool isMarkedOpen(Hit hit) {
    bool isOpen = nodeType(hit.leaf) == kNodeSlab && (hit.leaf & kSlabOpenBit) != 0u;
    bool hard = nodeType(hit.leaf) == kNodeHard;
    while (hard) {
        isOpen = (fetchPair(fetchTableSections(hit.record).vertices, hit.corners.x).y & kVertexOpenBit) != 0u;
        hard = false;
    }
    return isOpen;
}

// Whether a hit is of one of these kinds of parts (kRecordHasOpen, kRecordIsOpen), by its page, or by its marks.
bool hasParts(Hit hit, uint kind) {
    bool looks = kSections == 3u && hit.depth < kNoHit, has = false;
    while (looks) {
        uint flags = fetchTableNode(hit.record).flags;
        has = (flags & kind) != 0u;
        bool marked = (flags & kRecordHasMarks) != 0u;
        while (marked) {
            has = isMarkedOpen(hit);
            marked = false;
        }
        looks = false;
    }
    return has;
}

// Whether a point in a section plane is inside of the solid: an odd number of walls lies behind. Two of three rays
// decide, for one may graze a wall.
struct InsideTest {
    Ray ray;  // onward from the last wall
    uint number, inside, outside;
    uint walls, crossings;  // that the ray has met, and that count
    Wall before;
};

// Begins with the next ray from the origin of `eyeRay`.
void nextRay(inout InsideTest test, Ray eyeRay) {
    vec3 d = eyeRay.direction;
    vec3 side = normalize(abs(d.z) < 0.7 ? vec3(d.y, -d.x, 0.0) : vec3(0.0, d.z, -d.y));
    test.ray = eyeRay;
    test.ray.direction = withoutZeros(normalize(d + (test.number == 0u   ? 0.0
                                                     : test.number == 1u ? 0.13
                                                                         : -0.17) *
                                                        side));
    test.ray.inverse = 1.0 / test.ray.direction;
    test.walls = 0u;
    test.crossings = 0u;
    test.before = Wall(vec3(0.0), 0.0);
}

// Takes in the wall that the test's ray has met. Returns whether it is to go on.
bool takeWall(inout InsideTest test, Hit wall, Ray eyeRay) {
    bool open = wall.depth < kNoHit;
    float cell = powerOfTwo(int(frame.finestLevel) + wall.pageBits - int(kLatticeBits));
    if (hasParts(wall, kRecordIsOpen))
        test.before.gap += wall.depth + wayPast(wall, cell);
    else
        test.crossings += open && isNewWall(wall, cell, test.ray.direction, test.before) ? 1u : 0u;
    test.ray = movedAlong(test.ray, open ? wall.depth + wayPast(wall, cell) : 0.0);
    test.walls++;
    if (open && test.walls < kMostCrossings) return true;
    test.inside += test.crossings & 1u;
    test.outside += 1u - (test.crossings & 1u);
    test.number++;
    nextRay(test, eyeRay);
    return test.inside < 2u && test.outside < 2u;
}

// Finds the point of the plane through `place` that is seen at a point of the picture. Returns false where the plane is
// seen from its edge. `normal`: towards the eye.
bool findInPlane(vec2 point, vec3 place, vec3 normal, out vec3 found) {
    Ray ray = rayAt(point);
    float along = dot(normal, ray.direction);
    found = ray.origin + dot(normal, place - ray.origin) / min(along, -kLeastPlaneCosine) * ray.direction;
    return along < -kLeastPlaneCosine;
}

// Finds a short piece of a section plane about a point, across which an open surface is cut where its line covers the
// point: along x or y of the picture. `pixel`: where the point is seen. Returns false where there is none.
bool findPiece(vec2 pixel, vec3 place, vec3 normal, bool alongX, out Ray piece, out float reach) {
    vec2 aside = alongX ? vec2(kLinePixels, 0.0) : vec2(0.0, kLinePixels);
    vec3 from, to;
    bool isSeen = findInPlane(pixel - aside, place, normal, from);
    isSeen = findInPlane(pixel + aside, place, normal, to) && isSeen;
    reach = distance(from, to);
    piece.origin = from;
    piece.direction = withoutZeros((to - from) / max(reach, 1e-30));
    piece.inverse = 1.0 / piece.direction;
    return isSeen;
}

// What the rays of a cut pixel are asked, one after the other. One place casts them all: devices that compile each
// place anew take as many times as long.
const uint kAskFirst = 0u;   // what is seen first
const uint kAskInside = 1u;  // whether the point where the ray enters is inside
const uint kAskLineX = 2u;   // whether the line of an open surface covers it
const uint kAskLineY = 3u;
const uint kAskNothing = 4u;

// Finds the first hit in what the section planes leave, and on the caps. `pixel`: where the ray is seen.
Hit castCut(Ray ray, vec2 pixel, Interval kept, float from, inout bool onCap, inout Work work) {
    Ray rest = movedAlong(ray, kept.first), now = rest;
    float last = kept.last - kept.first, until = last;
    // Where pages are marked, rays are to begin in those that the plane cuts.
    float start = frame.firstHitMark != 0u ? 0.0 : max(from - kept.first, 0.0);
    bool entering = kSections >= 2u && kept.first > 0.0 && kept.first < kept.last, isSeen = false;
    InsideTest test = InsideTest(rest, 0u, 0u, 0u, 0u, 0u, Wall(vec3(0.0), 0.0));
    Hit first;
    uint asks = kAskFirst;
    while (asks != kAskNothing) {
        Hit hit = castRay(now, start, until, work);
        if (asks == kAskFirst) {
            first = hit;
            if (first.depth > last) first.depth = kNoHit;
            asks = entering ? kAskInside : kAskNothing;
            nextRay(test, rest);
        } else if (asks == kAskInside) {
            bool goesOn = takeWall(test, hit, rest);
            onCap = test.inside == 2u;
            if (!goesOn) asks = kSections == 3u && !onCap ? kAskLineX : kAskNothing;
        } else {
            onCap = isSeen && hit.depth <= until && hasParts(hit, kRecordHasOpen);
            if (onCap) first = hit;
            asks = onCap || asks == kAskLineY ? kAskNothing : kAskLineY;
        }
        now = test.ray;
        start = 0.0;
        until = kNoHit;
        if (kSections == 3u && (asks == kAskLineX || asks == kAskLineY))
            isSeen = findPiece(pixel, rest.origin, kept.plane, asks == kAskLineX, now, until);
    }
    if (onCap) first.depth = 0.0;
    if (first.depth < kNoHit) first.depth += kept.first;
    return first;
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
        hit = castCut(ray, vec2(pixel) + 0.5, kept, from, onCap, work);
        surface = surfaceAt(hit, ray.direction);
        if (onCap) surface.normal = kept.plane;
    }

    if (frame.opacity < 1.0 && isFaded(frame.opacity, pixel.x, pixel.y, frame.sampleNumber)) hit.depth = kNoHit;
    bool found = hit.depth < kNoHit;
    // A blended normal may lean away from the ray near a silhouette: it is bent back to it.
    vec3 unit = surface.normal * inversesqrt(max(dot(surface.normal, surface.normal), 1e-30));
    vec3 normal = unit - max(dot(unit, ray.direction), 0.0) * ray.direction;
    uint at = pixel.y * frame.width + pixel.x;
    uint plane = frame.width * frame.height;
    storeHit(at, floatBitsToUint(onCap ? -hit.depth : hit.depth));
    storeHit(plane + at, packHitNormal(normal));
    if (kColour != 0u) storeHit(2u * plane + at, packUnorm4x8(surface.colour));
    if (kColour == 3u) {
        HitChannels c = HitChannels(false, normal, 0.0, 0.0, vec3(0.0));
        if (!onCap) c = channelsAt(hit, normal, ray.direction);
        uint behind = frame.lightPlane + 1u;
        storeHit(behind * plane + at, packHitNormal(c.normal));
        storeHit((behind + 1u) * plane + at, packHitSurface(c.areThere, c.roughness, c.metalness));
        storeHit((behind + 2u) * plane + at, packUnorm4x8(vec4(colourOfLight(c.emission), 0.0)));
    }
    if (kFalseColour != 0u) {
        float shown = falseColour(hit, work);
        bool wired = frame.shadingMode == kShadeWireframe;
        while (wired) {
            shown = onCap ? 0.0 : lineOf(hit, unit, ray.direction);
            wired = false;
        }
        storeHit(frame.lightPlane * plane + at, floatBitsToUint(shown));
    }

    storeHitPage(hit.record, found);
    countHit(found);
}
