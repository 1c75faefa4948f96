// Layout of a page: the bytes of one subvolume in memory and in the GPU pool; in the file they are coded
// (octree/page/page_codec.h). Compiles as C++ (inside namespace vcp) and as GLSL; octree/page/page.h is the C++
// entrance.
//
// A page covers S = 2^log2Cells cells per edge of its level. Its coordinates ("page space") have the
// page's lowest corner as origin and the level's cell edge as unit. All sections begin on 16 bytes:
//
//   offset            bytes               section
//   0                 64                  PageHeader (C++ only; the renderer has it in its page table)
//   64                32 * groups         nodes: groups of 8 child words, child i at octant x + 2y + 4z
//   ...               16 * faces          faces: 4 packed vectors each, see "soft leaf"; then the vectors of slab
//                                         leaves, four to a face, see "slab leaf"
//   ...               8 * vertices        vertices of the hard leaves' triangles: 3 coordinates, 21 bits each, and
//                                         in the highest bit an open mark
//   ...               4 * vertices        their normals, octahedral 16 + 16 bits, and a crease flag
//   ...               2 or 4 * entries    strips of those triangles, see "hard leaf"
//
// A colour page, when the dataset has colour, is parallel to it: 16 bytes a face (4 x RGBA8, one for each
// vector of the face), then 4 bytes a vertex.
//
// Node word, bits 31..30:
//   00 internal   bits 29..0: number of the group of its 8 children (greater than its own group)
//   01 empty      bit 29: 0; bits 28..0: clearance in 1/256 cell, rounded down. The node's box, grown by it on
//                 every side and clamped to the page, holds no surface (so a ball of it is safe too)
//   01 slab leaf  bit 29: 1; bits 28..21: the octants that hold surface, octant x + 2y + 4z at bit 21 + octant,
//                 at least one; bit 20: an open mark; bits 19..0: number of its vector
//   10 soft leaf  bits 21..0: first face; 23..22: axis; 27..24: wall code; 29..28: dip code
//   11 hard leaf  bits 23..0: first entry of its strips; 29..24: number of triangles, 1 to 62; 63: its
//                 first two entries hold the number, 14 bits each, low bits first, and the strips follow
//
// Soft leaf: two consecutive faces, perpendicular to `axis`, hold its 8 corners; neighbours along the
// axis share the face between them. Leaf space is page space shifted to the leaf's lowest corner and
// scaled so that the leaf is the unit cube. Corner c of a face sits at c & 1 on the next axis and at
// c >> 1 on the one after it, cyclically. Directions are in leaf space, from the surface to the corner;
// the sign says on which side of the leaf's surface the corner lies.
//
// Slab leaf: all of the mesh's surface in it lies between two parallel planes and in the octants that are named. Its
// vector is word v & 3 of face v >> 2; words behind the last vector are zero; no two leaves have the same. In leaf
// space, with the unit direction n, x is in the slab where |n . (x - c) - offset| <= half thickness; c: the centre.
//   bits 6..0     offset: kSlabOffsetUnit * (code - 64) leaf edges
//   bits 11..7    half thickness: kSlabThicknessUnit * code^2 leaf edges
//   bits 31..12   direction, octahedral, 10 + 10 bits; n and -n mean the same
//
// Open marks: a surface that has ends, where a page holds such ones beside closed ones (PageEntry::parts). All three
// vertices of a triangle have the mark, or none. A slab leaf has it where all of its surface is open; soft leaves have
// none.
//
// Hard leaf: strips of oriented triangles, one after the other; leaves share no entries. An entry has 16 bits
// where the page has at most kShortEntryVertices vertices, else 32. Its two top bits are a step, the rest is the
// number of a vertex v:
//   0 begin: a = v; the next two entries, with steps 0, are b and c
//   1 to 3:  v takes the place of a, b or c; so the next triangle lies across the edge of the other two
// After an even number of steps the triangle is (a, b, c), after an odd number (a, c, b).

const uint kPageHeaderBytes = 64u;
const uint kNodeTypeShift = 30u;
const uint kNodeInternal = 0u;
const uint kNodeEmpty = 1u;
const uint kNodeSoft = 2u;
const uint kNodeHard = 3u;
const uint kNodeSlab = 4u;  // by nodeType(): in the word, an empty node with kNodeSlabBit
const uint kNodeSlabBit = 0x20000000u;
const uint kNodePayloadMask = 0x3fffffffu;

INLINE uint nodeType(uint node) { return node >> 29 == 3u ? kNodeSlab : node >> kNodeTypeShift; }

const uint kLeafIndexMask = 0x3fffffu;
const uint kSoftAxisShift = 22u;
const uint kSoftWallShift = 24u;
const uint kSoftWallMask = 15u;
const uint kSoftDipShift = 28u;
const uint kSlabVectorMask = 0xfffffu;
const uint kSlabOpenBit = 0x100000u;
const uint kSlabOctantsShift = 21u;
const uint kSlabOctantsMask = 255u;
const uint kHardFirstMask = 0xffffffu;
const uint kHardCountShift = 24u;
const uint kHardCountMask = 63u;
const uint kHardCountLong = 63u;
const uint kShortEntryVertices = 16384u;
const uint kShortVertexBits = 14u;
const uint kLongVertexBits = 30u;
const uint kStepBegin = 0u;
const float kClearancePerCell = 256.0f;

// Leaves may be smaller than a cell where many triangles meet: up to this many further halvings.
const uint kMaxSubcellDepth = 3u;

// 21-bit fields of vertices. They sit on the level's lattice: 2048 steps a cell, from
// 512 cells below the page's origin to 512 cells above it.
const uint kField21Mask = 0x1fffffu;
const uint kVertexOpenBit = 0x80000000u;  // in the second word
const int kLatticePerCell = 2048;
const int kLatticeBias = 1048576;

// A vertex normal is not to be interpolated across a crease: this bit of the packed normal says so.
const uint kNormalCreaseBit = 1u;

// Packed vector (default packing): 11 bits distance, 10 + 10 bits octahedral direction, 1 bit sign.
// The vector to the closest point is -distance * direction, whatever the sign.
const float kPackedDistanceRange = 1.7320509f;  // sqrt(3) leaf edges, rounded up
const uint kPackedDistanceMax = 2047u;

// Packed vector of a slab leaf. The offset reaches a leaf's corners; the thickest slab about the centre holds the whole
// leaf, with room for rounding.
const uint kSlabOffsetMask = 127u;
const int kSlabOffsetZero = 64;
const float kSlabOffsetUnit = 0.8660255f / 63.0f;
const uint kSlabThicknessShift = 7u;
const uint kSlabThicknessMask = 31u;
const float kSlabThicknessUnit = 0.8663f / 961.0f;
const uint kSlabDirectionShift = 12u;
// What slabs and octants are widened by against rounding, in leaf edges: slabs as they are packed, octants as rays are
// intersected with them.
const float kSlabSlack = 1e-4f;

// Wall code: |f| on a leaf's wall up to which a ray is taken to have hit there, in leaf edges.
// Code 0: only rounding is bridged. Code k: kWallUnit * k^2 leaf edges.
const float kWallRounding = 2e-6f;
const float kWallUnit = 0.0005f;

// Dip code: bound on how far f can swing between two points of a leaf on the same side of the surface,
// in leaf edges: 0.004, 0.02, 0.1, unbounded.
