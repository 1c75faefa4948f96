#include "octree/imaged_triangle.h"

#include <glm/packing.hpp>

namespace vcp {

namespace {

/// Coordinates of a triangle along one axis.
struct PlacedAxis {
    float first, toB, toC;
};

/// Where images repeat, they may be mirrored, so whole numbers are left out in pairs; then single precision suffices.
PlacedAxis placedAxis(int32_t a, int32_t b, int32_t c, ImageWrap wrap) {
    constexpr int64_t kPair = int64_t{2} << -kLog2TextureUnit;
    const int64_t whole = wrap == ImageWrap::Clamp ? 0 : int64_t{a} & ~(kPair - 1);
    const auto unit = float(kTextureUnit);
    return {float(a - whole) * unit, float(int64_t{b} - a) * unit, float(int64_t{c} - a) * unit};
}

}  // namespace

std::optional<ImagedTriangle> imagedTriangle(const ImageSet& images, const PageView& page, const Index3& corners) {
    if (page.points.empty()) return {};
    const TexturePoint &a = page.points[corners[0]], &b = page.points[corners[1]], &c = page.points[corners[2]];
    if (a.material == 0 || a.material > images.materials().size()) return {};
    const MaterialRow& material = images.materials()[a.material - 1];
    if (!images.images()[material.image].isShown()) return {};
    const PlacedAxis u = placedAxis(a.u, b.u, c.u, material.wrapU), v = placedAxis(a.v, b.v, c.v, material.wrapV);
    return ImagedTriangle{.material = a.material - 1,
                          .image = &images.images()[material.image],
                          .wraps = {uint32_t(material.wrapU), uint32_t(material.wrapV)},
                          .factor = glm::unpackUnorm4x8(material.factor),
                          .place = {u.first, v.first},
                          .toB = {u.toB, v.toB},
                          .toC = {u.toC, v.toC}};
}

}  // namespace vcp
