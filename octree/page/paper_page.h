// A page of the method `paper`: the octree of Demir and Westermann 2015, sections 3 and 4.
//
// A file has one page for the whole dataset; or, as in their 4.3, one of large cells for the whole, which is the
// root's, and one of the finest cells for each subvolume near the surface, which are those of the finest level. Pages
// between the two only lead from one to the other. All are parts of one grid and have one longest vector, but for the
// root.
//
//   offset   bytes            section
//   0        64               PaperPageHeader
//   64       4 * nodes        node words: roots first (x lowest), then groups of eight children (x lowest);
//                             padded to 16 bytes
//   ...      16 * slices      corners of leaves: four codes each, y lowest, then z
//
// Node word: inner [0, 2^30): number of its first child, greater than its own; empty [2^30, 2^31): 2^30 plus the
// distance that the node is from the surface, 2^30 - 1 being `cutoff`; leaf -(i + 1): its corners are slices i and i
// + 1. Lengths are in the page's cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/io/result.h"

namespace vcp {

#define INLINE inline
#define CONST_REF(T) const T&
namespace paper {
using namespace glm;
using uint = uint32_t;
#include "octree/shared/paper_math.h"
}  // namespace paper
#undef CONST_REF
#undef INLINE

enum class PaperScheme : uint8_t { Trilinear, MinPlane, Longer };
/// Planar: by the plane, if that is more, up to twice epsilon. Onward: up to twice epsilon beyond the distance.
enum class PaperStep : uint8_t { Distance, Planar, Onward };
/// Octahedral: 13 bits of length as in Spherical, and 10 + 9 of direction; for comparison.
enum class PaperPacking : uint8_t { Spherical, Octahedral };

/// The rules of the march; they may change from ray to ray.
struct PaperMarch {
    float epsilon = 0.25f;  ///< a ray hits where the distance is below this, in finest cells
    PaperScheme scheme = PaperScheme::Longer;
    PaperStep step = PaperStep::Planar;
    bool back = true;    ///< a hit is moved back to where the distance is epsilon
    bool cached = true;  ///< a step reuses the node and the leaf of the step before
    /// Subvolumes nearer than this part of the diagonal of the dataset's bounds are drawn of finest cells (4.3).
    float reach = 0.25f;

    bool operator==(const PaperMarch&) const = default;
};

/// The parameters that a file was built with.
struct PaperParameters {
    float band = 0, mergeThreshold = 0;  ///< lengths in finest cells
    int32_t growRounds = 0;              ///< rounds of region growing; -1: exact closest points
    uint32_t packing = 0, mergeScheme = 0;
    uint32_t safeEmpty = 0;
    uint32_t reserved[2] = {};
};
static_assert(sizeof(PaperParameters) == 32);

struct PaperPageHeader {
    uint32_t magic = kMagic;
    uint32_t rootLevel = 0;  ///< a root is 2^rootLevel finest cells an edge
    uint32_t packing = 0;    ///< PaperPacking
    uint32_t nodes = 0;
    uint32_t roots[3] = {};  ///< along x, y and z
    uint32_t slices = 0;
    float cutoff = 0, longest = 0;  ///< largest distance that an empty node states; length of the longest vector
    uint32_t leaves = 0, emptyNodes = 0;
    uint32_t cellShift = 0;  ///< its cells are 2^cellShift of the file's finest ones an edge; 0 but for the root's
    uint32_t reserved[3] = {};

    static constexpr uint32_t kMagic = 0x50504356;  // "VCPP"
};
static_assert(sizeof(PaperPageHeader) == paper::kPaperHeaderBytes && offsetof(PaperPageHeader, roots) == 16 &&
              offsetof(PaperPageHeader, cutoff) == 32 && offsetof(PaperPageHeader, cellShift) == 48);

/// Byte offsets of the slices and of the page's end.
struct PaperSections {
    uint64_t slices, end;
};
PaperSections paperSections(const PaperPageHeader& header);

/// A checked page. Spans point into the bytes it was parsed from.
struct PaperPageView {
    PaperPageHeader header;
    std::span<const int32_t> nodes;
    std::span<const glm::u32vec4> slices;
};

/// Checks every word, so that no march can leave the page or loop: counts against the size, the roots fit a cube of
/// 2^log2Cells finest cells, inner nodes form a tree, leaves are in range. `bytes` must be 16-byte aligned; may be
/// hostile. Errors: InvalidInput, with the byte within the page.
Result<PaperPageView> parsePaperPage(std::span<const std::byte> bytes, uint32_t log2Cells);

}  // namespace vcp
