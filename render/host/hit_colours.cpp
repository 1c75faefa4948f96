#include "render/host/hit_colours.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "render/host/hit_surface.h"

namespace vcp {

std::optional<HitColours::Textured> HitColours::find(const HitLeaf& leaf) const {
    if (nodeType(leaf.node) != kNodeHard) return {};
    const PageView& view = *scene_.page(leaf.page).view;
    const auto triangle = imagedTriangle(*scene_.images(), view, leaf.corners);
    if (!triangle) return {};
    glm::vec3 p[3];
    for (size_t i = 0; i < 3; ++i) {
        const glm::u32vec2 vertex = view.vertices[leaf.corners[i]];
        p[i] = f32::decodeVertex(vertex.x, vertex.y);
    }
    const glm::vec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    return Textured{.triangle = *triangle,
                    .slope = f32::textureSlope(p[0], p[1], p[2], triangle->toB, triangle->toC),
                    .normal = n * glm::inversesqrt(std::max(glm::dot(n, n), 1e-30f))};
}

const std::optional<HitColours::Textured>& HitColours::texturedOf(uint32_t leaf) {
    if (leaves_.size() < hits_.leaves.size()) leaves_.resize(hits_.leaves.size());
    if (!leaves_[leaf]) leaves_[leaf] = find(hits_.leaves[leaf]);
    return *leaves_[leaf];
}

glm::vec4 HitColours::at(int pixel, glm::vec3 direction, float pixelEdge) {
    const uint32_t leaf = hits_.leaf[pixel];
    if (scene_.images() == nullptr || hits_.blended[size_t(pixel)]) return colourAt(scene_, hits_, pixel);
    const std::optional<Textured>& t = texturedOf(leaf);
    if (!t) return colourAt(scene_, hits_, pixel);
    const ImageSet::Image& image = *t->triangle.image;
    const float edge =
        std::ldexp(f32::kFootprintPixels * pixelEdge, -int(scene_.page(hits_.leaves[leaf].page).cellBits));
    const f32::ImageFootprint footprint =
        f32::imageFootprint(t->slope, t->normal, direction, edge, glm::vec2(float(image.width), float(image.height)));
    return t->triangle.factor * filteredColour(*scene_.images(), image, t->triangle.wraps,
                                               t->triangle.at(hits_.x[pixel], hits_.y[pixel]), footprint);
}

}  // namespace vcp
