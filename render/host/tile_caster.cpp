// castTile, compiled for several instruction sets; the best that the processor has is chosen at run time.
#include <limits>

#include "render/host/host_caster.h"
#include "render/host/instruction_sets.h"
#include "render/host/tile_rays.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/host/tile_caster.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "render/host/tile_caster-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

void castTileHere(const HostScene& scene, const TileRays& rays, TileHits& hits) { TileCaster(scene, rays, hits).run(); }

const char* targetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcp {

HWY_EXPORT(castTileHere);
HWY_EXPORT(targetName);

void castTile(const HostScene& scene, const PictureRays& rays, TileHits& hits) {
    hits.size = glm::clamp(rays.size - hits.corner, glm::ivec2(0), glm::ivec2(kTileWidth, kTileHeight));
    HWY_DYNAMIC_DISPATCH(castTileHere)(scene, tileRays(rays, scene.grid(), hits.corner), hits);
}

std::string hostInstructionSet() { return HWY_DYNAMIC_DISPATCH(targetName)(); }

}  // namespace vcp
#endif
