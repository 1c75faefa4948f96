#include "render/host/hit_colours.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "octree/page/page_triangles.h"

namespace vcp {

std::optional<HitColours::Textured> HitColours::find(const HitLeaf& leaf) const {
    if (nodeType(leaf.node) != kNodeHard) return {};
    const PageView& view = *scene_.page(leaf.page).view;
    const auto triangle = imagedTriangle(*scene_.images(), view, leaf.corners);
    if (!triangle) return {};
    const auto p = cornersOf(view, leaf.corners);
    const glm::vec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    return Textured{.triangle = *triangle,
                    .slope = f32::textureSlope(p[0], p[1], p[2], triangle->toB, triangle->toC),
                    .normal = n * glm::inversesqrt(std::max(glm::dot(n, n), 1e-30f)),
                    .depth = -1,
                    .places = {}};
}

HitColours::Textured* HitColours::texturedAt(int pixel) {
    if (scene_.images() == nullptr || hits_.blended[size_t(pixel)]) return nullptr;
    if (leaves_.size() < hits_.leaves.size()) leaves_.resize(hits_.leaves.size());
    const uint32_t leaf = hits_.leaf[pixel];
    if (!leaves_[leaf]) leaves_[leaf] = find(hits_.leaves[leaf]);
    return *leaves_[leaf] ? &**leaves_[leaf] : nullptr;
}

void HitColours::setPlaces(Textured& t, int pixel, const PixelView& view) const {
    const ImageSet::Image& image = *t.triangle.image;
    const uint32_t cellBits = scene_.page(hits_.leaves[hits_.leaf[pixel]].page).cellBits;
    const float edge = std::ldexp(f32::kFootprintPixels * view.edge, -int(cellBits));
    const glm::vec2 size(float(image.width), float(image.height));
    t.depth = hits_.depth[pixel];
    t.places = placesOf(image, f32::imageFootprint(t.slope, t.normal, view.direction, edge, size));
}

}  // namespace vcp
