#include "render/host/hit_colours.h"

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "render/host/hit_surface.h"

namespace vcp {

namespace {

/// Returns coordinates of the first corner, nearer to the image where it repeats, and the ways from there to the
/// others. One axis.
struct PlacedAxis {
    float first, toB, toC;
};
PlacedAxis placedAxis(int32_t a, int32_t b, int32_t c, bool repeats) {
    // Repeated images may be mirrored, so whole numbers are left out in pairs; then single precision suffices.
    constexpr int64_t kPair = int64_t{2} << -kLog2TextureUnit;
    const int64_t whole = repeats ? (a >= 0 ? a / kPair : -((kPair - 1 - int64_t{a}) / kPair)) * kPair : 0;
    const auto unit = float(kTextureUnit);
    return {float(a - whole) * unit, float(int64_t{b} - a) * unit, float(int64_t{c} - a) * unit};
}

}  // namespace

std::optional<HitColours::Textured> HitColours::find(const HitLeaf& leaf) const {
    const HostScene::Page& page = scene_.page(leaf.page);
    const PageView& view = *page.view;
    if (nodeType(leaf.node) != kNodeHard || view.points.empty()) return {};
    const TexturePoint &a = view.points[leaf.corners[0]], &b = view.points[leaf.corners[1]],
                       &c = view.points[leaf.corners[2]];
    const ImageSet& set = *scene_.images();
    if (a.material == 0 || a.material > set.materials().size()) return {};
    const MaterialRow& material = set.materials()[a.material - 1];
    const PlacedAxis u = placedAxis(a.u, b.u, c.u, material.wrapU != ImageWrap::Clamp),
                     v = placedAxis(a.v, b.v, c.v, material.wrapV != ImageWrap::Clamp);
    Textured t{.image = &set.images()[material.image],
               .wraps = {uint32_t(material.wrapU), uint32_t(material.wrapV)},
               .factor = glm::unpackUnorm4x8(material.factor),
               .place = {u.first, v.first},
               .toB = {u.toB, v.toB},
               .toC = {u.toC, v.toC},
               .slope = {},
               .normal = {}};
    glm::vec3 p[3];
    for (size_t i = 0; i < 3; ++i) {
        const glm::u32vec2 vertex = view.vertices[leaf.corners[i]];
        p[i] = f32::decodeVertex(vertex.x, vertex.y);
    }
    t.slope = f32::textureSlope(p[0], p[1], p[2], t.toB, t.toC);
    const glm::vec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    t.normal = n * glm::inversesqrt(std::max(glm::dot(n, n), 1e-30f));
    return t;
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
    const float edge = std::ldexp(pixelEdge, -int(scene_.page(hits_.leaves[leaf].page).cellBits));
    const glm::vec2 size(float(t->image->width), float(t->image->height));
    const f32::ImageFootprint footprint = f32::imageFootprint(t->slope, t->normal, direction, edge, size);
    const glm::vec2 place = t->place + hits_.x[pixel] * t->toB + hits_.y[pixel] * t->toC;
    return t->factor * filteredColour(*scene_.images(), *t->image, t->wraps, place, footprint);
}

}  // namespace vcp
