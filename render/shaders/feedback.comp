// Reports what the rays of a few pixels met on their way: pages of the cut that they entered, and where they hit. Reads
// table, tile starts and hits; writes the feedback buffer (render/shared/frame_layout.h).
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/rays.glsl"
#include "render/shaders/hit_records.glsl"

layout(local_size_x = 64) in;

// A walk ends after so many pages; rays that matter meet fewer.
const uint kMostBoxes = 512u;

uvec2 feedbackPixel(uint ray) {
    uvec2 part = uvec2(ray % kFeedbackWidth, ray / kFeedbackWidth);
    vec2 place = vec2(part) + vec2(frame.feedbackX, frame.feedbackY);
    vec2 point = place * vec2(pictureSize()) / vec2(kFeedbackWidth, kFeedbackHeight);
    return min(uvec2(point), pictureSize() - 1u);
}

// Finds the box of the page tree at `place`: a page of the cut, or an octant without one. Returns the record's flags.
uint boxAt(ivec3 place, out uint node, out int bits) {
    node = 0u;
    bits = int(kLatticeBits);
    bool exists = true;
    TableNode record = TableNode(0u, 0u, 0u, 0u);
    while (exists && (record.flags & kRecordInCut) == 0u) {
        record = fetchTableNode(node);
        if ((record.flags & kRecordInCut) == 0u) {
            bits--;
            ivec3 b = (place >> bits) & 1;
            uint octant = uint(b.x | b.y << 1 | b.z << 2);
            exists = hasOctant(record, octant);
            node = childIn(record, octant);
        }
    }
    return exists ? record.flags : 0u;
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    uvec2 pixel = feedbackPixel(number);
    float start = fetchTileStart(pixel.y / kTileSize * frame.tilesX + pixel.x / kTileSize);
    if (start >= kTileEmpty) return;
    float depth = fetchPixelHit(pixel.y * frame.width + pixel.x).depth;

    Ray ray = rayAt(vec2(pixel) + 0.5);
    bvec3 ahead = greaterThan(ray.direction, vec3(0.0));
    ivec3 root = ivec3(1 << kLatticeBits);
    float s = max(max(maxOf(planeDistances(ray, mix(root, ivec3(0), ahead))), 0.0), start);
    float last = minOf(planeDistances(ray, mix(ivec3(0), root, ahead)));
    float rootEdge = float(1 << kLatticeBits) * frame.cellPerLattice;
    ivec3 place = clamp(latticePoint(ray, s), ivec3(0), root - 1);
    bool inside = s <= last;
    for (uint i = 0u; i < kMostBoxes && inside; i++) {
        uint node;
        int bits;
        uint flags = boxAt(place, node, bits);
        ivec3 corner = place >> bits << bits, edge = ivec3(1 << bits);
        vec3 t = planeDistances(ray, mix(corner, corner + edge, ahead));
        float leave = max(s, minOf(t));
        bool isHere = depth <= leave;
        if ((flags & kRecordInCut) != 0u) {
            float nearness = kNearnessOne * kNearnessEps / (s / rootEdge + kNearnessEps);
            atomicAdd(feedback[kFeedbackRays * kFeedbackRayWords + node], uint(nearness + 0.5));
            if (isHere) {
                ivec3 hit = clamp(latticePoint(ray, depth), corner, corner + edge - 1);
                uint at = number * kFeedbackRayWords;
                feedback[at] = uint(hit.x);
                feedback[at + 1u] = uint(hit.y);
                feedback[at + 2u] = uint(hit.z);
                feedback[at + 3u] = node + 1u;
            }
        }
        // Step across the face that the ray leaves by.
        ivec3 sideways = clamp(latticePoint(ray, leave), corner, corner + edge - 1);
        place = mix(sideways, mix(corner - 1, corner + edge, ahead), equal(t, vec3(minOf(t))));
        s = leave;
        inside = !isHere && ((place.x | place.y | place.z) >> kLatticeBits) == 0;
    }
}
