#include "render/host/hit_surface.h"

#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "octree/page/page_triangles.h"

namespace vcp {

namespace {

glm::vec4 blendColours(uint4 codes, glm::vec4 weights) {
    return weights.x * glm::unpackUnorm4x8(codes.x) + weights.y * glm::unpackUnorm4x8(codes.y) +
           weights.z * glm::unpackUnorm4x8(codes.z) + weights.w * glm::unpackUnorm4x8(codes.w);
}

glm::vec4 softColour(const PageView& view, uint32_t node, glm::vec3 at) {
    const uint32_t face = node & kLeafIndexMask;
    const glm::vec3 r = f32::rotateToAxis(at, node >> kSoftAxisShift & 3u);
    const glm::vec4 weights = f32::faceWeights(r.y, r.z);
    return blendColours(view.faceColours[face], weights * (1.0f - r.x)) +
           blendColours(view.faceColours[face + 1], weights * r.x);
}

glm::vec3 softNormal(const PageView& view, uint32_t node, glm::vec3 at, float side, glm::vec3 direction) {
    const uint32_t axis = node >> kSoftAxisShift & 3u, face = node & kLeafIndexMask;
    const f32::LeafField leaf = f32::decodeLeaf(view.faces[face], view.faces[face + 1], axis);
    return f32::facingNormal(f32::leafNormal(leaf, at), direction, side);
}

glm::vec3 triangleNormal(const PageView& view, const Index3& corners, glm::vec3 weights, glm::vec3 direction) {
    const auto p = cornersOf(view, corners);
    glm::vec3 flat = glm::cross(p[1] - p[0], p[2] - p[0]);
    flat *= glm::inversesqrt(std::max(glm::dot(flat, flat), 1e-30f));
    flat = f32::turnedTo(flat, -direction);
    glm::vec3 normal(0);
    for (int i = 0; i < 3; ++i) normal += weights[i] * f32::cornerNormal(view.normals[corners[size_t(i)]], flat);
    return normal;
}

glm::vec4 triangleColour(const PageView& view, const Index3& corners, glm::vec3 weights) {
    glm::vec4 colour(0);
    for (int i = 0; i < 3; ++i) colour += weights[i] * glm::unpackUnorm4x8(view.vertexColours[corners[size_t(i)]]);
    return colour;
}

glm::vec3 slabNormal(const PageView& view, uint32_t node, glm::vec3 direction) {
    const glm::vec3 normal = f32::decodeDirection(vectorWord(view.faces, slabVector(node)) >> kSlabDirectionShift);
    return f32::turnedTo(normal, -direction);
}

/// Where a hit is: in leaf space, or the weights of a triangle's vertices.
glm::vec3 placeOf(const TileHits& hits, int pixel) { return {hits.x[pixel], hits.y[pixel], hits.z[pixel]}; }
glm::vec3 weightsOf(const TileHits& hits, int pixel) {
    return {1 - hits.x[pixel] - hits.y[pixel], hits.x[pixel], hits.y[pixel]};
}

}  // namespace

glm::vec4 colourAt(const HostScene& scene, const TileHits& hits, int pixel) {
    const HitLeaf& leaf = hits.leaves[hits.leaf[pixel]];
    const PageView& view = *scene.page(leaf.page).view;
    if (view.faceColours.empty() && view.vertexColours.empty()) return glm::vec4(0);
    if (hits.blended[size_t(pixel)]) return hits.colour[pixel];
    if (nodeType(leaf.node) == kNodeSoft) return softColour(view, leaf.node, placeOf(hits, pixel));
    if (nodeType(leaf.node) == kNodeSlab)
        return glm::unpackUnorm4x8(vectorWord(view.faceColours, slabVector(leaf.node)));
    return triangleColour(view, leaf.corners, weightsOf(hits, pixel));
}

HitSurface surfaceAt(const HostScene& scene, const TileHits& hits, int pixel, glm::vec3 direction) {
    const HitLeaf& leaf = hits.leaves[hits.leaf[pixel]];
    const PageView& view = *scene.page(leaf.page).view;
    const uint32_t type = nodeType(leaf.node);
    return {type == kNodeSoft   ? softNormal(view, leaf.node, placeOf(hits, pixel), hits.side[pixel], direction)
            : type == kNodeSlab ? slabNormal(view, leaf.node, direction)
                                : triangleNormal(view, leaf.corners, weightsOf(hits, pixel), direction),
            colourAt(scene, hits, pixel)};
}

}  // namespace vcp
