// castLightRays, compiled for several instruction sets, as castTile is (tile_caster.cpp).
#include "render/host/light_rays.h"

#include "render/host/instruction_sets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/host/light_rays.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "render/host/ray_caster-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

void castLightRaysHere(const HostScene& scene, std::span<const LightRay> rays, float* distances, PageMarks* marks) {
    RayCaster caster(scene, marks);
    for (const LightRay& ray : rays) {
        caster.begin(ray.origin, ray.direction, ray.reach);
        *distances++ = caster.next(0);
    }
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcp {

HWY_EXPORT(castLightRaysHere);

void castLightRays(const HostScene& scene, std::span<const LightRay> rays, float* distances, PageMarks* marks) {
    HWY_DYNAMIC_DISPATCH(castLightRaysHere)(scene, rays, distances, marks);
}

}  // namespace vcp
#endif
