// findNormals and shadeTile, compiled for several instruction sets, as castTile is (tile_caster.cpp).
#include "render/host/tile_shading.h"

#include <glm/geometric.hpp>

#include "render/host/hit_light.h"
#include "render/host/instruction_sets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/host/tile_shading.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/contrib/math/math-inl.h>

#include "render/host/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// Precondition: x >= 0.
HWY_INLINE Lane pow(Lane x, Lane y) {
    const Lane least(1e-30f);
    return hn::Exp(Floats(), (y * Lane(hn::Log(Floats(), max(x, least).v))).v);
}

// The shared maths of light, for lanes.
using glm::vec4;
#define INLINE HWY_INLINE
#define FOR_LANES
#define Real Lane
#define Real3 Lane3
#include "render/shared/hit_light.h"
#undef INLINE
#undef FOR_LANES
#undef Real
#undef Real3

/// Makes a vector unit; 0 stays near 0.
HWY_INLINE Lane3 normalized(Lane3 v) { return (Lane(1.0f) / sqrt(max(dot(v, v), Lane(1e-30f)))) * v; }

/// The rays' directions of the group of pixels from `i` on: kLanes pixels of one row.
HWY_INLINE Lane3 directionsAt(const PictureRays& rays, glm::ivec2 corner, int i) {
    const double x = corner.x + i % kTileWidth + 0.5, y = corner.y + i / kTileWidth + 0.5;
    const glm::vec3 first(rays.directionAt(x, y)), step(rays.directionPerX);
    const Lane along = hn::Iota(Floats(), 0.0f);
    return normalized(mulAdd(along, spread(step), spread(first)));
}

void findNormalsHere(const PictureRays& rays, const TileHits& hits, TileSurface& surface) {
    for (int i = 0; i < kTilePixels; i += kLanes) {
        const Lane3 direction = directionsAt(rays, hits.corner, i);
        Lane3 n = normalized({load(hits.normalX + i), load(hits.normalY + i), load(hits.normalZ + i)});
        n = normalized(n - max(dot(n, direction), Lane(0.0f)) * direction);
        store(n.x, surface.normalX + i);
        store(n.y, surface.normalY + i);
        store(n.z, surface.normalZ + i);
    }
}

/// Returns channels of 0 to 1 as whole numbers of 0 to 255.
HWY_INLINE LaneWords toByte(Lane x) {
    const Lane scaled = min(max(x, Lane(0.0f)), Lane(1.0f)) * Lane(255.0f);
    return hn::BitCast(Words(), hn::NearestInt(scaled.v));
}

/// Stores colours of 0 to 1 as RGBA8 words.
HWY_INLINE void storeColours(Lane3 colour, uint32_t* words) {
    const LaneWords green = hn::ShiftLeft<8>(toByte(colour.y)), blue = hn::ShiftLeft<16>(toByte(colour.z));
    const LaneWords rgb = hn::Or(toByte(colour.x), hn::Or(green, blue));
    hn::Store(hn::Or(rgb, hn::Set(Words(), 0xff000000u)), Words(), words);
}

/// Returns the light of all that is seen of them; `seen`: as TileSurface::sun.
HWY_INLINE Lane sunlightOfAll(const frame::FrameConstants& frame, Lane3 n, Lane seen) {
    if (frame.lightCount == 1 && frame.lightDirection.w == 1)
        return sunlightOf(n, spread(glm::vec3(frame.lightDirection)), seen);
    Lane sum(0.0f);
    const LaneWords bits = toByte(seen);
    for (uint32_t i = 0; i < frame.lightCount; ++i) {
        const glm::vec4 light = lightNumbered(frame, i);
        const LaneWords own = hn::And(bits, hn::Set(Words(), 1u << i));
        const Lane isSeen = hn::ConvertTo(Floats(), hn::BitCast(Integers(), own));
        sum = sum + Lane(light.w / float(1u << i)) * sunlightOf(n, spread(glm::vec3(light)), isSeen);
    }
    return sum;
}

/// Returns all light on a surface, encoded for the screen.
HWY_INLINE Lane3 lightOn(const frame::FrameConstants& frame, Lane3 n, Lane seen, Lane skySeen) {
    const Lane sunlight = sunlightOfAll(frame, n, seen);
    if (frame.hasEnvironment != 0) return lightInEnvironment(environmentLight(n, frame.environment), sunlight, skySeen);
    const Lane light = encodedLight(n, spread(glm::vec3(frame.upDirection)), sunlight, skySeen);
    return {light, light, light};
}

void shadeTileHere(const frame::FrameConstants& frame, const TileSurface& s, uint32_t* colours) {
    const Lane3 turn = spread(glm::vec3(frame.rotation));
    const Lane half(0.5f);
    for (int i = 0; i < kTilePixels; i += kLanes) {
        const Lane3 n(load(s.normalX + i), load(s.normalY + i), load(s.normalZ + i));
        Lane3 colour(load(s.red + i), load(s.green + i), load(s.blue + i));
        if (frame.shadingMode == frame::kShadeNormals)
            colour = half * turnedBy(turn, Lane(frame.rotation.w), n) + Lane3(half, half, half);
        else if (frame.shadingMode != frame::kShadeUnlit)
            colour = lightOn(frame, n, load(s.sun + i), load(s.sky + i)) * colour;
        storeColours(colour, colours + i);
    }
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcp {

HWY_EXPORT(findNormalsHere);
HWY_EXPORT(shadeTileHere);

void findNormals(const PictureRays& rays, const TileHits& hits, TileSurface& surface) {
    HWY_DYNAMIC_DISPATCH(findNormalsHere)(rays, hits, surface);
}

void shadeTile(const frame::FrameConstants& frame, const TileSurface& surface, uint32_t (&colours)[kTilePixels]) {
    HWY_DYNAMIC_DISPATCH(shadeTileHere)(frame, surface, colours);
}

}  // namespace vcp
#endif
