// A page in memory: the bytes of one subvolume, checked, as spans. The layout is drawn in
// octree/shared/page_layout.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/result.h"
#include "octree/page/strips.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

/// First 64 bytes of a page. Byte map: see the offsets asserted below. All words little endian.
struct PageHeader {
    uint32_t magic = kMagic;
    uint32_t log2Cells = 0;   ///< S = 2^log2Cells cells an edge, 1 to 7
    uint32_t root = 0;        ///< node word of the whole page
    uint32_t groups = 0;      ///< groups of 8 node words
    uint32_t faces = 0;       ///< faces of 16 bytes; at most 2^22
    uint32_t entries = 0;     ///< entries of strips; at most 2^24
    uint32_t vertices = 0;    ///< at most 2^21
    uint32_t softLeaves = 0;  ///< counts, checked against the nodes
    uint32_t hardLeaves = 0;
    float certifiedError = 0;  ///< in cells of this page's level, rounded up
    uint32_t slabLeaves = 0;   ///< checked against the nodes; at most 4 * faces
    uint32_t reserved[5] = {};

    static constexpr uint32_t kMagic = 0x47504356;  // "VCPG"
};
static_assert(sizeof(PageHeader) == kPageHeaderBytes);
static_assert(offsetof(PageHeader, groups) == 12 && offsetof(PageHeader, certifiedError) == 36 &&
              offsetof(PageHeader, slabLeaves) == 40);

/// Byte offsets of a page's sections, computed from its counts.
struct PageSections {
    uint64_t nodes, faces, vertices, normals, strips, end;
};
PageSections pageSections(const PageHeader& header);

/// Where a vertex of a hard leaf's triangles is in an image. All three vertices of a triangle have the same material.
struct TexturePoint {
    int32_t u = 0,
            v = 0;  ///< in kTextureUnit of the image's width and height; (0, 0): its upper left corner, v downwards
    uint32_t material = 0;  ///< number of the material (octree/image/image_tables.h) plus 1; 0: none, u and v are 0

    bool operator==(const TexturePoint&) const = default;
};
static_assert(sizeof(TexturePoint) == 12);
inline constexpr int kLog2TextureUnit = -20;
inline constexpr double kTextureUnit = 1.0 / (1 << -kLog2TextureUnit);

/// Returns the bytes of the colour page that belongs to a page; of one that has a TexturePoint for each vertex, too.
uint64_t colourPageBytes(const PageHeader& header);
uint64_t texturedPageBytes(const PageHeader& header);

/// Copies items to where a section of a page, or of its colours, begins.
template <class T>
void copyTo(std::span<std::byte> bytes, uint64_t offset, const std::vector<T>& items) {
    if (!items.empty()) std::memcpy(bytes.data() + offset, items.data(), items.size() * sizeof(T));
}

/// A checked page. Spans point into the bytes it was parsed from, which must outlive it.
struct PageView {
    PageHeader header;
    std::span<const uint32_t> nodes;
    std::span<const uint4> faces;
    std::span<const glm::u32vec2> vertices;
    std::span<const uint32_t> normals;
    StripEntries strips;
    std::span<const uint4> faceColours;       ///< empty without colour
    std::span<const uint32_t> vertexColours;  ///< empty without colour
    std::span<const TexturePoint> points;     ///< of the vertices; empty where no triangle has an image
};

/// Checks every word of a page, so that a traversal cannot leave it or loop: counts against the size, nodes
/// form a tree of bounded depth, leaves and indices are in range. `bytes` must be 16-byte aligned; may be
/// hostile. `colours` is empty or a colour page, with points or without; whether the file has their materials is not
/// known here.
/// Errors: InvalidInput, with the byte within the page.
Result<PageView> parsePage(std::span<const std::byte> bytes, std::span<const std::byte> colours = {});

/// Returns the view of a page that parsePage has accepted before, wherever its bytes lie now; checks nothing. `colours`
/// is empty or the colour page that was accepted with it.
PageView viewOfChecked(std::span<const std::byte> bytes, std::span<const std::byte> colours = {});

/// The parts of a node word; nodeType() is in octree/shared/page_layout.h.
inline uint32_t emptyNode(double clearanceCells) {
    return kNodeEmpty << kNodeTypeShift | uint32_t(clearanceCells * double(kClearancePerCell));
}
inline double nodeClearance(uint32_t node) { return (node & kNodePayloadMask) / double(kClearancePerCell); }
/// Which octants of a slab leaf hold surface, as bits, and the number of its vector.
inline uint32_t slabOctants(uint32_t node) { return node >> kSlabOctantsShift & kSlabOctantsMask; }
inline uint32_t slabVector(uint32_t node) { return node & kSlabVectorMask; }
/// Whether a slab leaf, or a vertex, has an open mark.
inline bool isOpenSlab(uint32_t node) { return (node & kSlabOpenBit) != 0; }
inline bool isOpenVertex(glm::u32vec2 vertex) { return (vertex.y & kVertexOpenBit) != 0; }
/// The word of a vector in the section of faces, or of its colour in the colours of faces.
inline const uint32_t& vectorWord(std::span<const uint4> faces, uint32_t vector) {
    return reinterpret_cast<const uint32_t*>(faces.data())[vector];
}

}  // namespace vcp
