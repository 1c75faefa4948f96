#include "render/host/host_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "render/host/hit_light.h"
#include "render/host/hit_surface.h"
#include "render/host/layer_tiles.h"

namespace vcp {

namespace {

/// What is kept of each pixel until the sky that its neighbours see is known.
struct SkyPlanes {
    explicit SkyPlanes(size_t pixels)
        : depth(pixels, kNoDepth), normals(pixels), albedo(pixels), sun(pixels), sky(pixels), hits(pixels) {}

    std::vector<float> depth;  // finest cells
    std::vector<glm::vec3> normals;
    std::vector<uint32_t> albedo;  // RGBA8
    std::vector<uint8_t> sun, sky;
    std::vector<HostHit> hits;
    std::vector<std::vector<PixelChannels>> channels;  // of each tile, row by row; empty where none are shown
};

class LayerDrawing {
public:
    LayerDrawing(const HostLayer& layer, HostPicture& picture)
        : layer_(layer), frame_(layer.frame), picture_(picture), tiles_(layer, picture.size) {}

    Result<void> draw(const HostCastOptions& options) {
        const bool averagesSky = frame_.occlusionRays > 0;
        if (averagesSky) planes_.emplace(picture_.colours.size());
        if (averagesSky && tiles_.hasChannels())
            planes_->channels.resize(tileOf(picture_.size + glm::ivec2(kTileWidth, kTileHeight)));
        VCP_TRY(forEachTile(picture_.size, options, [&](glm::ivec2 corner) {
            TileHits hits;
            hits.corner = corner;
            if (showsWork()) hits.work.emplace();
            tiles_.cast(hits);
            if (hits.any) drawTile(hits);
            if (showsWork()) drawWork(hits);
        }));
        if (!averagesSky) return {};
        return forEachTile(picture_.size, options, [&](glm::ivec2 corner) { drawKeptTile(corner); });
    }

private:
    [[nodiscard]] size_t at(glm::ivec2 pixel) const {
        return size_t(pixel.y) * size_t(picture_.size.x) + size_t(pixel.x);
    }

    /// Returns the number of the tile that has a pixel.
    [[nodiscard]] size_t tileOf(glm::ivec2 pixel) const {
        const int across = (picture_.size.x + kTileWidth - 1) / kTileWidth;
        return size_t(pixel.y / kTileHeight) * size_t(across) + size_t(pixel.x / kTileWidth);
    }

    [[nodiscard]] bool showsWork() const { return !picture_.work.empty(); }

    template <class Visit>
    void forEachHit(const TileHits& hits, const Visit& visit) const {
        forEachPixel(picture_.size, hits.corner, [&](glm::ivec2 pixel, int i) {
            if (hits.depth[i] < kNoDepth) visit(pixel, i);
        });
    }

    void drawTile(const TileHits& hits) {
        TileSurface surface;
        findNormals(layer_.rays, hits, surface);
        alignas(32) uint32_t colours[kTilePixels];
        if (showsWork()) {
            std::fill_n(colours, kTilePixels, 0u);  // drawWork gives them
            return put(hits, surface, colours);
        }
        if (frame_.shadingMode == frame::kShadeLevel || frame_.shadingMode == frame::kShadeError) {
            forEachHit(hits, [&](glm::ivec2, int i) { colours[i] = falseColour(hits, i); });
            return put(hits, surface, colours);
        }
        std::fill_n(surface.sun, kTilePixels, 1.0f);
        std::fill_n(surface.sky, kTilePixels, 1.0f);
        for (uint32_t i = 0; frame_.hasShadows != 0 && i < frame_.lightCount; ++i) castSun(hits, surface, i);
        if (planes_) {
            castSky(hits, surface);
            return keep(hits, surface);
        }
        tiles_.findAlbedo(hits, surface);
        shadeTile(frame_, surface, colours);
        if (tiles_.hasChannels()) shadeChannels(frame_, surface, tiles_.findChannels(hits, surface), colours);
        if (frame_.shadingMode == frame::kShadeWireframe)
            forEachHit(hits, [&](glm::ivec2 pixel, int i) {
                if (!hits.onCap[size_t(i)]) colours[i] = withLine(colours[i], tiles_.lineOf(hits, pixel, i));
            });
        put(hits, surface, colours);
    }

    /// Adds the work of a tile's rays to the picture's, and shows it of all rays that visited something.
    void drawWork(const TileHits& hits) {
        const TileWork& done = *hits.work;
        const uint32_t mode = frame_.shadingMode;
        const uint32_t* const shown = mode == frame::kShadeSteps   ? done.steps
                                      : mode == frame::kShadeCells ? done.cells
                                                                   : done.fetches;
        const float most = mostShown(mode);
        forEachPixel(picture_.size, hits.corner, [&](glm::ivec2 pixel, int i) {
            if (done.steps[i] == 0) return;
            uint32_t& work = picture_.work[at(pixel)];
            work += shown[i];
            picture_.colours[at(pixel)] = packedColour(glm::vec4(f32::heat(float(work) / most), 1));
        });
    }

    [[nodiscard]] uint32_t falseColour(const TileHits& hits, int i) const {
        const HostScene::Page& page = layer_.scene.page(hits.leaves[hits.leaf[i]].page);
        const float edge = tiles_.pixelEdgeAt(tiles_.depthInCells(hits.depth[i]));
        const float shown = frame_.shadingMode == frame::kShadeLevel
                                ? float(layer_.scene.levelOf(page)) / std::max(float(frame_.finestLevel), 1.0f)
                                : page.error / std::max(edge, 1e-30f);
        return packedColour(glm::vec4(f32::heat(shown), 1));
    }

    /// Returns where rays of light begin.
    [[nodiscard]] glm::dvec3 lifted(const TileHits& hits, const TileSurface& surface, glm::ivec2 pixel, int i) const {
        const float lift = tiles_.liftAt(tiles_.depthInCells(hits.depth[i]));
        return tiles_.above(pixel, double(hits.depth[i]) / layer_.scene.grid().cell, lift, surface.normal(i));
    }

    void castSun(const TileHits& hits, TileSurface& surface, uint32_t number) const {
        const glm::vec3 light(lightNumbered(frame_, number));
        const auto darken = [&, bits = bitsOfLight(frame_, number)](int i) {
            surface.sun[i] = float(unormByte(surface.sun[i]) & ~bits) / 255;
        };
        LightRay rays[kTilePixels];
        int pixels[kTilePixels];
        size_t count = 0;
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            if (!(glm::dot(surface.normal(i), light) > 0)) return darken(i);
            rays[count] = tiles_.lightRay(lifted(hits, surface, pixel, i), light, frame::kNoHit);
            pixels[count++] = i;
        });
        float distances[kTilePixels];
        castLightRays(layer_.scene, {rays, count}, distances, tiles_.lightMarks());
        for (size_t k = 0; k < count; ++k)
            if (distances[k] < kNoDepth) darken(pixels[k]);
    }

    void castSky(const TileHits& hits, TileSurface& surface) const {
        const float reach = frame_.occlusionReach;
        const uint32_t sky = frame_.occlusionRays;
        glm::dvec3 origins[kTilePixels];
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            origins[i] = lifted(hits, surface, pixel, i);
            surface.sky[i] = 0;
        });
        // The rays of one number, over the tile, begin side by side; several numbers meet the same leaves.
        constexpr uint32_t kAtOnce = 8;
        LightRay rays[kAtOnce * kTilePixels];
        float distances[kAtOnce * kTilePixels];
        for (uint32_t first = 0; first < sky; first += kAtOnce) {
            const uint32_t end = std::min(first + kAtOnce, sky);
            size_t count = 0;
            for (uint32_t number = first; number < end; ++number)
                forEachHit(hits, [&](glm::ivec2 pixel, int i) {
                    const glm::vec3 direction = directions_(surface.normal(i), number, pixel);
                    rays[count++] = tiles_.lightRay(origins[i], direction, reach);
                });
            castLightRays(layer_.scene, {rays, count}, distances, tiles_.lightMarks());
            size_t next = 0;
            for (uint32_t number = first; number < end; ++number)
                forEachHit(hits, [&](glm::ivec2, int i) {
                    const float distance = distances[next++];
                    surface.sky[i] += distance < reach ? f32::skyBehind(distance / reach) : 1.0f;
                });
        }
        for (float& seen : surface.sky) seen /= float(sky);
    }

    void keep(const TileHits& hits, const TileSurface& surface) {
        uint32_t colours[kTilePixels] = {};
        if (tiles_.isColoured()) tiles_.findOwnColours(hits, colours);
        if (tiles_.hasChannels()) planes_->channels[tileOf(hits.corner)] = tiles_.findChannels(hits, surface);
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            const size_t to = at(pixel);
            planes_->depth[to] = tiles_.depthInCells(hits.depth[i]);
            planes_->normals[to] = surface.normal(i);
            if (tiles_.isColoured()) planes_->albedo[to] = colours[i];
            planes_->sun[to] = unormByte(surface.sun[i]);
            planes_->sky[to] = unormByte(surface.sky[i]);
            planes_->hits[to] = tiles_.hitOf(hits, i);
        });
    }

    void drawKeptTile(glm::ivec2 corner) {
        TileSurface surface{};
        tiles_.setClay(surface);
        TileHits hits;
        hits.corner = corner;
        std::fill_n(hits.depth, kTilePixels, kNoDepth);
        forEachPixel(picture_.size, corner, [&](glm::ivec2 pixel, int i) {
            const size_t from = at(pixel);
            if (!(planes_->depth[from] < kNoDepth)) return;
            hits.any = true;
            hits.depth[i] = float(double(planes_->depth[from]) * layer_.scene.grid().cell);
            const glm::vec3 normal = planes_->normals[from];
            surface.normalX[i] = normal.x, surface.normalY[i] = normal.y, surface.normalZ[i] = normal.z;
            if (planes_->hits[from].onCap != 0)
                setAlbedo(surface, i, frame_.cap);
            else if (tiles_.isColoured())
                setAlbedo(surface, i, glm::unpackUnorm4x8(planes_->albedo[from]));
            surface.sun[i] = float(planes_->sun[from]) / 255;
            surface.sky[i] = skyAround(planes_->depth, planes_->sky, picture_.size, pixel,
                                       8 * tiles_.pixelEdgeAt(planes_->depth[from]));
        });
        if (!hits.any) return;
        alignas(32) uint32_t colours[kTilePixels];
        shadeTile(frame_, surface, colours);
        if (tiles_.hasChannels()) shadeChannels(frame_, surface, planes_->channels[tileOf(corner)], colours);
        put(hits, surface, colours);
    }

    /// Puts a tile's hits into the picture, where they are nearer than what is there.
    void put(const TileHits& hits, const TileSurface& surface, const uint32_t* colours) {
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            const size_t to = at(pixel);
            const auto depth = float(double(hits.depth[i]) * layer_.worldPerUnit);
            if (!(depth < picture_.depth[to])) return;
            picture_.depth[to] = depth;
            picture_.colours[to] = colours[i];
            picture_.normals[to] = tiles_.turn() * surface.normal(i);
            picture_.hits[to] = planes_ ? planes_->hits[to] : tiles_.hitOf(hits, i);
        });
    }

    const HostLayer& layer_;
    const frame::FrameConstants& frame_;
    HostPicture& picture_;
    const LayerTiles tiles_;
    const SkyDirections directions_{frame_};
    std::optional<SkyPlanes> planes_;
};

}  // namespace

HostPicture::HostPicture(glm::ivec2 pictureSize, std::span<const uint32_t> background)
    : size(pictureSize),
      colours(size_t(size.x) * size_t(size.y)),
      depth(colours.size(), kNoDepth),
      normals(colours.size(), glm::vec3(0)),
      hits(colours.size()) {
    for (size_t y = 0; y < size_t(size.y); ++y)
        std::fill_n(colours.begin() + std::ptrdiff_t(y * size_t(size.x)), size.x, background[y]);
}

void SampledLight::add(std::span<const uint32_t> colours, size_t first) {
    const std::array<float, 256>& light = lightOfColourBytes();
    for (size_t i = 0; i < colours.size(); ++i) {
        const uint32_t c = colours[i];
        const float alpha = float(c >> 24) / 255;
        sums_[first + i] +=
            glm::vec4(glm::vec3(light[c & 255], light[c >> 8 & 255], light[c >> 16 & 255]) * alpha, alpha);
    }
    if (first + colours.size() == sums_.size()) ++samples_;
}

std::vector<uint32_t> SampledLight::mean() const {
    std::vector<uint32_t> colours(sums_.size());
    std::ranges::transform(sums_, colours.begin(), [this](const glm::vec4& sum) {
        const glm::vec3 light = glm::vec3(sum) / std::max(sum.w, 1.0f);
        return packedColour(glm::vec4(f32::colourOfLight(light), sum.w / float(samples_)));
    });
    return colours;
}

Result<void> drawLayer(const HostLayer& layer, const HostCastOptions& options, HostPicture& picture) {
    return LayerDrawing(layer, picture).draw(options);
}

}  // namespace vcp
