#include "render/host/hit_surface.h"

#include <glm/geometric.hpp>
#include <glm/packing.hpp>

namespace vcp {

namespace {

glm::vec4 blendColours(uint4 codes, glm::vec4 weights) {
    return weights.x * glm::unpackUnorm4x8(codes.x) + weights.y * glm::unpackUnorm4x8(codes.y) +
           weights.z * glm::unpackUnorm4x8(codes.z) + weights.w * glm::unpackUnorm4x8(codes.w);
}

HitSurface softSurface(const PageView& view, uint32_t node, glm::vec3 at, float side, glm::vec3 direction) {
    const uint32_t axis = node >> kSoftAxisShift & 3u, face = node & kLeafIndexMask;
    const f32::LeafField leaf = f32::decodeLeaf(view.faces[face], view.faces[face + 1], axis);
    HitSurface surface{f32::facingNormal(f32::leafNormal(leaf, at), direction, side), glm::vec4(0)};
    if (view.faceColours.empty()) return surface;
    const glm::vec3 r = f32::rotateToAxis(at, axis);
    const glm::vec4 weights = f32::faceWeights(r.y, r.z);
    surface.colour = blendColours(view.faceColours[face], weights * (1.0f - r.x)) +
                     blendColours(view.faceColours[face + 1], weights * r.x);
    return surface;
}

HitSurface triangleSurface(const PageView& view, const Index3& corners, glm::vec3 weights, glm::vec3 direction) {
    glm::vec3 p[3];
    for (int i = 0; i < 3; ++i) {
        const glm::u32vec2 vertex = view.vertices[corners[size_t(i)]];
        p[i] = f32::decodeVertex(vertex.x, vertex.y);
    }
    glm::vec3 flat = glm::cross(p[1] - p[0], p[2] - p[0]);
    flat *= glm::inversesqrt(std::max(glm::dot(flat, flat), 1e-30f));
    flat = f32::turnedTo(flat, -direction);
    HitSurface surface{glm::vec3(0), glm::vec4(0)};
    for (int i = 0; i < 3; ++i) {
        const uint32_t vertex = corners[size_t(i)];
        surface.normal += weights[i] * f32::cornerNormal(view.normals[vertex], flat);
        if (!view.vertexColours.empty()) surface.colour += weights[i] * glm::unpackUnorm4x8(view.vertexColours[vertex]);
    }
    return surface;
}

HitSurface slabSurface(const PageView& view, uint32_t node, glm::vec3 direction) {
    const uint32_t vector = slabVector(node);
    const glm::vec3 normal = f32::decodeDirection(vectorWord(view.faces, vector) >> kSlabDirectionShift);
    HitSurface surface{f32::turnedTo(normal, -direction), glm::vec4(0)};
    if (!view.faceColours.empty()) surface.colour = glm::unpackUnorm4x8(vectorWord(view.faceColours, vector));
    return surface;
}

}  // namespace

HitSurface surfaceAt(const HostScene& scene, const TileHits& hits, int pixel, glm::vec3 direction) {
    const HitLeaf& leaf = hits.leaves[hits.leaf[pixel]];
    const PageView& view = *scene.page(leaf.page).view;
    const glm::vec3 at(hits.x[pixel], hits.y[pixel], hits.z[pixel]);
    if (nodeType(leaf.node) == kNodeSoft) return softSurface(view, leaf.node, at, hits.side[pixel], direction);
    if (nodeType(leaf.node) == kNodeSlab) return slabSurface(view, leaf.node, direction);
    return triangleSurface(view, leaf.corners, {1 - at.x - at.y, at.x, at.y}, direction);
}

}  // namespace vcp
