#include "octree/image_needs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "octree/page/page_triangles.h"
#include "octree/surface/image_lookup.h"

namespace vcp {

namespace {

/// Returns what a triangle of an image needs: a footprint there is at least as many texels wide as its pixel is cells,
/// times this. That is the length of the shorter axis, or the part of the longer one that is read at a time. Infinite
/// where rays cannot hit it, or find no footprint: there the coarsest level is read.
float texelsPerCell(const PageView& page, const Index3& corners, glm::vec2 size) {
    const auto p = cornersOf(page, corners);
    const TexturePoint &a = page.points[corners[0]], &b = page.points[corners[1]], &c = page.points[corners[2]];
    const auto from = [&](const TexturePoint& to) {
        return glm::vec2(float(int64_t{to.u} - a.u), float(int64_t{to.v} - a.v)) * float(kTextureUnit);
    };
    const f32::TextureSlope slope = f32::textureSlope(p[0], p[1], p[2], from(b), from(c));
    const glm::vec3 u = size.x * slope.u, v = size.y * slope.v;
    // The singular values of the two slopes.
    const float uu = glm::dot(u, u), vv = glm::dot(v, v), uv = glm::dot(u, v), mean = 0.5f * (uu + vv);
    const float apart = std::sqrt(0.25f * (uu - vv) * (uu - vv) + uv * uv);
    const float texels =
        std::max(std::sqrt(std::max(mean - apart, 0.0f)), std::sqrt(mean + apart) / float(f32::kMostFootprintPlaces));
    const bool hasArea = glm::cross(p[1] - p[0], p[2] - p[0]) != glm::vec3(0);
    return hasArea && texels >= 0 ? texels : std::numeric_limits<float>::infinity();
}

}  // namespace

std::vector<ImageNeed> imageNeeds(const ImageTables& tables, const PageView& page) {
    std::vector<ImageNeed> needs;
    if (page.points.empty()) return needs;
    std::vector<int64_t> placeOf;  // in `needs`, by image
    forEachTriangle(page, [&](const Index3& corners) {
        const uint32_t material = page.points[corners[0]].material;
        if (material == 0 || material > tables.materials.size()) return;
        const uint32_t image = tables.materials[material - 1].image;
        if (placeOf.size() <= image) placeOf.resize(tables.images.size(), -1);
        const glm::vec2 size(float(tables.images[image].width), float(tables.images[image].height));
        const float texels = texelsPerCell(page, corners, size);
        if (placeOf[image] < 0) {
            placeOf[image] = int64_t(needs.size());
            needs.push_back({image, texels});
        }
        float& least = needs[size_t(placeOf[image])].texelsPerCell;
        least = std::min(least, texels);
    });
    return needs;
}

uint32_t finestNeeded(float texelsPerCell, double pixelEdge, uint32_t levels) {
    // Single precision may find a footprint a little shorter.
    constexpr double kRounding = 0.999;
    const double texels = double(texelsPerCell) * pixelEdge * double(f32::kFootprintPixels) * kRounding;
    if (!(texels > 1)) return 0;
    return uint32_t(std::min(std::floor(std::log2(texels)), double(levels - 1)));
}

}  // namespace vcp
