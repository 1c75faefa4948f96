// The triangles of a checked page.
#pragma once

#include <array>
#include <utility>

#include <glm/vec3.hpp>

#include "octree/page/page.h"
#include "octree/page/strips.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

/// Calls `visit(triangle)` for each triangle of the page's hard leaves, leaf by leaf in the order of its nodes.
template <class Visit>
void forEachTriangle(const PageView& page, Visit&& visit) {
    const auto visitLeaf = [&](uint32_t word) {
        if (nodeType(word) == kNodeHard) forEachTriangle(page.strips, word, visit);
    };
    visitLeaf(page.header.root);
    for (const uint32_t word : page.nodes) visitLeaf(word);
}

/// Returns where the corners of a triangle are, in cells of the page from its lowest corner.
inline std::array<glm::vec3, 3> cornersOf(const PageView& page, const Index3& triangle) {
    std::array<glm::vec3, 3> corners;
    for (size_t i = 0; i < 3; ++i) {
        const glm::u32vec2 vertex = page.vertices[triangle[i]];
        corners[i] = f32::decodeVertex(vertex.x, vertex.y);
    }
    return corners;
}

}  // namespace vcp
