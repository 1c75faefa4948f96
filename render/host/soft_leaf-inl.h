// Soft leaves for groups of rays: decoded once a tile, a lane a corner, then met by a lane a ray.
//
// The polynomial along a ray is that of octree/shared/ray_field.h. What leaf_math.h decides ray by ray is here decided
// lane by lane; tests/render/host compare the two.
#if defined(VCP_RENDER_HOST_SOFT_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_SOFT_LEAF_INL_H
#undef VCP_RENDER_HOST_SOFT_LEAF_INL_H
#else
#define VCP_RENDER_HOST_SOFT_LEAF_INL_H
#endif

#include "octree/surface/leaf_math.h"
#include "render/host/ray_group-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

namespace field {
using Real = Lane;
using Real2 = Lane2;
using Real3 = Lane3;
using Real4 = Lane4;
#define INLINE HWY_INLINE
#include "octree/shared/ray_field.h"
#undef INLINE
}  // namespace field

constexpr int kRootSteps = 8;
constexpr float kRootResidual = 1e-5f;

/// A decoded soft leaf: f(x) = sum of weights times (a + g . x) over its corners, in the order of its faces.
struct SoftLeaf {
    alignas(32) float a[8], gx[8], gy[8], gz[8];
    uint32_t axis;
    float wall, dip;
};

HWY_INLINE Lane3 decodeDirection(LaneWords code, Lane length) {
    const LaneWords ten = hn::Set(Words(), 1023u);
    const Lane step(2.0f / 1023.0f), below(-1.0f);
    return unfoldOctahedron(mulAdd(toFloats(hn::And(code, ten)), step, below),
                            mulAdd(toFloats(hn::And(hn::ShiftRight<10>(code), ten)), step, below), length);
}

HWY_INLINE SoftLeaf decodeSoftLeaf(const PageView& view, uint32_t node) {
    // Where each corner lies along the leaf's axis and the two after it.
    alignas(32) static constexpr float kAlong[3][8] = {
        {0, 0, 0, 0, 1, 1, 1, 1}, {0, 1, 0, 1, 0, 1, 0, 1}, {0, 0, 1, 1, 0, 0, 1, 1}};
    SoftLeaf leaf;
    leaf.axis = node >> kSoftAxisShift & 3u;
    leaf.wall = f32::wallTolerance(node);
    leaf.dip = f32::dipBound(node);
    const uint32_t* codes = &view.faces[node & kLeafIndexMask].x;
    const float *x = kAlong[(3 - leaf.axis) % 3], *y = kAlong[(4 - leaf.axis) % 3], *z = kAlong[(5 - leaf.axis) % 3];
    for (int i = 0; i < 8; i += kLanes) {
        const LaneWords code = hn::LoadU(Words(), codes + i);
        const Lane sign = Lane(hn::BitCast(Floats(), hn::And(code, hn::Set(Words(), 1u << 31))));
        const Lane distance = toFloats(hn::And(code, hn::Set(Words(), kPackedDistanceMax))) *
                              Lane(kPackedDistanceRange / float(kPackedDistanceMax));
        const Lane half = Lane(hn::Or(Lane(0.5f).v, sign.v));
        const Lane3 g = decodeDirection(hn::ShiftRight<11>(code), half);
        const Lane signedDistance(hn::Or(distance.v, sign.v));
        store(signedDistance - dot(g, Lane3(load(x + i), load(y + i), load(z + i))), leaf.a + i);
        store(g.x, leaf.gx + i);
        store(g.y, leaf.gy + i);
        store(g.z, leaf.gz + i);
    }
    return leaf;
}

HWY_INLINE Lane3 rotateToAxis(Lane3 x, uint32_t axis) {
    return axis == 0 ? x : axis == 1 ? Lane3(x.y, x.z, x.x) : Lane3(x.z, x.x, x.y);
}

/// restrictToRay of leaf_math.h: from p over p + d, in leaf space.
HWY_INLINE field::RayField restrictToRay(const SoftLeaf& leaf, Lane3 p, Lane3 d) {
    Lane value[8], slope[8];
    for (int i = 0; i < 8; ++i) {
        const Lane3 g(Lane(leaf.gx[i]), Lane(leaf.gy[i]), Lane(leaf.gz[i]));
        value[i] = mulAdd(g.x, p.x, mulAdd(g.y, p.y, mulAdd(g.z, p.z, Lane(leaf.a[i]))));
        slope[i] = dot(g, d);
    }
    return field::blendOnRay(
        Lane4(value[0], value[1], value[2], value[3]), Lane4(slope[0], slope[1], slope[2], slope[3]),
        Lane4(value[4], value[5], value[6], value[7]), Lane4(slope[4], slope[5], slope[6], slope[7]),
        rotateToAxis(p, leaf.axis), rotateToAxis(d, leaf.axis));
}

/// Where rays cross f = 0: u in [0, 1], of those in `hit`.
struct Crossing {
    Lane u;
    Mask hit;
};

/// Halves the bracket between a and b, at which f is fa and fb, by false position (Illinois); firstCrossing's loop.
HWY_INLINE Lane refineCrossing(const field::RayField& ray, Mask active, Lane a, Lane fa, Lane b, Lane fb) {
    const Mask below = fa < Lane(0.0f);
    Lane side(0.0f), found = a;
    for (int i = 0; i <= kRootSteps; ++i) {
        const Lane u = mulAdd(b - a, fa / (fa - fb), a);
        found = select(active, u, found);
        if (i == kRootSteps) break;
        const Lane fu = field::rayValue(ray, u);
        active = active & (abs(fu) > Lane(kRootResidual));
        if (!any(active)) break;
        const Mask movesA = hn::Not((fu < Lane(0.0f)) ^ below);
        const Mask againA = movesA & (side < Lane(0.0f)), againB = without(side > Lane(0.0f), movesA);
        fb = select(movesA, select(againA, fb * Lane(0.5f), fb), fu);
        fa = select(movesA, fu, select(againB, fa * Lane(0.5f), fa));
        a = select(movesA, u, a);
        b = select(movesA, b, u);
        side = select(movesA, Lane(-1.0f), Lane(1.0f));
    }
    return found;
}

/// firstCrossing of leaf_math.h, for the rays in `active`.
HWY_INLINE Crossing firstCrossing(const field::RayField& ray, Mask active, Lane wallIn, Lane wallOut, float dip) {
    const Lane fa = ray.c.x;
    Lane fb = ray.last, b(1.0f);
    const Mask below = fa < Lane(0.0f), atStart = active & (abs(fa) <= wallIn);
    active = without(active, atStart);
    const Mask oneSide = without(active, (fb < Lane(0.0f)) ^ below);
    Mask bracketed = without(active, oneSide);
    Mask atEnd = oneSide & (abs(fb) <= wallOut);
    const Mask look = oneSide & (min(abs(fa), abs(fb)) <= Lane(dip));
    if (any(look)) {
        const Lane fm = field::rayValue(ray, Lane(0.5f));
        const Lane curve = Lane(2.0f) * (fa + fb - Lane(2.0f) * fm);
        const Lane slope = Lane(4.0f) * fm - Lane(3.0f) * fa - fb;
        const Lane turn = -slope / (Lane(2.0f) * curve);
        const Lane ft = field::rayValue(ray, turn);
        const Mask inMiddle = look & ((fm < Lane(0.0f)) ^ below);
        const Mask atTurn =
            without(look, inMiddle) & (turn > Lane(0.0f)) & (turn < Lane(1.0f)) & ((ft < Lane(0.0f)) ^ below);
        b = select(inMiddle, Lane(0.5f), select(atTurn, turn, b));
        fb = select(inMiddle, fm, select(atTurn, ft, fb));
        bracketed = bracketed | inMiddle | atTurn;
        atEnd = without(atEnd, bracketed);
    }
    Lane u = select(atEnd, Lane(1.0f), Lane(0.0f));
    if (any(bracketed)) u = select(bracketed, refineCrossing(ray, bracketed, Lane(0.0f), fa, b, fb), u);
    return {u, atStart | bracketed | atEnd};
}

/// sideBefore of leaf_math.h.
HWY_INLINE Lane sideBefore(const field::RayField& ray, Lane u, Lane3 d) {
    const Lane before = Lane(-0.125f) / sqrt(max(dot(d, d), Lane(1e-12f)));
    return select(u > Lane(0.0f), ray.c.x, field::rayValue(ray, before));
}

/// leafNormal and facingNormal of leaf_math.h, at x in leaf space.
HWY_INLINE Lane3 softNormal(const SoftLeaf& leaf, Lane3 x, Lane3 direction, Lane side) {
    const Lane3 r = rotateToAxis(x, leaf.axis);
    const Lane4 w = field::faceWeights(r.y, r.z);
    const Lane low = Lane(1.0f) - r.x;
    const Lane weights[8] = {w.x * low, w.y * low, w.z * low, w.w * low, w.x * r.x, w.y * r.x, w.z * r.x, w.w * r.x};
    Lane3 n(Lane(0.0f), Lane(0.0f), Lane(0.0f));
    for (int i = 0; i < 8; ++i) n = mulAdd(weights[i], Lane3(Lane(leaf.gx[i]), Lane(leaf.gy[i]), Lane(leaf.gz[i])), n);
    const Lane along = dot(n, direction);
    const Mask grazing = along * along < Lane(0.09f) * dot(n, n) * dot(direction, direction);
    const Mask away = (grazing & (side < Lane(0.0f))) | without(along > Lane(0.0f), grazing);
    return select(away, -n, n);
}

/// Casts the rays of a group through a soft leaf. Returns those that hit, with their hits in the group.
template <bool kIsCut>
HWY_INLINE Mask castSoftLeaf(const SoftLeaf& soft, const LeafRays& leaf, RayGroup& group) {
    const GroupSegment s = segmentIn<kIsCut>(group, leaf);
    if (!any(s.inside)) return s.inside;
    const LeafPart part = partInLeaf(group, s);
    const field::RayField ray = restrictToRay(soft, part.p, part.d);
    // Where a ray begins inside the leaf, that end is no wall.
    const Lane wall(max(Lane(soft.wall), Lane(leaf.rounding)));
    const Lane wallIn = select(s.first > s.kept.begin, wall, Lane(0.0f));
    const Crossing crossing = firstCrossing(ray, s.inside, wallIn, wall, soft.dip);
    const Mask hit = keptHits<kIsCut>(s, crossing.hit, crossing.u);
    if (!any(hit)) return hit;
    const Lane3 at = keepHits(group, leaf, s, part, hit, crossing.u);
    const Lane side = sideBefore(ray, crossing.u, part.d);
    group.side = select(hit, side, group.side);
    group.normal = select(hit, softNormal(soft, at, group.direction, side), group.normal);
    return hit;
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
