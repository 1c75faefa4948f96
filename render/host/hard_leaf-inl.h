// Hard leaves for groups of rays, a lane a ray.
//
// Lanes decide what is clear: rays that miss a triangle by more than the slack, and those that are inside and cross its
// plane steeply. The few others are decided by intersectTriangle of octree/shared/leaf_math.h itself.
#if defined(VCP_RENDER_HOST_HARD_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_HARD_LEAF_INL_H
#undef VCP_RENDER_HOST_HARD_LEAF_INL_H
#else
#define VCP_RENDER_HOST_HARD_LEAF_INL_H
#endif

#include "render/host/triangles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// The rays of a group in a hard leaf; distances in cells of the page, from the rays' starts.
struct GroupInHardLeaf {
    Lane from, first, last;      // where rays enter the leaf; between the others a hit counts
    Lane tau, weightB, weightC;  // the nearest hit so far; `last` is its distance too
    Lane side;                   // 1 where the ray comes from the side of (b - a) x (c - a), else -1
    Mask inside, hit;
    LaneWords triangle;  // what HitLeaf numbers

    HWY_ATTR GroupInHardLeaf() {}  // as RayGroup's
};

template <bool kIsCut>
HWY_INLINE void enterHardLeaf(const RayGroup& group, const LeafRays& leaf, float edge, GroupInHardLeaf& in) {
    const GroupSegment s = segmentIn<kIsCut>(group, leaf);
    const Lane cells(edge), slack(f32::kIntervalSlack);
    in.from = s.first * cells;
    in.first = max(in.from - slack, s.kept.begin * cells);
    in.last = mulAdd(s.last, cells, slack);
    if (kIsCut) in.last = min(in.last, s.kept.end * cells);
    in.tau = in.weightB = in.weightC = Lane(0.0f);
    in.side = Lane(0.0f);
    in.inside = s.inside;
    in.hit = maskOf(0);
    in.triangle = hn::Zero(Words());
}

/// Takes hits where they are nearer than those before. Returns those that are.
HWY_INLINE Mask takeHits(GroupInHardLeaf& in, Mask candidates, Lane tau, Lane weightB, Lane weightC) {
    const Mask taken = candidates & (tau >= in.first) & (tau <= in.last);
    in.tau = select(taken, tau, in.tau);
    in.last = select(taken, tau, in.last);
    in.weightB = select(taken, weightB, in.weightB);
    in.weightC = select(taken, weightC, in.weightC);
    in.hit = in.hit | taken;
    return taken;
}

/// Decides the rays in `doubtful` one by one, in double precision: along a triangle seen nearly edge-on, single
/// precision says little about where it is hit.
inline HWY_NOINLINE Mask castDoubtful(const HardLeaf& leaf, const Triangles& t, int i, const RayGroup& group,
                                      Mask doubtful, GroupInHardLeaf& in) {
    const Lane3 starts = mulAdd(in.from, group.direction,
                                mulAdd(group.column, leaf.startPerX, mulAdd(group.row, leaf.startPerY, leaf.start)));
    alignas(32) float qx[8], qy[8], qz[8], dx[8], dy[8], dz[8], from[8], tau[8] = {}, b[8] = {}, c[8] = {};
    store(starts.x, qx), store(starts.y, qy), store(starts.z, qz);
    store(group.direction.x, dx), store(group.direction.y, dy), store(group.direction.z, dz);
    store(in.from, from);
    const auto vertex = [&](int k) { return glm::dvec3(t.x[k][i], t.y[k][i], t.z[k][i]); };
    uint32_t hits = 0;
    for (uint32_t rest = bitsOf(doubtful); rest != 0; rest &= rest - 1) {
        const int lane = std::countr_zero(rest);
        const glm::dvec3 start(qx[lane], qy[lane], qz[lane]), direction(dx[lane], dy[lane], dz[lane]);
        const double length = glm::length(direction);
        const glm::dvec3 hit =
            f64::intersectTriangle(start, direction / length, vertex(0), vertex(1), vertex(2), double(leaf.slack));
        if (hit.x >= 1e30) continue;
        tau[lane] = from[lane] + float(hit.x / length);
        b[lane] = float(hit.y);
        c[lane] = float(hit.z);
        hits |= 1u << lane;
    }
    return takeHits(in, maskOf(hits), load(tau), load(b), load(c));
}

/// Casts the rays of a group at triangle i. Returns those that it stops, as far as is known.
HWY_INLINE Mask castTriangle(const HardLeaf& leaf, const Triangles& t, int i, const RayGroup& group,
                             GroupInHardLeaf& in) {
    const Lane along = t.along.at(i, group);
    const auto flip = hn::And(along.v, hn::Set(Floats(), -0.0f));
    const Lane a = hn::Xor(t.volume[0].at(i, group).v, flip), b = hn::Xor(t.volume[1].at(i, group).v, flip);
    const Lane c = hn::Xor(t.volume[2].at(i, group).v, flip);
    const Mask near = in.inside & (a >= Lane(t.slack[0][i])) & (b >= Lane(t.slack[1][i])) & (c >= Lane(t.slack[2][i]));
    if (!any(near)) return near;
    const Mask clear = near & (min(a, min(b, c)) >= Lane(0.0f)) & (abs(along) >= Lane(t.steep[i]));
    const Lane scale = Lane(1.0f) / along, positive = abs(scale);
    Mask taken = takeHits(in, clear, t.height.at(i, group) * scale, b * positive, c * positive);
    const Mask doubtful = without(near, clear);
    if (any(doubtful)) taken = taken | castDoubtful(leaf, t, i, group, doubtful, in);
    return taken;
}

/// Notes of the rays in `taken` that triangle i has stopped them. Its number is known.
HWY_INLINE void takeTriangle(const Triangles& t, int i, const RayGroup& group, Mask taken, GroupInHardLeaf& in) {
    const Mask isAway = t.along.at(i, group) > Lane(0.0f);
    in.side = select(taken, select(isAway, Lane(-1.0f), Lane(1.0f)), in.side);
    in.triangle = hn::IfThenElse(hn::RebindMask(Words(), taken), hn::Set(Words(), t.number[i]), in.triangle);
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
