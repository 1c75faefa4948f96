#include "octree/leaf_triangles.h"

#include <algorithm>

namespace vcp {

NodePlaces::NodePlaces(uint32_t root, std::span<const uint32_t> nodes, uint32_t log2Cells)
    : root_(root), nodes_(nodes), edge_(kLatticePerCell << log2Cells), hardBelow_(nodes.size() / 8, 0) {
    for (size_t g = hardBelow_.size(); g-- > 0;)
        for (size_t i = 0; i < 8; ++i) {
            const uint32_t word = nodes[8 * g + i], type = word >> kNodeTypeShift;
            if (type == kNodeHard || (type == kNodeInternal && hardBelow_[word & kNodePayloadMask] != 0)) hardBelow_[g] |= static_cast<uint8_t>(1u << i);
        }
}

uint32_t NodePlaces::typeAt(glm::i32vec3 p) const {
    if (std::min(p.x, std::min(p.y, p.z)) < 0 || std::max(p.x, std::max(p.y, p.z)) >= edge_) return kNodeEmpty;
    uint32_t word = root_;
    for (int half = edge_ / 2; word >> kNodeTypeShift == kNodeInternal; half /= 2) {
        const uint32_t octant = (p.x & half ? 1u : 0u) | (p.y & half ? 2u : 0u) | (p.z & half ? 4u : 0u);
        word = nodes_[8 * (word & kNodePayloadMask) + octant];
    }
    return word >> kNodeTypeShift;
}

bool triangleTouchesCube(const std::array<glm::i32vec3, 3>& triangle, glm::i32vec3 lower, int edge) {
    // Twice as fine, so that the cube's centre is a lattice point even for an edge of one step.
    const int64_t half = edge;
    std::array<glm::i64vec3, 3> v;
    for (int i = 0; i < 3; ++i) {
        v[i] = glm::i64vec3(triangle[i]) * int64_t{2} - (glm::i64vec3(lower) * int64_t{2} + half);
        if (std::max(v[i].x, std::max(v[i].y, v[i].z)) <= half && std::min(v[i].x, std::min(v[i].y, v[i].z)) >= -half) return true;
    }
    const auto size = [](int64_t x) { return x < 0 ? -x : x; };
    std::array<glm::i64vec3, 3> e;
    for (int i = 0; i < 3; ++i) e[i] = glm::i64vec3(triangle[(i + 1) % 3] - triangle[i]);
    const glm::i64vec3 n(e[0].y * e[1].z - e[0].z * e[1].y, e[0].z * e[1].x - e[0].x * e[1].z, e[0].x * e[1].y - e[0].y * e[1].x);
    if (size(n.x * v[0].x + n.y * v[0].y + n.z * v[0].z) > half * (size(n.x) + size(n.y) + size(n.z))) return false;
    for (int i = 0; i < 3; ++i) {
        // Axes e x (x, y, z). The ends of the edge itself project to the same point.
        const glm::i64vec3 &a = v[i], &c = v[(i + 2) % 3], &d = e[i];
        for (int axis = 0; axis < 3; ++axis) {
            const int j = (axis + 1) % 3, k = (axis + 2) % 3;
            const int64_t pa = d[k] * a[j] - d[j] * a[k], pc = d[k] * c[j] - d[j] * c[k];
            const int64_t r = half * (size(d[j]) + size(d[k]));
            if (std::min(pa, pc) > r || std::max(pa, pc) < -r) return false;
        }
    }
    return true;
}

}  // namespace vcp
