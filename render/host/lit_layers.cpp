#include "render/host/lit_layers.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/host/hit_light.h"
#include "render/host/hit_surface.h"
#include "render/host/layer_tiles.h"

namespace vcp {

namespace {

// Occlusion rays of so many numbers are cast side by side: they meet the same leaves.
constexpr uint32_t kAtOnce = 8;

/// A layer, and what takes rays of the world into it.
struct Lit {
    Lit(const HostLayer& from, glm::ivec2 size)
        : layer(from),
          tiles(from, size),
          fromWorld(glm::conjugate(tiles.turn())),
          cell(from.scene.grid().cell * from.worldPerUnit) {}

    const HostLayer& layer;
    const LayerTiles tiles;
    const glm::quat fromWorld;
    const double cell;  // world units
};

/// What a pixel shows that is seen from far of a surface.
struct FarLook {
    bool isFar = false;
    float sky = 0;
    glm::vec4 light{0};
};

/// What is kept of each pixel beside the picture's depth, normal and hit; lengths are world units.
struct LitPlanes {
    LitPlanes(size_t pixels, bool hasFar, bool hasTransfer, bool hasChannels)
        : albedo(pixels),
          lift(pixels),
          edge(pixels),
          sun(pixels),
          sky(pixels),
          far(hasFar ? pixels : 0),
          arrives(hasTransfer ? pixels : 0),
          channels(hasChannels ? pixels : 0) {}

    std::vector<glm::vec3> albedo;
    std::vector<float> lift, edge;  // by which rays of light begin above the hit; of the pixel there
    std::vector<uint8_t> sun, sky;
    std::vector<FarLook> far;                          // empty where no surface is seen from far
    std::vector<uint32_t> arrives;                     // MesoHit::arrives; empty where no surface has transfer
    std::vector<std::optional<HitChannels>> channels;  // in the world's axes; empty where no layer shows any
};

/// The hits of a tile, and the light there.
struct LitTile {
    struct Pixel {
        glm::ivec2 pixel;
        size_t at;  // in the picture
        glm::vec3 normal;
        bool onSurface;
    };
    Pixel pixels[kTilePixels];
    size_t count = 0;
};

bool readsTransfer(const HostSurface& surface) {
    return surface.view.transfer.up != 0 && surface.view.hasEnvironment != 0;
}

class LitDrawing {
public:
    LitDrawing(const LitScene& scene, HostPicture& picture)
        : picture_(picture),
          surfaces_(scene.surfaces),
          lit_(litLayers(scene, picture.size)),
          planes_(picture.colours.size(),
                  std::any_of(scene.surfaces.begin(), scene.surfaces.end(), std::mem_fn(&HostSurface::isFarDrawn)),
                  std::any_of(scene.surfaces.begin(), scene.surfaces.end(), readsTransfer),
                  std::any_of(lit_.begin(), lit_.end(), [](const auto& each) { return each->tiles.hasChannels(); })),
          frame_(scene.frame),
          reach_(scene.occlusionReach) {
        for (const HostLayer& layer : scene.layers) isMarking_ = isMarking_ || layer.marks != nullptr;
        if (!surfaces_.empty()) picture_.iterations.resize(picture_.colours.size());
    }

    Result<void> draw(const HostCastOptions& options) {
        const bool averagesSky = frame_.occlusionRays > 0;
        const bool showsIterations = frame_.shadingMode == frame::kShadeSteps && !surfaces_.empty();
        VCP_TRY(forEachTile(picture_.size, options, [&](glm::ivec2 corner) {
            for (const auto& each : lit_) castLayer(*each, corner);
            SurfaceWork work;
            std::vector<SurfaceCaster> casters;
            for (const HostSurface& surface : surfaces_) casters.emplace_back(surface);
            for (SurfaceCaster& caster : casters) castSurface(caster, corner, work);
            if (showsIterations) showIterations(corner);
            const LitTile tile = hitsOf(corner);
            if (tile.count == 0) return;
            for (size_t k = 0; k < tile.count; ++k) planes_.sun[tile.pixels[k].at] = 255;
            for (uint32_t i = 0; frame_.hasShadows != 0 && i < frame_.lightCount; ++i) {
                castSun(tile, i);
                for (SurfaceCaster& caster : casters) castSun(caster, tile, i, work);
            }
            if (averagesSky)
                castSky(tile, casters, work);
            else if (!showsIterations)
                shade(corner, false);
            unresolvedRays_ += work.unresolvedRays, farHits_ += work.farHits;
        }));
        picture_.unresolvedRays += unresolvedRays_, picture_.farSurfaceHits += farHits_;
        if (!averagesSky) return {};
        return forEachTile(picture_.size, options, [&](glm::ivec2 corner) { shade(corner, true); });
    }

private:
    using LitLayers = std::vector<std::unique_ptr<const Lit>>;
    static LitLayers litLayers(const LitScene& scene, glm::ivec2 size) {
        LitLayers layers;
        for (const HostLayer& layer : scene.layers) layers.push_back(std::make_unique<Lit>(layer, size));
        return layers;
    }

    [[nodiscard]] size_t at(glm::ivec2 pixel) const {
        return size_t(pixel.y) * size_t(picture_.size.x) + size_t(pixel.x);
    }

    /// Puts a layer's hits in a tile into the picture, where they are nearer than what is there.
    void castLayer(const Lit& each, glm::ivec2 corner) {
        TileHits hits;
        hits.corner = corner;
        each.tiles.cast(hits);
        if (!hits.any) return;
        TileSurface surface;
        findNormals(each.layer.rays, hits, surface);
        each.tiles.findAlbedo(hits, surface);
        std::vector<std::optional<HitChannels>> channels(planes_.channels.empty() ? 0 : kTilePixels);
        for (const auto& [i, of] : each.tiles.findChannels(hits, surface)) channels[size_t(i)] = turned(each, of);
        forEachPixel(picture_.size, corner, [&](glm::ivec2 pixel, int i) {
            const size_t to = at(pixel);
            const auto depth = float(double(hits.depth[i]) * each.layer.worldPerUnit);
            if (!(depth < picture_.depth[to])) return;
            const float inCells = each.tiles.depthInCells(hits.depth[i]);
            picture_.depth[to] = depth;
            picture_.normals[to] = each.tiles.turn() * surface.normal(i);
            picture_.hits[to] = each.tiles.hitOf(hits, i);
            planes_.albedo[to] = {surface.red[i], surface.green[i], surface.blue[i]};
            planes_.lift[to] = float(double(each.tiles.liftAt(inCells)) * each.cell);
            planes_.edge[to] = float(double(each.tiles.pixelEdgeAt(inCells)) * each.cell);
            if (!planes_.channels.empty()) planes_.channels[to] = channels[size_t(i)];
        });
    }

    /// Returns channels in the world's axes.
    static HitChannels turned(const Lit& each, HitChannels channels) {
        channels.normal = each.tiles.turn() * channels.normal;
        channels.towardsEye = each.tiles.turn() * channels.towardsEye;
        return channels;
    }

    /// Does the same with a surface.
    void castSurface(SurfaceCaster& caster, glm::ivec2 corner, SurfaceWork& work) {
        forEachPixel(picture_.size, corner, [&](glm::ivec2 pixel, int) {
            const size_t to = at(pixel);
            MesoHit hit;
            hit.depth = picture_.depth[to];
            if (!caster.castPixel(pixel, hit, picture_.iterations[to], work)) return;
            picture_.depth[to] = hit.depth;
            picture_.normals[to] = hit.normal;
            picture_.hits[to] = {.dataset = HostHit::kOnSurface};
            planes_.albedo[to] = hit.colour;
            planes_.lift[to] = caster.surface().view.shadowLift;
            planes_.edge[to] = hit.width;
            if (!planes_.far.empty()) planes_.far[to] = {hit.isFar, hit.sky, hit.light};
            if (!planes_.arrives.empty()) planes_.arrives[to] = hit.arrives;
            if (!planes_.channels.empty()) planes_.channels[to].reset();
        });
    }

    /// Returns the hits of what is drawn: without layers, those on surfaces.
    [[nodiscard]] LitTile hitsOf(glm::ivec2 corner) const {
        LitTile tile;
        forEachPixel(picture_.size, corner, [&](glm::ivec2 pixel, int) {
            const size_t from = at(pixel);
            const bool onSurface = picture_.hits[from].dataset == HostHit::kOnSurface;
            if (picture_.depth[from] < kNoDepth && (onSurface || !lit_.empty()))
                tile.pixels[tile.count++] = {pixel, from, picture_.normals[from], onSurface};
        });
        return tile;
    }

    [[nodiscard]] bool isFar(size_t pixel) const { return !planes_.far.empty() && planes_.far[pixel].isFar; }

    /// Returns a ray of light through a layer from above a hit. `direction`: in the world; `reach`: world units.
    [[nodiscard]] LightRay lightRay(const Lit& each, const LitTile::Pixel& from, glm::vec3 direction,
                                    float reach) const {
        const glm::dvec3 origin =
            each.tiles.above(from.pixel, double(picture_.depth[from.at]) / each.cell,
                             float(double(planes_.lift[from.at]) / each.cell), each.fromWorld * from.normal);
        return each.tiles.lightRay(origin, each.fromWorld * direction, float(double(reach) / each.cell));
    }

    void castSun(const LitTile& tile, uint32_t number) {
        const glm::vec3 light(lightNumbered(frame_, number));
        const uint8_t bits = bitsOfLight(frame_, number);
        const auto darken = [&](const LitTile::Pixel& pixel) { planes_.sun[pixel.at] &= uint8_t(~bits); };
        LightRay rays[kTilePixels];
        const LitTile::Pixel* from[kTilePixels];
        float distances[kTilePixels];
        for (const auto& each : lit_) {
            size_t count = 0;
            for (size_t k = 0; k < tile.count; ++k) {
                const LitTile::Pixel& pixel = tile.pixels[k];
                if (!(glm::dot(pixel.normal, light) > 0) && !isFar(pixel.at))
                    darken(pixel);
                else if (isMarking_ || (planes_.sun[pixel.at] & bits) != 0) {
                    rays[count] = lightRay(*each, pixel, light, frame::kNoHit);
                    from[count++] = &pixel;
                }
            }
            castLightRays(each->layer.scene, {rays, count}, distances, each->tiles.lightMarks());
            for (size_t k = 0; k < count; ++k)
                if (distances[k] < kNoDepth) darken(*from[k]);
        }
    }

    /// Returns where a ray of light through a surface begins. From a surface it begins as the shaders have it.
    [[nodiscard]] SurfaceCaster::Start startOf(const SurfaceCaster& caster, const LitTile::Pixel& from) const {
        return {from.pixel, picture_.depth[from.at], from.normal,
                from.onSurface ? caster.surface().view.shadowLift : planes_.lift[from.at], planes_.edge[from.at]};
    }

    void castSun(SurfaceCaster& caster, const LitTile& tile, uint32_t number, SurfaceWork& work) {
        const glm::vec3 light(lightNumbered(frame_, number));
        const uint8_t bits = bitsOfLight(frame_, number);
        for (size_t k = 0; k < tile.count; ++k) {
            const LitTile::Pixel& from = tile.pixels[k];
            if ((planes_.sun[from.at] & bits) == 0) continue;
            const float kFar = frame::kMesoNoHit;
            if (caster.castLight(startOf(caster, from), light, kFar, true, work) < kFar)
                planes_.sun[from.at] &= uint8_t(~bits);
        }
    }

    void castSky(const LitTile& tile, std::span<SurfaceCaster> casters, SurfaceWork& work) {
        glm::vec3 directions[kAtOnce * kTilePixels];
        float near[kAtOnce * kTilePixels], seen[kTilePixels] = {};
        for (uint32_t first = 0; first < frame_.occlusionRays; first += kAtOnce) {
            const uint32_t numbers = std::min(kAtOnce, frame_.occlusionRays - first);
            for (uint32_t n = 0; n < numbers; ++n)
                for (size_t k = 0; k < tile.count; ++k) {
                    const LitTile::Pixel& from = tile.pixels[k];
                    directions[n * tile.count + k] = directions_(from.normal, first + n, from.pixel);
                }
            std::fill_n(near, numbers * tile.count, reach_);
            for (const auto& each : lit_) castNearer(*each, tile, {directions, numbers * tile.count}, near);
            for (SurfaceCaster& caster : casters)
                for (size_t i = 0; i < numbers * tile.count; ++i)
                    near[i] = caster.castLight(startOf(caster, tile.pixels[i % tile.count]), directions[i], near[i],
                                               false, work);
            for (size_t i = 0; i < numbers * tile.count; ++i)
                seen[i % tile.count] += near[i] < reach_ ? f32::skyBehind(near[i] / reach_) : 1.0f;
        }
        for (size_t k = 0; k < tile.count; ++k)
            planes_.sky[tile.pixels[k].at] = unormByte(seen[k] / float(frame_.occlusionRays));
    }

    /// Casts rays through a layer; those of one number, over the tile, are side by side. `near`: how far each comes,
    /// world units.
    void castNearer(const Lit& each, const LitTile& tile, std::span<const glm::vec3> directions, float* near) const {
        LightRay rays[kAtOnce * kTilePixels];
        float distances[kAtOnce * kTilePixels];
        for (size_t i = 0; i < directions.size(); ++i)
            rays[i] = lightRay(each, tile.pixels[i % tile.count], directions[i], isMarking_ ? reach_ : near[i]);
        castLightRays(each.layer.scene, {rays, directions.size()}, distances, each.tiles.lightMarks());
        for (size_t i = 0; i < directions.size(); ++i)
            near[i] = std::min(near[i], float(double(distances[i]) * each.cell));
    }

    /// Shows how long the rays of a tile marched, of those that hit nothing, too.
    void showIterations(glm::ivec2 corner) {
        forEachPixel(picture_.size, corner, [&](glm::ivec2 pixel, int) {
            const uint32_t iterations = picture_.iterations[at(pixel)];
            const float part = std::min(float(iterations) / frame::kMesoHottest, 1.0f);
            if (iterations > 0) picture_.colours[at(pixel)] = packedColour(glm::vec4(f32::heat(part), 1));
        });
    }

    void shade(glm::ivec2 corner, bool averagesSky) {
        const LitTile tile = hitsOf(corner);
        if (tile.count == 0) return;
        TileSurface surface{};
        std::vector<PixelChannels> channels;
        for (size_t k = 0; k < tile.count; ++k) {
            const auto& [pixel, from, normal, onSurface] = tile.pixels[k];
            surface.normalX[k] = normal.x, surface.normalY[k] = normal.y, surface.normalZ[k] = normal.z;
            setAlbedo(surface, int(k), glm::vec4(planes_.albedo[from], 1));
            surface.sun[k] = float(planes_.sun[from]) / 255;
            surface.sky[k] = averagesSky
                                 ? skyAround(picture_.depth, planes_.sky, picture_.size, pixel, 8 * planes_.edge[from])
                                 : 1.0f;
            if (!planes_.channels.empty() && planes_.channels[from])
                channels.push_back({int(k), *planes_.channels[from]});
        }
        alignas(32) uint32_t colours[kTilePixels];
        shadeTile(frame_, surface, colours);
        shadeChannels(frame_, surface, channels, colours);
        for (size_t k = 0; k < tile.count; ++k) {
            const size_t to = tile.pixels[k].at;
            const bool isLit = frame_.shadingMode != frame::kShadeNormals && frame_.shadingMode != frame::kShadeUnlit;
            const LitTile::Pixel& pixel = tile.pixels[k];
            picture_.colours[to] = !isLit                              ? colours[k]
                                   : isFar(to)                         ? farColour(to, pixel.normal, surface.sky[k])
                                   : pixel.onSurface && hasArrived(to) ? transferColour(to, pixel.normal)
                                                                       : colours[k];
        }
    }

    /// Returns the colour of what stands for many points, of a mean normal.
    [[nodiscard]] uint32_t farColour(size_t pixel, glm::vec3 normal, float skySeen) const {
        const FarLook& far = planes_.far[pixel];
        float sun = 0;
        for (uint32_t i = 0; i < frame_.lightCount; ++i)
            if ((planes_.sun[pixel] & bitsOfLight(frame_, i)) != 0)
                sun += frame::kMesoSun * lightNumbered(frame_, i).w * far.light[int(i)];
        const glm::vec3 light =
            frame_.hasEnvironment != 0
                ? f32::lightInEnvironment(f32::environmentLight(normal, frame_.environment), sun, skySeen)
                : glm::vec3(f32::lightUnderSky(far.sky, sun, skySeen));
        return packedColour(glm::vec4(planes_.albedo[pixel] * light, 1));
    }

    [[nodiscard]] bool hasArrived(size_t pixel) const {
        return !planes_.arrives.empty() && planes_.arrives[pixel] != 0;
    }

    /// Returns the colour of a hit that knows what comes from everywhere; occlusion is part of that.
    [[nodiscard]] uint32_t transferColour(size_t pixel, glm::vec3 normal) const {
        float sun = 0;
        for (uint32_t i = 0; i < frame_.lightCount; ++i)
            if ((planes_.sun[pixel] & bitsOfLight(frame_, i)) != 0) {
                const glm::vec4 from = lightNumbered(frame_, i);
                sun += from.w * f32::sunlightOf(normal, glm::vec3(from), 1.0f);
            }
        const glm::vec3 light = f32::lightInEnvironment(f32::unpackedLight(planes_.arrives[pixel]), sun, 1.0f);
        return packedColour(glm::vec4(planes_.albedo[pixel] * light, 1));
    }

    HostPicture& picture_;
    const std::span<const HostSurface> surfaces_;
    const LitLayers lit_;
    LitPlanes planes_;
    const frame::FrameConstants frame_;  // in the world's axes
    const SkyDirections directions_{frame_};
    const float reach_;  // of occlusion, world units
    std::atomic<uint64_t> unresolvedRays_ = 0, farHits_ = 0;
    bool isMarking_ = false;
};

}  // namespace

Result<void> drawLitScene(const LitScene& scene, const HostCastOptions& options, HostPicture& picture) {
    return LitDrawing(scene, picture).draw(options);
}

}  // namespace vcp
