// An octree whose leaves store 32 bits for each of their eight corners: the structure of Demir and Westermann
// 2015 (sections 3 and 4), which their signed-distance octree shares.
//
//   node   int32: inner [0, 2^30): number of its first child, the eight follow each other, x lowest
//                 empty [2^30, 2^31): ceil(min(d / D, 1) (2^30 - 1)) + 2^30, d the least distance of the grid points
//                                     on the node's boundary, D a cut-off
//                 leaf  -(i + 1): its corners are slices i and i + 1
//   slice  4 codes of the corners with the same x, y lowest; leaves sorted by level, then by z, y and x, where
//          neighbours along x share a slice. The paper's 3-D texture holds the same.
//
// The roots are a dense grid (the paper's indirection pool). Blocks of 2^3 cells are empty or kept as a whole. The
// finest leaves are single cells, which is how we read "two adjacent blocks share 4 vectors" with "blocks of 2^3
// cells"; the first merging step makes a block one leaf.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "builder/measure/mesh_bvh.h"
#include "builder/measure/mesh_sides.h"
#include "builder/paper/root_grid.h"

namespace vcp {

/// What is known at a grid point, in cells.
struct CornerSample {
    glm::vec3 toSurface{0};  ///< closest point minus grid point
    float distance = 0;      ///< signed where the field asks for signs

    /// The sample of a point that region growing did not reach.
    static CornerSample unreached() { return {glm::vec3(0), std::numeric_limits<float>::infinity()}; }
    [[nodiscard]] bool isReached() const { return distance < std::numeric_limits<float>::infinity(); }
};
using CornerSamples = std::array<CornerSample, 8>;  ///< x lowest

/// What a leaf stores, and where leaves are needed.
class CornerField {
public:
    virtual ~CornerField() = default;
    /// Returns the distance, in cells, beyond which blocks are empty.
    [[nodiscard]] virtual float band() const = 0;
    [[nodiscard]] virtual bool isSigned() const = 0;
    /// Whether a cell of a kept block needs a leaf.
    [[nodiscard]] virtual bool keepCell(const CornerSamples&) const { return true; }
    /// Returns the largest `mergeError` at which eight leaves become one; below 0: never.
    [[nodiscard]] virtual float mergeThreshold() const { return -1; }
    /// Returns how far, in cells, the field of `corners` errs at `at` (0 to 1 an axis) of a leaf of edge `size`.
    [[nodiscard]] virtual float mergeError(const CornerSamples&, float /*size*/, glm::vec3 /*at*/,
                                           const CornerSample&) const {
        return 0;
    }
    /// `largest`: the largest of all distances that are stored, cells.
    [[nodiscard]] virtual uint32_t pack(const CornerSample&, float largest) const = 0;
};

class CornerOctree {
public:
    RootGrid frame;
    std::vector<int32_t> nodes;  ///< the roots first, x lowest
    std::vector<std::array<uint32_t, 4>> slices;
    /// In place of `slices`, of a region: the vectors, which are packed once the longest of all regions is known.
    std::vector<std::array<glm::vec3, 4>> vectors;
    float cutoff = 1;   ///< D, cells
    float largest = 0;  ///< largest distance stored in a leaf, cells
    uint64_t leaves = 0, emptyNodes = 0;

    static constexpr int32_t kEmpty = 1 << 30;

    [[nodiscard]] int32_t rootWord(glm::ivec3 c) const { return nodes[frame.rootIndex(c)]; }
    [[nodiscard]] int32_t childWord(int32_t inner, int, int octant) const { return nodes[inner + octant]; }
    [[nodiscard]] static bool isInner(int32_t word) { return word >= 0 && word < kEmpty; }
    [[nodiscard]] static bool isLeaf(int32_t word) { return word < 0; }
    /// Returns the distance of an empty node, in cells.
    [[nodiscard]] float emptyDistance(int32_t word) const {
        return float(word - kEmpty) * (cutoff / float(kEmpty - 1));
    }
    /// Returns the eight codes, x slowest: code 4 x + 2 z + y.
    [[nodiscard]] const uint32_t* leafCodes(int32_t word) const { return slices[-(word + 1)].data(); }
    [[nodiscard]] uint64_t bytes() const { return nodes.size() * 4 + slices.size() * 16; }
};

/// Roots of a larger grid that get an octree of their own. Its vectors are those that the octree of the whole grid has
/// there: points take over what points around the region have, which are sampled for that. Where the whole one has a
/// leaf with a vector longer than `halo`, the region has smaller ones; its empty nodes are at most `halo` away.
struct CornerRegion {
    RootGrid grid;
    glm::ivec3 firstRoot{0}, roots{1};
    /// The mesh has all triangles that are within so many cells of the region; at least haloOf().
    float halo = 0;

    static constexpr int kLeastRootLevel = 4;
};

struct CornerOctreeOptions {
    double cell = 1;  ///< world units
    /// What an empty node stores is lowered by sqrt(1/2) cell, the farthest that a point of the boundary lies from
    /// its grid points: it is then a distance that may be stepped. Off: as published.
    bool safeEmpty = false;
    /// Rounds of region growing (region_growing.h): k of Demir and Westermann. Blocks with a point that was not reached
    /// are empty. kExactPoints: closest points of the whole mesh.
    int growRounds = kExactPoints;
    unsigned threads = 0;
    /// A part of a grid, in place of a grid around the whole mesh. `cell` is the grid's; of fields without signs.
    std::optional<CornerRegion> region = {};

    static constexpr int kExactPoints = -1;
};

/// Returns the least halo of regions.
float haloOf(const CornerField& field, int growRounds);

/// Builds the octree. `sides` is needed by signed fields. Errors: Limit where a grid of more than RootGrid::kMaxCells /
/// 2 cells an edge or 2^30 nodes would be needed.
Result<CornerOctree> buildCornerOctree(const MeshBvh& mesh, const MeshSides* sides, const CornerField& field,
                                       const CornerOctreeOptions& options);

}  // namespace vcp
