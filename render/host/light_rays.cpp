// castLightRays, compiled for several instruction sets, as castTile is (tile_caster.cpp).
#include "render/host/light_rays.h"

#include <array>
#include <vector>

#include "render/host/instruction_sets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/host/light_rays.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "render/host/ray_stream-inl.h"
#include "render/host/sun_tile-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

void castLightRaysHere(const HostScene& scene, std::span<const LightRay> rays, float* distances, PageMarks* marks) {
    std::array<std::vector<uint32_t>, 8> streams;
    for (size_t i = 0; i < rays.size(); ++i) streams[SingleRay::nearestOf(rays[i].direction)].push_back(uint32_t(i));
    RayStream stream(scene, marks);
    for (std::vector<uint32_t>& some : streams) {
        if (areParallel(rays, some)) castParallel(scene, rays, some, distances, marks);
        if (!some.empty()) stream.cast(rays, some, distances);
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
