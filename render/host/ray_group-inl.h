// Rays side by side, one a lane: a group of 4 x 2 or 4 x 1 pixels of a tile, with their hits so far.
#if defined(VCP_RENDER_HOST_RAY_GROUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_RAY_GROUP_INL_H
#undef VCP_RENDER_HOST_RAY_GROUP_INL_H
#else
#define VCP_RENDER_HOST_RAY_GROUP_INL_H
#endif

#include "render/host/lanes-inl.h"
#include "render/host/tile_rays.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

constexpr int kGroupHeight = kLanes / kGroupWidth, kGroupRows = kTileHeight / kGroupHeight;
constexpr int kGroups = kGroupColumns * kGroupRows;

struct RayGroup {
    Lane column, row;               // pixels from the tile's middle
    Lane3 direction, inverse;       // no component is 0
    Lane begin, end;                // of rays that have spans: finest cells along them
    float middleColumn, middleRow;  // of the rectangle that all are in
    Mask alive;                     // rays of the picture without a hit
    // The hit: its distance in finest cells, multiplied with the direction, and what TileHits keeps.
    Lane t, x, y, z, side;
    Lane3 normal;     // of those that no triangle has stopped
    Mask onTriangle;  // the others
    LaneWords leaf;

    // Compilers for Arm give an implicit constructor no instruction set.
    HWY_ATTR RayGroup() {}
};

/// unfoldOctahedron of leaf_math.h, times `length`.
HWY_INLINE Lane3 unfoldOctahedron(Lane x, Lane y, Lane length) {
    const Lane z = Lane(1.0f) - abs(x) - abs(y), fold = max(-z, Lane(0.0f));
    x = x - Lane(hn::CopySign(fold.v, x.v));
    y = y - Lane(hn::CopySign(fold.v, y.v));
    const Lane scale = length / sqrt(dot(Lane3(x, y, z), Lane3(x, y, z)));
    return {x * scale, y * scale, z * scale};
}

/// Returns 1 / x, x being moved away from 0 first.
HWY_INLINE Lane invert(Lane& x) {
    x = select(abs(x) < Lane(1e-18f), Lane(1e-18f), x);
    return Lane(1.0f) / x;
}

HWY_INLINE void setInverse(RayGroup& group) {
    group.inverse.x = invert(group.direction.x);
    group.inverse.y = invert(group.direction.y);
    group.inverse.z = invert(group.direction.z);
}

HWY_INLINE void setNoHit(RayGroup& group) {
    group.t = Lane(hwy::HighestValue<float>());
    group.x = group.y = group.z = group.side = Lane(0.0f);
    group.normal = Lane3(Lane(0.0f), Lane(0.0f), Lane(0.0f));
    group.onTriangle = maskOf(0);
    group.leaf = hn::Zero(Words());
}

/// Group `index` of a tile, its groups counted row by row. `size`: pixels of the tile that are in the picture.
HWY_INLINE RayGroup rayGroup(const TileRays& rays, glm::ivec2 size, int index) {
    const int x = index % kGroupColumns * kGroupWidth, y = index / kGroupColumns * kGroupHeight;
    alignas(32) float columns[8], rows[8];
    for (int lane = 0; lane < kLanes; ++lane) {
        columns[lane] = float(x + lane % kGroupWidth);
        rows[lane] = float(y + lane / kGroupWidth);
    }
    RayGroup group;
    const Lane column = load(columns), row = load(rows);
    group.alive = (column < Lane(float(size.x))) & (row < Lane(float(size.y)));
    group.column = column + Lane(kFirstColumn);
    group.row = row + Lane(kFirstRow);
    group.direction = mulAdd(group.column, spread(rays.directionPerX),
                             mulAdd(group.row, spread(rays.directionPerY), spread(rays.direction)));
    setInverse(group);
    group.middleColumn = kFirstColumn + float(x) + 0.5f * (kGroupWidth - 1);
    group.middleRow = kFirstRow + float(y) + 0.5f * (kGroupHeight - 1);
    setNoHit(group);
    return group;
}

/// What rays cannot miss by more than half a group: the reach of a number that is linear in the pixel's place.
HWY_INLINE Lane reachInGroup(Lane perX, Lane perY, glm::vec2 half) {
    return mulAdd(abs(perX), Lane(half.x), abs(perY) * Lane(half.y));
}

/// What section planes leave of rays.
struct KeptSpan {
    Lane begin, end;
};

/// The rays of a group in a leaf: `start` in leaf space, and parts of the rays in leaf edges from there.
struct GroupSegment {
    Lane3 start;
    KeptSpan kept;     // its end is set where planes cut the leaf
    Lane first, last;  // what is inside of the leaf, from kept.begin on
    Mask inside;       // rays of which there is such a part

    HWY_ATTR GroupSegment() {}
};

/// Narrows down what is kept of a segment to what section planes leave.
inline HWY_NOINLINE void cutSegment(const RayGroup& group, const LeafRays& leaf, GroupSegment& s) {
    for (int i = 0; i < leaf.cutCount; ++i) {
        const Lane3 n = spread(glm::vec3(leaf.cuts[i]));
        const Lane along = dot(n, group.direction), off = Lane(leaf.cuts[i].w) - dot(n, s.start), t = off / along;
        const Mask ahead = along > Lane(0.0f), back = along < Lane(0.0f);
        s.kept.begin = select(ahead, max(s.kept.begin, t), s.kept.begin);
        s.kept.end = select(back, min(s.kept.end, t), s.kept.end);
        s.kept.end = select(without(off > Lane(0.0f), ahead | back), Lane(hwy::LowestValue<float>()), s.kept.end);
    }
}

/// The leaf's box is wider by what its rays are rounded by, so that a ray along a wall is in both leaves beside it.
/// `kIsCut`: whether section planes cut the leaf, or rays have spans.
template <bool kIsCut>
HWY_INLINE GroupSegment segmentIn(const RayGroup& group, const LeafRays& leaf) {
    GroupSegment s;
    s.start =
        mulAdd(group.column, spread(leaf.startPerX), mulAdd(group.row, spread(leaf.startPerY), spread(leaf.start)));
    const Lane low(-leaf.rounding), high(1.0f + leaf.rounding);
    const Lane x0 = (low - s.start.x) * group.inverse.x, x1 = (high - s.start.x) * group.inverse.x;
    const Lane y0 = (low - s.start.y) * group.inverse.y, y1 = (high - s.start.y) * group.inverse.y;
    const Lane z0 = (low - s.start.z) * group.inverse.z, z1 = (high - s.start.z) * group.inverse.z;
    s.kept.begin = Lane(leaf.tauMin);
    s.first = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), s.kept.begin));
    s.last = min(min(max(x0, x1), max(y0, y1)), max(z0, z1));
    s.inside = group.alive & (s.first <= s.last);
    if constexpr (kIsCut) {
        s.kept.end = Lane(hwy::HighestValue<float>());
        if (leaf.hasSpans) {
            const Lane perEdge(1.0f / leaf.edge), from(leaf.distance);
            s.kept.begin = max(s.kept.begin, (group.begin - from) * perEdge);
            s.kept.end = (group.end - from) * perEdge;
        }
        if (leaf.cutCount != 0) cutSegment(group, leaf, s);
        s.first = max(s.first, s.kept.begin);
        s.inside = s.inside & (s.first <= min(s.last, s.kept.end));
    }
    return s;
}

/// Returns those hits at u of the part that section planes leave.
template <bool kIsCut>
HWY_INLINE Mask keptHits(const GroupSegment& s, Mask hit, Lane u) {
    return kIsCut ? hit & (mulAdd(u, s.last - s.first, s.first) <= s.kept.end) : hit;
}

HWY_INLINE Lane clamp01(Lane x) { return min(max(x, Lane(0.0f)), Lane(1.0f)); }

/// The part of rays that is in a leaf: from p over p + d, in leaf space.
struct LeafPart {
    Lane3 p, d;
};

HWY_INLINE LeafPart partInLeaf(const RayGroup& group, const GroupSegment& s) {
    const Lane3 from = mulAdd(s.first, group.direction, s.start), to = mulAdd(s.last, group.direction, s.start);
    const Lane3 p(clamp01(from.x), clamp01(from.y), clamp01(from.z));
    return {p, Lane3(clamp01(to.x), clamp01(to.y), clamp01(to.z)) - p};
}

/// Keeps the hits at p + u d of the rays in `hit`; returns where they are, in leaf space.
HWY_INLINE Lane3 keepHits(RayGroup& group, const LeafRays& leaf, const GroupSegment& s, const LeafPart& part, Mask hit,
                          Lane u) {
    const Lane tau = mulAdd(u, s.last - s.first, s.first);
    group.t = select(hit, mulAdd(tau, Lane(leaf.edge), Lane(leaf.distance)), group.t);
    const Lane3 at = mulAdd(u, part.d, part.p);
    group.x = select(hit, at.x, group.x);
    group.y = select(hit, at.y, group.y);
    group.z = select(hit, at.z, group.z);
    return at;
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
