// Finds first hits of pixels in a dataset of the method `paper`. Reads pool, table and tile list; writes what
// trace.comp does.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/tiles.glsl"
#include "render/shaders/counts.glsl"
#include "render/shaders/sections.glsl"
#include "render/shaders/hit_records.glsl"
#include "render/shared/hit_light.h"

layout(constant_id = 7) const uint kSections = 0u;  // 1: planes cut
layout(constant_id = 8) const uint kScheme = 2u;    // PaperScheme
layout(constant_id = 9) const uint kStep = 1u;      // PaperStep
layout(constant_id = 10) const uint kBack = 1u;     // PaperMarch::back
layout(constant_id = 11) const uint kCached = 1u;   // PaperMarch::cached
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/shaders/paper_cast.glsl"

// Returns the level of the leaf that was hit as a part of that of the roots, from the roots down.
float levelShown(PaperHit hit, PaperPage root) {
    int levels = root.rootLevel + root.shift;
    return float(levels - hit.level) / float(levels);
}

// Returns what a false colour shows, 0 to 1 (ShadingMode). Nothing is certified; levels are those of the leaves.
float falseColour(PaperHit hit, Work work, PaperPage page) {
    return frame.shadingMode == kShadeSteps     ? float(work.steps) / kMostShownSteps
           : frame.shadingMode == kShadeCells   ? float(work.cells) / kMostShownCells
           : frame.shadingMode == kShadeFetches ? float(work.fetches) / kMostShownFetches
           : frame.shadingMode == kShadeLevel   ? levelShown(hit, page)
                                                : 0.0;
}

void main() {
    uvec2 pixel;
    uint tile;
    if (!listedPixel(tile, pixel)) return;

    Ray ray = rayAt(vec2(pixel) + 0.5);
    PaperPage page = fetchRootPage();
    Work work = Work(0u, 0u, 0u);
    Interval kept = Interval(0.0, kNoHit, vec3(0.0));
    if (kSections != 0u) kept = keptInterval(ray);
    PaperHit hit = castPaper(ray, page, kept.first, kept.last, work);

    if (frame.opacity < 1.0 && isFaded(frame.opacity, pixel.x, pixel.y, frame.sampleNumber)) hit.depth = kNoHit;
    bool found = hit.depth < kNoHit;
    hit.normal *= inversesqrt(max(dot(hit.normal, hit.normal), 1e-30));
    hit.normal -= max(dot(hit.normal, ray.direction), 0.0) * ray.direction;
    uint at = pixel.y * frame.width + pixel.x;
    uint plane = frame.width * frame.height;
    storeHit(at, floatBitsToUint(hit.depth));
    storeHit(plane + at, packHitNormal(hit.normal));
    if (kFalseColour != 0u) storeHit(frame.lightPlane * plane + at, floatBitsToUint(falseColour(hit, work, page)));

    countHit(found);
}
