// The rays of a row of a picture through a mesh in Embree, eight at a time. For builds that have Embree.
#pragma once

#include <cmath>

#include "viewer/bench/rays/embree_scene.h"

namespace vcp {

/// Traces `samples` x `samples` rays a pixel, on the points of an even grid, through `width` pixels of row `y`: from
/// left to right and then downwards. Calls hit(rays, k, pixel) for ray k of eight that hit something.
template <class Hit>
void traceRow(const EmbreeScene& scene, const FloatCamera& camera, int y, int width, int samples, const Hit& hit) {
    const int across = width * samples;
    for (int line = 0; line < samples; ++line)
        for (int first = 0; first < across; first += 8) {
            alignas(32) int valid[8];
            alignas(32) RTCRayHit8 r;
            for (int k = 0; k < 8; ++k) {
                valid[k] = first + k < across ? -1 : 0;
                const float px = (float(first + k) + 0.5f) / float(samples);
                const float py = float(y) + (float(line) + 0.5f) / float(samples);
                const glm::vec3 d = camera.direction(px, py);
                r.ray.org_x[k] = camera.eye.x, r.ray.org_y[k] = camera.eye.y, r.ray.org_z[k] = camera.eye.z;
                r.ray.dir_x[k] = d.x, r.ray.dir_y[k] = d.y, r.ray.dir_z[k] = d.z;
                r.ray.tnear[k] = 0, r.ray.time[k] = 0, r.ray.tfar[k] = INFINITY;
                r.ray.mask[k] = ~0u, r.ray.flags[k] = 0, r.ray.id[k] = 0;
                r.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
            }
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
            rtcIntersect8(valid, scene.scene(), &context, &r);
            for (int k = 0; k < 8; ++k)
                if (valid[k] && r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID) hit(r, k, (first + k) / samples);
        }
}

}  // namespace vcp
