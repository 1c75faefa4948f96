#include "render/host/layer_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/packing.hpp>

#include "render/host/hit_light.h"
#include "render/host/hit_surface.h"
#include "render/host/section_caps.h"
#include "render/host/slab_blend.h"
#include "render/host/tile_colours.h"

namespace vcp {

void setAlbedo(TileSurface& surface, int i, glm::vec4 colour) {
    surface.red[i] = colour.x;
    surface.green[i] = colour.y;
    surface.blue[i] = colour.z;
}

float skyAround(std::span<const float> depth, std::span<const uint8_t> sky, glm::ivec2 size, glm::ivec2 pixel,
                float reach) {
    const auto at = [&](glm::ivec2 p) { return size_t(p.y) * size_t(size.x) + size_t(p.x); };
    float sum = 0, count = 0;
    for (int i = 0; i < 16; ++i) {
        const glm::ivec2 p = glm::clamp(pixel + glm::ivec2((i & 3) - 1, (i >> 2) - 1), glm::ivec2(0), size - 1);
        if (!(std::abs(depth[at(p)] - depth[at(pixel)]) <= reach)) continue;
        sum += float(sky[at(p)]) / 255;
        ++count;
    }
    return sum / std::max(count, 1.0f);
}

PixelBox pixelsOf(const HostScene& scene, const PictureRays& rays, glm::ivec2 size) {
    // A point is origin + t direction + x (its step a pixel) + y (its step): of a pinhole with steps of the direction,
    // which grow by t, else with steps of the origin.
    const bool isParallel = rays.directionPerX == glm::dvec3(0) && rays.directionPerY == glm::dvec3(0);
    const glm::dmat3 steps(isParallel ? rays.originPerX : rays.directionPerX,
                           isParallel ? rays.originPerY : rays.directionPerY, rays.direction);
    if (glm::determinant(steps) == 0) return {{0, 0}, size};
    const glm::dmat3 toPixels = glm::inverse(steps);
    constexpr double kMargin = 2;  // pixels: lines of cuts, and rounding
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    for (uint32_t i = 0; i < scene.pages(); ++i) {
        const HostScene::Page& page = scene.page(i);
        const double cell = scene.grid().cell, edge = std::ldexp(cell, int(scene.grid().log2Cells + page.cellBits));
        const glm::dvec3 lowest =
            scene.grid().origin + glm::dvec3(page.corner) * std::ldexp(cell, -int(kMaxSubcellDepth)) - rays.origin;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 at = toPixels * (lowest + edge * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2));
            // What reaches behind the eye, or to it, may be seen anywhere.
            if (!isParallel && !(at.z > 1e-9 * edge)) return {{0, 0}, size};
            const glm::dvec2 pixel = isParallel ? glm::dvec2(at) : glm::dvec2(at) / at.z;
            low = glm::min(low, pixel);
            high = glm::max(high, pixel);
        }
    }
    const glm::dvec2 largest(size);
    return {glm::ivec2(glm::clamp(glm::floor(low - kMargin), glm::dvec2(0), largest)),
            glm::ivec2(glm::clamp(glm::ceil(high + kMargin), glm::dvec2(0), largest))};
}

LayerTiles::LayerTiles(const HostLayer& layer, glm::ivec2 size)
    : layer_(layer),
      size_(size),
      isColoured_(layer.hasColour &&
                  (layer.frame.shadingMode == frame::kShadeLit || layer.frame.shadingMode == frame::kShadeUnlit)),
      hasChannels_(layer.hasColour && layer.hasChannels && layer.frame.shadingMode == frame::kShadeLit &&
                   layer.scene.images() != nullptr && layer.scene.images()->hasChannels()),
      turn_(layer.frame.rotation.w, layer.frame.rotation.x, layer.frame.rotation.y, layer.frame.rotation.z),
      sections_(inCells(layer.rays.sections, layer.scene.grid().origin, layer.scene.grid().cell)),
      beginInEye_(sections_.empty() && layer.rays.originPerX == glm::dvec3(0) &&
                  layer.rays.originPerY == glm::dvec3(0)),
      pixels_(pixelsOf(layer.scene, layer.rays, size)) {
    if (layer_.marks != nullptr && beginInEye_) markBegin({0, 0});
}

void LayerTiles::cast(TileHits& hits) const {
    // Most of many datasets are elsewhere in the picture.
    if (!pixels_.meets(hits.corner)) return;
    castTile(layer_.scene, layer_.rays, hits);
    if (layer_.caps != Caps::None) castCaps(layer_.scene, layer_.rays, layer_.caps, hits, cameraMarks());
    blendSlabs(layer_.scene, {layer_.frame.pixelEdge, layer_.frame.pixelEdgePerDepth}, hits);
    if (layer_.marks != nullptr) markPages(hits);
    if (layer_.frame.opacity < 1) fade(hits);
}

/// Leaves out hits of a dataset that is not there in all samples.
void LayerTiles::fade(TileHits& hits) const {
    forEachPixel(size_, hits.corner, [&](glm::ivec2 pixel, int i) {
        if (f32::isFaded(layer_.frame.opacity, uint32_t(pixel.x), uint32_t(pixel.y), layer_.frame.sampleNumber))
            hits.depth[i] = std::numeric_limits<float>::infinity();
    });
}

LayerTiles::CellRay LayerTiles::rayOf(glm::ivec2 pixel) const {
    const HostGrid& grid = layer_.scene.grid();
    const glm::dvec2 at = glm::dvec2(pixel) + 0.5;
    return {(layer_.rays.originAt(at.x, at.y) - grid.origin) / grid.cell,
            glm::normalize(layer_.rays.directionAt(at.x, at.y))};
}

void LayerTiles::markBegin(glm::ivec2 pixel) const {
    const CellRay ray = rayOf(pixel);
    const KeptInterval kept = keptInterval(sections_, ray.origin, ray.direction);
    if (!(kept.first < kept.last)) return;
    const auto page = layer_.scene.pageAt(ray.origin + kept.first * ray.direction);
    if (page) layer_.marks->byCamera.mark(*page);
}

/// Marks the pages that a tile's rays hit, and those that they begin in where these are not the same for all.
void LayerTiles::markPages(const TileHits& hits) const {
    if (hits.any)
        for (const HitLeaf& leaf : hits.leaves) layer_.marks->byCamera.mark(leaf.page);
    if (!beginInEye_) forEachPixel(size_, hits.corner, [&](glm::ivec2 pixel, int) { markBegin(pixel); });
}

void LayerTiles::findAlbedo(const TileHits& hits, TileSurface& surface) const {
    setClay(surface);
    if (!isColoured_ && hits.onCap.none()) return;
    uint32_t colours[kTilePixels];
    if (isColoured_) findOwnColours(hits, colours);
    forEachPixel(size_, hits.corner, [&](glm::ivec2, int i) {
        if (!std::isfinite(hits.depth[i])) return;
        // Colours have 8 bits between the passes of a device, too.
        if (hits.onCap[size_t(i)])
            setAlbedo(surface, i, layer_.frame.cap);
        else if (isColoured_)
            setAlbedo(surface, i, glm::unpackUnorm4x8(colours[i]));
    });
}

void LayerTiles::findOwnColours(const TileHits& hits, uint32_t (&colours)[kTilePixels]) const {
    findColours(layer_.scene, layer_.rays, pixelEdges(), hits, colours);
}

std::vector<PixelChannels> LayerTiles::findChannels(const TileHits& hits, const TileSurface& surface) const {
    if (!hasChannels_) return {};
    return vcp::findChannels(layer_.scene, layer_.rays, pixelEdges(), hits, surface);
}

PixelEdges LayerTiles::pixelEdges() const {
    return {layer_.frame.pixelEdge, float(double(layer_.frame.pixelEdgePerDepth) / layer_.scene.grid().cell)};
}

void LayerTiles::setClay(TileSurface& surface) const {
    std::fill_n(surface.red, kTilePixels, layer_.frame.clay.x);
    std::fill_n(surface.green, kTilePixels, layer_.frame.clay.y);
    std::fill_n(surface.blue, kTilePixels, layer_.frame.clay.z);
}

HitLine LayerTiles::lineOf(const TileHits& hits, glm::ivec2 pixel, int i) const {
    return lineAt(layer_.scene, hits, i, glm::vec3(rayOf(pixel).direction), pixelEdgeAt(depthInCells(hits.depth[i])));
}

HostHit LayerTiles::hitOf(const TileHits& hits, int i) const {
    return {layer_.number, hits.leaves[hits.leaf[i]].page & INT32_MAX, hits.onCap[size_t(i)]};
}

glm::dvec3 LayerTiles::above(glm::ivec2 pixel, double depth, float lift, glm::vec3 normal) const {
    const CellRay ray = rayOf(pixel);
    return ray.origin + depth * ray.direction + glm::dvec3(lift * normal);
}

LightRay LayerTiles::lightRay(glm::dvec3 origin, glm::vec3 direction, float reach) const {
    if (!sections_.empty()) reach = std::min(reach, float(keptInterval(sections_, origin, direction).last));
    return {origin, direction, reach};
}

}  // namespace vcp
