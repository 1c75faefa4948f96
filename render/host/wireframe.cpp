#include "render/host/wireframe.h"

#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "octree/page/page_triangles.h"
#include "render/host/hit_surface.h"

namespace vcp {

namespace {

/// The normal of the surface that the lines lie on, unit.
glm::vec3 normalOf(const PageView& view, const HitLeaf& leaf, const TileHits& hits, int pixel) {
    if (nodeType(leaf.node) == kNodeSlab)
        return f32::decodeDirection(vectorWord(view.faces, slabVector(leaf.node)) >> kSlabDirectionShift);
    const glm::vec3 normal(hits.normalX[pixel], hits.normalY[pixel], hits.normalZ[pixel]);
    return normal * glm::inversesqrt(std::max(glm::dot(normal, normal), 1e-30f));
}

}  // namespace

HitLine lineAt(const HostScene& scene, const TileHits& hits, int pixel, glm::vec3 direction, float pixelEdge) {
    const HitLeaf& leaf = hits.leaves[hits.leaf[pixel]];
    const HostScene::Page& page = scene.page(leaf.page);
    const glm::vec3 at(hits.x[pixel], hits.y[pixel], hits.z[pixel]);
    if (nodeType(leaf.node) != kNodeHard) {
        const float edge = std::ldexp(1.0f, int(leaf.bits) - int(kMaxSubcellDepth));
        return {f32::linesOfLeaf(at, normalOf(*page.view, leaf, hits, pixel), direction, pixelEdge / edge), false};
    }
    const auto corners = cornersOf(*page.view, leaf.corners);
    const float cell = float(1u << page.cellBits);
    return {f32::linesOfTriangle(corners[0], corners[1], corners[2], {1 - at.x - at.y, at.x, at.y}, direction,
                                 pixelEdge / cell),
            true};
}

uint32_t withLine(uint32_t colour, const HitLine& line) {
    const glm::vec3 ink = line.isTriangles ? f32::triangleInk() : f32::leafInk();
    return packedColour(glm::vec4(glm::mix(glm::vec3(glm::unpackUnorm4x8(colour)), ink, line.part), 1));
}

}  // namespace vcp
