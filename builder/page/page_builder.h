// Builds one page: the octree of certified leaves over the triangles of one subvolume.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/page/page_geometry.h"
#include "octree/page/page.h"

namespace vcp {

/// A hard leaf keeps splitting above so many triangles, down to kMaxSubcellDepth halvings of a cell.
inline constexpr size_t kHardLeafTriangles = 12;
/// Hard siblings become one leaf when they have at most so many triangles together.
inline constexpr size_t kMergedHardTriangles = 6;
/// A page's leaves below the size of a cell are split further only while it has fewer leaves than this: so a page's
/// memory and file size are bounded by its triangles.
constexpr uint64_t mostSplitLeaves(uint64_t triangles) { return 32768 + triangles * 3 / 4; }
/// The same bound for the triangles that its leaves name: a bundle of long slivers would be repeated hundreds of times.
constexpr uint64_t mostSplitRecords(uint64_t triangles) { return 65536 + triangles * 8; }
/// The largest soft leaf, in cells: beyond it the closest points of its corners are not certainly the mesh's.
inline constexpr int kMaxSoftCells = 8;

/// A node of the octree under construction.
struct TreeNode {
    enum class Kind : uint8_t { Empty, Soft, Hard, Slab, Internal };
    Kind kind = Kind::Empty;
    NodeBox box;
    uint32_t index = 0;  ///< number among the soft, hard or slab leaves; in an inner node that of its first child of 8
};

struct SoftLeaf {
    NodeBox box;
    Certificate certificate;
    std::array<uint32_t, 8> colours{};  ///< RGBA8 of its corners, where the mesh has colour
    uint32_t wall = 0;                  ///< wall code
};

struct HardLeaf {
    NodeBox box;
    std::vector<uint32_t> triangles;  ///< local numbers, ascending
};

struct SlabLeaf {
    NodeBox box;
    uint32_t code = 0;              ///< packed slab (octree/shared/page_layout.h)
    uint32_t octants = 0;           ///< those that hold surface
    uint32_t parts = 0;             ///< kinds of parts that its surface belongs to, as PageEntry's
    double error = 0;               ///< in its edges
    uint32_t colour = 0xffffffffu;  ///< RGBA8
};

/// How far off the colours of slabs are, as ΔE (octree/vcp_file.h).
struct ColourError {
    double p95 = 0;  ///< of the slabs, by the surface in them
    double max = 0;
};

/// The octree of a page, before it is encoded. Node 0 is the root.
struct PageTree {
    std::vector<TreeNode> nodes;
    std::vector<SoftLeaf> soft;
    std::vector<HardLeaf> hard;
    std::vector<SlabLeaf> slabs;
    std::span<const uint32_t> triangles;  ///< the mesh's number of each local one
    glm::i32vec3 originLattice{0};        ///< lowest corner of the page
    int cells = 0;                        ///< an edge
    double stray = 0;                     ///< the largest of the triangles that touch the page, in cells
    std::vector<uint8_t> occupied;        ///< cells that the mesh touches, x fastest
    bool listsAreCertain = false;         ///< as PageDraft's
    ColourError colourError;              ///< of the slabs
    /// Makes node `index` an inner one, with eight empty children; returns the first one's number.
    uint32_t addChildren(uint32_t index);
    /// Makes node `index` a hard leaf. `locals`: local numbers, ascending.
    void makeHard(uint32_t index, std::vector<uint32_t> locals);
    void makeSlab(uint32_t index, const SlabLeaf& leaf);
    /// Returns the largest distance of the rendered surface from this level's mesh, in cells.
    [[nodiscard]] double certifiedError() const;
    /// Returns the triangle records of the hard leaves: a triangle has one in each leaf that it touches.
    [[nodiscard]] size_t records() const;
};

/// Builds a page's octree. `tolerance`: in cells, for soft leaves. `mostRecords`: as many records as a page can name;
/// where there would be more, leaves are larger. With more triangles than that there is no such tree.
PageTree buildPageTree(PageGeometry& geometry, double tolerance, size_t mostRecords = kLeafIndexMask);

/// Returns the bytes that a page needs while it is built; measured on scans and on random soups of triangles of 0.3 to
/// 3 cells, each at one third to 17 leaves a triangle. `touched`: the cells that its triangles touch, each triangle's
/// counted by themselves.
constexpr uint64_t pageWorkBytes(uint64_t triangles, uint64_t touched) {
    return (4 << 20) + 180 * triangles + 20 * touched + 390 * std::min(4 * touched, mostSplitLeaves(triangles));
}

}  // namespace vcp
