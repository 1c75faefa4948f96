// Sparse octrees of the finest cells that triangles touch: binary voxels, and voxels with contours (Laine and Karras
// 2010: a pair of parallel planes in each voxel that enclose its surface).
//
//   inner node  uint32: number of its first child within the next level 24, mask of children 8; only children that
//               exist are stored, one after the other (Laine and Karras's descriptor has 15 + 16 bits and pointers)
//   last level  8-bit masks of 2^3 voxels; with contours also the number of each one's first contour
//   contour     uint32: low plane 7, high plane 7, normal 6 + 6 + 6; Laine and Karras store position and thickness
//
// The roots are a dense grid, as of the other peers. A ray ends where it enters a voxel, or the slab between its
// planes. Contours are at the finest voxels only: coarser ones, which let Laine and Karras end a branch early, and
// their image-space blur are left out.
#pragma once

#include <bit>
#include <optional>

#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"
#include "builder/paper/octree_walk.h"
#include "octree/io/result.h"

namespace vcp {

/// A slab of a voxel: low <= normal . (p - centre) <= high, in cells.
struct Contour {
    glm::vec3 normal{0};  ///< integers from -31 to 31
    float low = 0, high = 0;
};
inline Contour unpackContour(uint32_t code) {
    const auto component = [&](int shift) { return float(int(code >> shift & 63u) - 31); };
    const auto plane = [&](int shift) { return float(code >> shift & 127u) * (2.0f / 127) - 1; };
    const glm::vec3 normal(component(14), component(20), component(26));
    // The voxel reaches so far along the normal.
    const float extent = 0.5f * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z));
    return {normal, plane(0) * extent, plane(7) * extent};
}
/// Packs the narrowest of a few slabs that hold the points, which lie in the unit voxel about 0; rounded outwards.
/// `normals`: directions that are tried, of any length.
uint32_t packContour(const std::vector<glm::dvec3>& points, const std::vector<glm::dvec3>& normals);

/// Returns how many children below `octant` exist. A table: not every processor that we compile for counts bits.
inline uint32_t childrenBefore(uint32_t mask, int octant) {
    static constexpr std::array<uint8_t, 128> kBits = [] {
        std::array<uint8_t, 128> bits{};
        for (uint32_t i = 0; i < 128; ++i) bits[i] = uint8_t(std::popcount(i));
        return bits;
    }();
    return kBits[mask & ((1u << octant) - 1)];
}

class VoxelOctree {
public:
    RootGrid frame;
    bool hasContours = false;
    std::vector<int32_t> roots;          ///< node of the root level, or kEmptyWord
    std::vector<uint32_t> nodes;         ///< levels from coarse to fine, above the last
    std::vector<uint8_t> masks;          ///< masks of the last level
    std::vector<uint32_t> firstContour;  ///< first contours of the last level
    std::vector<uint32_t> contours;
    std::array<uint32_t, 32> levelStart{};  ///< first node of a level in the numbering of all, masks last
    uint64_t voxels = 0;

    // A word is an inner node's number; or for a leaf -2 - (8 * mask + octant).
    static constexpr int32_t kEmptyWord = -1;
    [[nodiscard]] int32_t rootWord(glm::ivec3 c) const { return roots[frame.rootIndex(c)]; }
    [[nodiscard]] static bool isInner(int32_t word) { return word >= 0; }
    [[nodiscard]] static bool isLeaf(int32_t word) { return word < kEmptyWord; }
    [[nodiscard]] int32_t childWord(int32_t inner, int levelOfChild, int octant) const {
        const auto node = uint32_t(inner);
        if (levelOfChild == 0) {
            const uint32_t last = node - levelStart[1];
            return masks[last] >> octant & 1 ? -2 - int32_t(8 * last + octant) : kEmptyWord;
        }
        const uint32_t descriptor = nodes[node], mask = descriptor >> 24;
        if (!(mask >> octant & 1)) return kEmptyWord;
        return int32_t(levelStart[levelOfChild] + (descriptor & 0xFFFFFFu) + childrenBefore(mask, octant));
    }
    [[nodiscard]] Contour contourOf(int32_t leaf) const {
        const auto number = uint32_t(-2 - leaf);
        return unpackContour(contours[firstContour[number >> 3] + childrenBefore(masks[number >> 3], int(number & 7))]);
    }
    [[nodiscard]] uint64_t bytes() const {
        return roots.size() * 4 + nodes.size() * 4 + masks.size() + firstContour.size() * 4 + contours.size() * 4;
    }
};

/// Builds the octree. Errors: Limit where a level would have more than 2^24 nodes, or the cells are too small.
Result<VoxelOctree> buildVoxelOctree(const IndexedMesh& mesh, double cell, bool contours, unsigned threads);

class VoxelCaster {
public:
    explicit VoxelCaster(VoxelOctree tree) : tree_(std::move(tree)) {}

    [[nodiscard]] const RootGrid& frame() const { return tree_.frame; }
    [[nodiscard]] const VoxelOctree& tree() const { return tree_; }
    [[nodiscard]] uint64_t bytes() const { return tree_.bytes(); }
    /// Casts a ray. Any thread.
    template <class Work>
    [[nodiscard]] GridHit cast(const GridRay& ray, Work& work) const;

private:
    VoxelOctree tree_;
};

template <class Work>
GridHit VoxelCaster::cast(const GridRay& ray, Work& work) const {
    GridHit hit;
    walkOctree(tree_, ray, work, [&](const WalkedNode& node) {
        if (!VoxelOctree::isLeaf(node.word)) return node.tExit;
        work.cell();
        const glm::vec3 centre = glm::vec3(node.low) + 0.5f;
        const glm::vec3 entry = ray.origin + node.t * ray.direction - centre;
        if (!tree_.hasContours) {
            // The face that the ray came through.
            const glm::vec3 size = glm::abs(entry);
            const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
            hit.t = node.t;
            hit.normal[axis] = 1;
            return kStopWalk;
        }
        work.fetch(2);
        const Contour slab = tree_.contourOf(node.word);
        const float from = glm::dot(slab.normal, entry), along = glm::dot(slab.normal, ray.direction);
        const float inverse = 1 / (std::abs(along) > 1e-12f ? along : 1e-12f);
        const float a = (slab.low - from) * inverse, b = (slab.high - from) * inverse;
        const float first = std::max(std::min(a, b), 0.0f), last = std::min(std::max(a, b), node.tExit - node.t);
        if (first > last) return node.tExit;
        hit = {node.t + first, slab.normal};
        return kStopWalk;
    });
    return hit;
}

}  // namespace vcp
