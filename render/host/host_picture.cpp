#include "render/host/host_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/packing.hpp>

#include "render/host/hit_light.h"
#include "render/host/hit_surface.h"
#include "render/host/light_rays.h"
#include "render/host/section_caps.h"
#include "render/host/tile_shading.h"

namespace vcp {

namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

/// What is kept of each pixel until the sky that its neighbours see is known.
struct SkyPlanes {
    explicit SkyPlanes(size_t pixels)
        : depth(pixels, kNothing), normals(pixels), albedo(pixels), sun(pixels), sky(pixels), hits(pixels) {}

    std::vector<float> depth;  // finest cells
    std::vector<glm::vec3> normals;
    std::vector<uint32_t> albedo;  // RGBA8
    std::vector<uint8_t> sun, sky;
    std::vector<HostHit> hits;
};

uint8_t toByte(float x) { return uint8_t(std::lround(255 * x)); }

class LayerDrawing {
public:
    LayerDrawing(const HostLayer& layer, HostPicture& picture)
        : layer_(layer),
          frame_(layer.frame),
          picture_(picture),
          isColoured_(layer.hasColour &&
                      (frame_.shadingMode == frame::kShadeLit || frame_.shadingMode == frame::kShadeUnlit)),
          turn_(frame_.rotation.w, frame_.rotation.x, frame_.rotation.y, frame_.rotation.z),
          sections_(inCells(layer.rays.sections, layer.scene.grid().origin, layer.scene.grid().cell)) {}

    Result<void> draw(const HostCastOptions& options) {
        const bool averagesSky = frame_.occlusionRays > 0;
        if (averagesSky) planes_.emplace(picture_.colours.size());
        const PictureRays& rays = layer_.rays;
        const bool beginInEye =
            sections_.empty() && rays.originPerX == glm::dvec3(0) && rays.originPerY == glm::dvec3(0);
        if (layer_.marks != nullptr && beginInEye) markBegin({0, 0});
        VCP_TRY(forEachTile(picture_.size, options, [&](glm::ivec2 corner) {
            TileHits hits;
            hits.corner = corner;
            castTile(layer_.scene, layer_.rays, hits);
            if (layer_.caps != Caps::None) castCaps(layer_.scene, layer_.rays, layer_.caps, hits, cameraMarks());
            if (layer_.marks != nullptr) markPages(hits, !beginInEye);
            if (hits.any) drawTile(hits);
        }));
        if (!averagesSky) return {};
        return forEachTile(picture_.size, options, [&](glm::ivec2 corner) { drawKeptTile(corner); });
    }

private:
    [[nodiscard]] size_t at(glm::ivec2 pixel) const {
        return size_t(pixel.y) * size_t(picture_.size.x) + size_t(pixel.x);
    }

    /// Calls visit(pixel of the picture, element of the tile's arrays) for each pixel of a tile in the picture.
    template <class Visit>
    void forEachPixel(glm::ivec2 corner, const Visit& visit) const {
        const glm::ivec2 size = glm::min(picture_.size - corner, glm::ivec2(kTileWidth, kTileHeight));
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) visit(corner + glm::ivec2(x, y), y * kTileWidth + x);
    }
    template <class Visit>
    void forEachHit(const TileHits& hits, const Visit& visit) const {
        forEachPixel(hits.corner, [&](glm::ivec2 pixel, int i) {
            if (hits.depth[i] < kNothing) visit(pixel, i);
        });
    }

    [[nodiscard]] float depthInCells(float depth) const { return float(double(depth) / layer_.scene.grid().cell); }
    /// A pixel's edge at a depth; both in finest cells.
    [[nodiscard]] float pixelEdgeAt(float depth) const { return frame_.pixelEdge + frame_.pixelEdgePerDepth * depth; }

    [[nodiscard]] PageMarks* cameraMarks() const { return layer_.marks != nullptr ? &layer_.marks->byCamera : nullptr; }
    [[nodiscard]] PageMarks* lightMarks() const { return layer_.marks != nullptr ? &layer_.marks->byLight : nullptr; }

    /// A pixel's ray, in finest cells from the root's lowest corner.
    struct CellRay {
        glm::dvec3 origin, direction;
    };
    [[nodiscard]] CellRay rayOf(glm::ivec2 pixel) const {
        const HostGrid& grid = layer_.scene.grid();
        const glm::dvec2 at = glm::dvec2(pixel) + 0.5;
        return {(layer_.rays.originAt(at.x, at.y) - grid.origin) / grid.cell,
                glm::normalize(layer_.rays.directionAt(at.x, at.y))};
    }

    /// Marks the page that a pixel's ray begins in: it may miss it and hit what is below.
    void markBegin(glm::ivec2 pixel) const {
        const CellRay ray = rayOf(pixel);
        const KeptInterval kept = keptInterval(sections_, ray.origin, ray.direction);
        if (!(kept.first < kept.last)) return;
        const auto page = layer_.scene.pageAt(ray.origin + kept.first * ray.direction);
        if (page) layer_.marks->byCamera.mark(*page);
    }

    /// Marks the pages that a tile's rays hit, and with `begins` those that they begin in.
    void markPages(const TileHits& hits, bool begins) const {
        if (hits.any)
            for (const HitLeaf& leaf : hits.leaves) layer_.marks->byCamera.mark(leaf.page);
        if (begins) forEachPixel(hits.corner, [&](glm::ivec2 pixel, int) { markBegin(pixel); });
    }

    void drawTile(const TileHits& hits) {
        TileSurface surface;
        findNormals(layer_.rays, hits, surface);
        alignas(32) uint32_t colours[kTilePixels];
        if (frame_.shadingMode >= frame::kShadeSteps) {
            forEachHit(hits, [&](glm::ivec2, int i) { colours[i] = falseColour(hits, i); });
            return put(hits, surface, colours);
        }
        std::fill_n(surface.sun, kTilePixels, 1.0f);
        std::fill_n(surface.sky, kTilePixels, 1.0f);
        if (frame_.hasShadows != 0) castSun(hits, surface);
        if (planes_) {
            castSky(hits, surface);
            return keep(hits, surface);
        }
        findAlbedo(hits, surface);
        shadeTile(frame_, surface, colours);
        put(hits, surface, colours);
    }

    [[nodiscard]] uint32_t falseColour(const TileHits& hits, int i) const {
        const HostScene::Page& page = layer_.scene.page(hits.leaves[hits.leaf[i]].page);
        const float shown = frame_.shadingMode == frame::kShadeLevel
                                ? float(layer_.scene.levelOf(page)) / std::max(float(frame_.finestLevel), 1.0f)
                                : page.error / std::max(pixelEdgeAt(depthInCells(hits.depth[i])), 1e-30f);
        return glm::packUnorm4x8(glm::vec4(f32::heat(shown), 1));
    }

    void findAlbedo(const TileHits& hits, TileSurface& surface) const {
        setClay(surface);
        if (!isColoured_ && hits.onCap.none()) return;
        forEachHit(hits, [&](glm::ivec2, int i) {
            // Colours have 8 bits between the passes of a device, too.
            if (hits.onCap[size_t(i)])
                setAlbedo(surface, i, frame_.cap);
            else if (isColoured_)
                setAlbedo(surface, i, glm::unpackUnorm4x8(glm::packUnorm4x8(colourAt(layer_.scene, hits, i))));
        });
    }

    void setClay(TileSurface& surface) const {
        std::fill_n(surface.red, kTilePixels, frame_.clay.x);
        std::fill_n(surface.green, kTilePixels, frame_.clay.y);
        std::fill_n(surface.blue, kTilePixels, frame_.clay.z);
    }
    static void setAlbedo(TileSurface& surface, int i, glm::vec4 colour) {
        surface.red[i] = colour.x;
        surface.green[i] = colour.y;
        surface.blue[i] = colour.z;
    }

    /// Returns where rays of light begin: above the hit by more than the picture's own error and the roundings.
    [[nodiscard]] glm::dvec3 lifted(const TileHits& hits, const TileSurface& surface, glm::ivec2 pixel, int i) const {
        const CellRay ray = rayOf(pixel);
        const float lift = 0.15f + frame_.lightLift * pixelEdgeAt(depthInCells(hits.depth[i]));
        return ray.origin + double(hits.depth[i]) / layer_.scene.grid().cell * ray.direction +
               glm::dvec3(lift * surface.normal(i));
    }

    /// Returns a ray of light, no farther than section planes leave it.
    [[nodiscard]] LightRay lightRay(glm::dvec3 origin, glm::vec3 direction, float reach) const {
        if (!sections_.empty()) reach = std::min(reach, float(keptInterval(sections_, origin, direction).last));
        return {origin, direction, reach};
    }

    void castSun(const TileHits& hits, TileSurface& surface) const {
        const glm::vec3 light(frame_.lightDirection);
        LightRay rays[kTilePixels];
        int pixels[kTilePixels];
        size_t count = 0;
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            if (!(glm::dot(surface.normal(i), light) > 0)) return void(surface.sun[i] = 0);
            rays[count] = lightRay(lifted(hits, surface, pixel, i), light, frame::kNoHit);
            pixels[count++] = i;
        });
        float distances[kTilePixels];
        castLightRays(layer_.scene, {rays, count}, distances, lightMarks());
        for (size_t k = 0; k < count; ++k) surface.sun[pixels[k]] = distances[k] < kNothing ? 0.0f : 1.0f;
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
                    const glm::vec3 direction = f32::skyDirection(surface.normal(i), number, sky, uint32_t(pixel.x),
                                                                  uint32_t(pixel.y), frame_.sampleNumber);
                    rays[count++] = lightRay(origins[i], direction, reach);
                });
            castLightRays(layer_.scene, {rays, count}, distances, lightMarks());
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
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            const size_t to = at(pixel);
            planes_->depth[to] = depthInCells(hits.depth[i]);
            planes_->normals[to] = surface.normal(i);
            if (isColoured_) planes_->albedo[to] = glm::packUnorm4x8(colourAt(layer_.scene, hits, i));
            planes_->sun[to] = toByte(surface.sun[i]);
            planes_->sky[to] = toByte(surface.sky[i]);
            planes_->hits[to] = hitOf(hits, i);
        });
    }

    void drawKeptTile(glm::ivec2 corner) {
        TileSurface surface{};
        setClay(surface);
        TileHits hits;
        hits.corner = corner;
        std::fill_n(hits.depth, kTilePixels, kNothing);
        forEachPixel(corner, [&](glm::ivec2 pixel, int i) {
            const size_t from = at(pixel);
            if (!(planes_->depth[from] < kNothing)) return;
            hits.any = true;
            hits.depth[i] = float(double(planes_->depth[from]) * layer_.scene.grid().cell);
            const glm::vec3 normal = planes_->normals[from];
            surface.normalX[i] = normal.x, surface.normalY[i] = normal.y, surface.normalZ[i] = normal.z;
            if (planes_->hits[from].onCap != 0)
                setAlbedo(surface, i, frame_.cap);
            else if (isColoured_)
                setAlbedo(surface, i, glm::unpackUnorm4x8(planes_->albedo[from]));
            surface.sun[i] = float(planes_->sun[from]) / 255;
            surface.sky[i] = skyAbout(pixel);
        });
        if (!hits.any) return;
        alignas(32) uint32_t colours[kTilePixels];
        shadeTile(frame_, surface, colours);
        put(hits, surface, colours);
    }

    /// Returns how much sky is seen, averaged over the pixels around that show the same surface: each pixel of a square
    /// of 4 x 4 has its own directions.
    [[nodiscard]] float skyAbout(glm::ivec2 pixel) const {
        const float depth = planes_->depth[at(pixel)], reach = 8 * pixelEdgeAt(depth);
        float sum = 0, count = 0;
        for (int i = 0; i < 16; ++i) {
            const glm::ivec2 p =
                glm::clamp(pixel + glm::ivec2((i & 3) - 1, (i >> 2) - 1), glm::ivec2(0), picture_.size - 1);
            if (!(std::abs(planes_->depth[at(p)] - depth) <= reach)) continue;
            sum += float(planes_->sky[at(p)]) / 255;
            ++count;
        }
        return sum / std::max(count, 1.0f);
    }

    [[nodiscard]] HostHit hitOf(const TileHits& hits, int i) const {
        return {layer_.number, hits.leaves[hits.leaf[i]].page & INT32_MAX, hits.onCap[size_t(i)]};
    }

    /// Puts a tile's hits into the picture, where they are nearer than what is there.
    void put(const TileHits& hits, const TileSurface& surface, const uint32_t* colours) {
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            const size_t to = at(pixel);
            const auto depth = float(double(hits.depth[i]) * layer_.worldPerUnit);
            if (!(depth < picture_.depth[to])) return;
            picture_.depth[to] = depth;
            picture_.colours[to] = colours[i];
            picture_.normals[to] = turn_ * surface.normal(i);
            picture_.hits[to] = planes_ ? planes_->hits[to] : hitOf(hits, i);
        });
    }

    const HostLayer& layer_;
    const frame::FrameConstants& frame_;
    HostPicture& picture_;
    const bool isColoured_;                   // hits are shown in their own colours
    const glm::quat turn_;                    // from the dataset's axes to the world's
    const std::vector<SectionCut> sections_;  // finest cells from the root's lowest corner
    std::optional<SkyPlanes> planes_;
};

}  // namespace

HostPicture::HostPicture(glm::ivec2 pictureSize, std::span<const uint32_t> background)
    : size(pictureSize),
      colours(size_t(size.x) * size_t(size.y)),
      depth(colours.size(), kNothing),
      normals(colours.size(), glm::vec3(0)),
      hits(colours.size()) {
    for (size_t y = 0; y < size_t(size.y); ++y)
        std::fill_n(colours.begin() + std::ptrdiff_t(y * size_t(size.x)), size.x, background[y]);
}

void SampledLight::add(std::span<const uint32_t> colours, size_t first) {
    static const std::array<float, 256> kLight = [] {
        std::array<float, 256> light;
        for (size_t i = 0; i < light.size(); ++i) light[i] = f32::lightOfColour(glm::vec3(float(i) / 255)).x;
        return light;
    }();
    for (size_t i = 0; i < colours.size(); ++i) {
        const uint32_t c = colours[i];
        const float alpha = float(c >> 24) / 255;
        sums_[first + i] +=
            glm::vec4(glm::vec3(kLight[c & 255], kLight[c >> 8 & 255], kLight[c >> 16 & 255]) * alpha, alpha);
    }
    if (first + colours.size() == sums_.size()) ++samples_;
}

std::vector<uint32_t> SampledLight::mean() const {
    std::vector<uint32_t> colours(sums_.size());
    std::ranges::transform(sums_, colours.begin(), [this](const glm::vec4& sum) {
        const glm::vec3 light = glm::vec3(sum) / std::max(sum.w, 1.0f);
        return glm::packUnorm4x8(glm::vec4(f32::colourOfLight(light), sum.w / float(samples_)));
    });
    return colours;
}

Result<void> drawLayer(const HostLayer& layer, const HostCastOptions& options, HostPicture& picture) {
    return LayerDrawing(layer, picture).draw(options);
}

}  // namespace vcp
