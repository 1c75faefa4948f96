#include "builder/measure/hit_colour.h"

#include <limits>

#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"
#include "builder/stream/colour_encoding.h"
#include "octree/imaged_triangle.h"
#include "octree/page/strips.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

glm::dvec3 storedColour(uint32_t colour) {
    return glm::dvec3(colour & 255u, colour >> 8 & 255u, colour >> 16 & 255u) / 255.0;
}

glm::dvec3 softColour(const PageView& view, uint32_t node, glm::dvec3 inLeaf) {
    const uint32_t face = node & kLeafIndexMask;
    const glm::dvec3 r = f64::rotateToAxis(inLeaf, node >> kSoftAxisShift & 3u);
    const glm::dvec4 weights = f64::faceWeights(r.y, r.z);
    const auto blend = [&](uint4 codes) {
        return weights.x * storedColour(codes.x) + weights.y * storedColour(codes.y) +
               weights.z * storedColour(codes.z) + weights.w * storedColour(codes.w);
    };
    return (1 - r.x) * blend(view.faceColours[face]) + r.x * blend(view.faceColours[face + 1]);
}

/// What the finest texels of a triangle's image show; nothing where it has none. `weights`: of its corners.
std::optional<glm::dvec3> imagedColour(const PageView& view, const Index3& corners, glm::dvec3 weights,
                                       const ImageSet* images) {
    const auto triangle = images != nullptr ? imagedTriangle(*images, view, corners) : std::nullopt;
    if (!triangle) return {};
    const glm::vec2 at = triangle->at(float(weights.y), float(weights.z));
    const ImagePlaces finest = placesOf(*triangle->image, {{0, 0}, 0, 0});
    return glm::dvec3(triangle->factor * filteredColour(*triangle->image, triangle->wraps, at, finest));
}

/// The blend at the leaf's triangle that is nearest to the point, which is in cells from the page's lowest corner.
glm::dvec3 hardColour(const PageView& view, uint32_t node, glm::dvec3 inPage, const ImageSet* images) {
    double nearest = std::numeric_limits<double>::infinity();
    glm::dvec3 colour(0);
    forEachTriangle(view.strips, node, [&](const Index3& v) {
        glm::dvec3 corner[3];
        for (int i = 0; i < 3; ++i)
            corner[i] = f64::decodeVertex(view.vertices[v[size_t(i)]].x, view.vertices[v[size_t(i)]].y);
        const glm::dvec3 point = closestPointOfTriangle(inPage, corner[0], corner[1], corner[2]);
        const double distance = glm::distance(inPage, point);
        if (distance >= nearest) return;
        nearest = distance;
        const glm::dvec3 weights = cornerWeights(point, corner[0], corner[1], corner[2]);
        if (const auto shown = imagedColour(view, v, weights, images)) {
            colour = *shown;
            return;
        }
        colour = glm::dvec3(0);
        for (int i = 0; i < 3; ++i) colour += weights[i] * storedColour(view.vertexColours[v[size_t(i)]]);
    });
    return colour;
}

}  // namespace

glm::dvec3 cornerWeights(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double size = glm::dot(normal, normal);
    if (!(size > 0)) return {1, 0, 0};
    const double second = glm::dot(glm::cross(p - a, c - a), normal) / size;
    const double third = glm::dot(glm::cross(b - a, p - a), normal) / size;
    return {1 - second - third, second, third};
}

std::optional<glm::dvec3> lightOfHit(const PageCache& cache, const RayHit& hit, const ImageSet* images) {
    const PageView& view = *cache.view(hit.page);
    if (view.faceColours.empty() && view.vertexColours.empty()) return {};
    const PageEntry& entry = cache.dataset().pages[hit.page];
    const glm::dvec3 inPage = (hit.position - cache.dataset().originOf(entry)) / cache.dataset().cellOf(entry.level);
    const uint32_t type = nodeType(hit.node);
    const glm::dvec3 stored = type == kNodeSoft   ? softColour(view, hit.node, (inPage - hit.leafMin) / hit.leafEdge)
                              : type == kNodeSlab ? storedColour(vectorWord(view.faceColours, slabVector(hit.node)))
                                                  : hardColour(view, hit.node, inPage, images);
    return glm::dvec3(srgbToLinear(stored.x), srgbToLinear(stored.y), srgbToLinear(stored.z));
}

}  // namespace vcp
