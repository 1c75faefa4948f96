// Hard leaves for groups of rays: triangles are set up once a tile, a lane a triangle, then met by a lane a ray.
//
// Along the rays of a tile, the volumes that intersectTriangle of octree/shared/leaf_math.h compares are linear in the
// pixel's place: their three coefficients are found once a triangle. Lanes decide what is clear: rays that miss by more
// than the slack, and those that are inside and cross the triangle's plane steeply. All others, some in ten thousand,
// are decided by intersectTriangle itself.
#if defined(VCP_RENDER_HOST_HARD_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_HARD_LEAF_INL_H
#undef VCP_RENDER_HOST_HARD_LEAF_INL_H
#else
#define VCP_RENDER_HOST_HARD_LEAF_INL_H
#endif

#include <algorithm>

#include "octree/surface/leaf_math.h"
#include "render/host/ray_group-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// The least |n . d| over |ab| |ac| at which lanes decide a hit: where it is less, a triangle is narrow or seen nearly
/// edge-on.
constexpr float kSteep = 0.02f;

/// A hard leaf as rays meet it: in cells of its page, from a point near to the leaf.
struct HardLeaf {
    glm::ivec3 corner;                  // lowest corner, steps of the page's lattice from the page's
    Lane3 start, startPerX, startPerY;  // of the rays, from that corner
    Lane3 direction, directionPerX, directionPerY;
    Lane3 turnX, turnY;  // direction x startPerX, direction x startPerY
    float slack;         // by so much triangles are widened
};

HWY_INLINE HardLeaf hardLeaf(const TileRays& rays, const LeafRays& leaf, glm::ivec3 corner, float edge) {
    HardLeaf h;
    h.corner = corner;
    h.start = spread(leaf.start * edge);
    h.startPerX = spread(leaf.startPerX * edge);
    h.startPerY = spread(leaf.startPerY * edge);
    h.direction = spread(rays.direction);
    h.directionPerX = spread(rays.directionPerX);
    h.directionPerY = spread(rays.directionPerY);
    h.turnX = cross(h.direction, h.startPerX);
    h.turnY = cross(h.direction, h.startPerY);
    h.slack = f32::kTriangleSlack + leaf.rounding * edge;
    return h;
}

/// A number that is linear in the pixel's place, for each of several triangles.
struct LinearSums {
    alignas(32) float middle[8], perX[8], perY[8];

    HWY_INLINE void set(Lane m, Lane x, Lane y) {
        store(m, middle);
        store(x, perX);
        store(y, perY);
    }
    [[nodiscard]] HWY_INLINE Lane at(int triangle, const RayGroup& group) const {
        return mulAdd(group.column, Lane(perX[triangle]),
                      mulAdd(group.row, Lane(perY[triangle]), Lane(middle[triangle])));
    }
};

/// Up to kLanes triangles of a hard leaf. `volume[k]`: of the ray with the edge opposite vertex k; all three have the
/// sign of `along` inside. height / along: distance to the plane.
struct Triangles {
    int count;
    LinearSums volume[3], along, height;
    alignas(32) float slack[3][8];                // of volumes
    alignas(32) float steep[8];                   // the least |along| that is clear
    alignas(32) float x[3][8], y[3][8], z[3][8];  // vertices, as in HardLeaf
    Index3 corners[8];
};

HWY_INLINE LaneWords field21(LaneWords word) { return hn::And(word, hn::Set(Words(), kField21Mask)); }

/// decodeVertex of leaf_math.h, from a corner of the leaf: exact.
HWY_INLINE Lane3 decodeVertices(const uint32_t* low, const uint32_t* high, glm::ivec3 corner) {
    const LaneWords lo = hn::Load(Words(), low), hi = hn::Load(Words(), high);
    const LaneWords y = hn::Or(hn::ShiftRight<21>(lo), hn::ShiftLeft<11>(hn::And(hi, hn::Set(Words(), 0x3ffu))));
    const glm::uvec3 from = glm::uvec3(corner + kLatticeBias);
    const Lane cell(1.0f / float(kLatticePerCell));
    return {toFloats(hn::Sub(field21(lo), hn::Set(Words(), from.x))) * cell,
            toFloats(hn::Sub(y, hn::Set(Words(), from.y))) * cell,
            toFloats(hn::Sub(field21(hn::ShiftRight<10>(hi)), hn::Set(Words(), from.z))) * cell};
}

/// Finds the sums of triangles whose corners are known.
HWY_INLINE void setUpTriangles(const PageView& view, const HardLeaf& leaf, Triangles& t) {
    Lane3 p[3];
    for (int k = 0; k < 3; ++k) {
        alignas(32) uint32_t low[8], high[8];
        for (int i = 0; i < kLanes; ++i) {
            const glm::u32vec2 vertex = view.vertices[t.corners[std::min(i, t.count - 1)][size_t(k)]];
            low[i] = vertex.x;
            high[i] = vertex.y;
        }
        p[k] = decodeVertices(low, high, leaf.corner);
        store(p[k].x, t.x[k]);
        store(p[k].y, t.y[k]);
        store(p[k].z, t.z[k]);
    }
    Lane edgeLength2[3];
    for (int k = 0; k < 3; ++k) {
        const Lane3 from = p[(k + 1) % 3] - leaf.start, e = p[(k + 2) % 3] - p[(k + 1) % 3], moment = cross(from, e);
        edgeLength2[k] = dot(e, e);
        t.volume[k].set(dot(leaf.direction, moment), dot(leaf.directionPerX, moment) - dot(e, leaf.turnX),
                        dot(leaf.directionPerY, moment) - dot(e, leaf.turnY));
        store(Lane(-leaf.slack) * sqrt(edgeLength2[k]), t.slack[k]);
    }
    const Lane3 n = cross(p[1] - p[0], p[2] - p[0]);
    t.along.set(dot(n, leaf.direction), dot(n, leaf.directionPerX), dot(n, leaf.directionPerY));
    t.height.set(dot(n, p[0] - leaf.start), -dot(n, leaf.startPerX), -dot(n, leaf.startPerY));
    store(Lane(kSteep) * sqrt(edgeLength2[1] * edgeLength2[2]), t.steep);
}

/// The rays of a group in a hard leaf; distances in cells of the page, from the rays' starts.
struct GroupInHardLeaf {
    Lane from, first, last;      // where rays enter the leaf; between the others a hit counts
    Lane tau, weightB, weightC;  // the nearest hit so far; `last` is its distance too
    Mask inside, hit;
    LaneWords triangle;  // what HitLeaf numbers
};

HWY_INLINE GroupInHardLeaf enterHardLeaf(const RayGroup& group, const LeafRays& leaf, float edge) {
    const GroupSegment s = segmentIn(group, leaf);
    GroupInHardLeaf in;
    const Lane cells(edge), slack(f32::kIntervalSlack);
    in.from = s.first * cells;
    in.first = max(in.from - slack, Lane(leaf.tauMin) * cells);
    in.last = mulAdd(s.last, cells, slack);
    in.tau = in.weightB = in.weightC = Lane(0.0f);
    in.inside = s.inside;
    in.hit = maskOf(0);
    in.triangle = hn::Zero(Words());
    return in;
}

/// Takes a triangle's hits where they are nearer than those before. Returns those that are.
HWY_INLINE Mask takeHits(GroupInHardLeaf& in, Mask candidates, Lane tau, Lane weightB, Lane weightC, uint32_t number) {
    const Mask taken = candidates & (tau >= in.first) & (tau <= in.last);
    in.tau = select(taken, tau, in.tau);
    in.last = select(taken, tau, in.last);
    in.weightB = select(taken, weightB, in.weightB);
    in.weightC = select(taken, weightC, in.weightC);
    in.triangle = hn::IfThenElse(hn::RebindMask(Words(), taken), hn::Set(Words(), number), in.triangle);
    in.hit = in.hit | taken;
    return taken;
}

/// Decides the rays in `doubtful` one by one.
HWY_NOINLINE Mask castDoubtful(const HardLeaf& leaf, const Triangles& t, int i, const RayGroup& group, Mask doubtful,
                               uint32_t number, GroupInHardLeaf& in) {
    const Lane3 starts = mulAdd(in.from, group.direction,
                                mulAdd(group.column, leaf.startPerX, mulAdd(group.row, leaf.startPerY, leaf.start)));
    alignas(32) float qx[8], qy[8], qz[8], dx[8], dy[8], dz[8], from[8], tau[8] = {}, b[8] = {}, c[8] = {};
    store(starts.x, qx), store(starts.y, qy), store(starts.z, qz);
    store(group.direction.x, dx), store(group.direction.y, dy), store(group.direction.z, dz);
    store(in.from, from);
    uint32_t hits = 0;
    for (uint32_t rest = bitsOf(doubtful); rest != 0; rest &= rest - 1) {
        const int lane = std::countr_zero(rest);
        const auto vertex = [&](int k) { return glm::vec3(t.x[k][i], t.y[k][i], t.z[k][i]); };
        const glm::vec3 hit =
            f32::intersectTriangle(glm::vec3(qx[lane], qy[lane], qz[lane]), glm::vec3(dx[lane], dy[lane], dz[lane]),
                                   vertex(0), vertex(1), vertex(2), leaf.slack);
        if (hit.x >= 1e30f) continue;
        tau[lane] = from[lane] + hit.x;
        b[lane] = hit.y;
        c[lane] = hit.z;
        hits |= 1u << lane;
    }
    return takeHits(in, maskOf(hits), load(tau), load(b), load(c), number);
}

/// Casts the rays of a group at triangle i. Returns those that it stops, as far as is known.
HWY_INLINE Mask castTriangle(const HardLeaf& leaf, const Triangles& t, int i, const RayGroup& group, uint32_t number,
                             GroupInHardLeaf& in) {
    const Lane along = t.along.at(i, group);
    const auto flip = hn::And(along.v, hn::Set(Floats(), -0.0f));
    const Lane a = hn::Xor(t.volume[0].at(i, group).v, flip), b = hn::Xor(t.volume[1].at(i, group).v, flip);
    const Lane c = hn::Xor(t.volume[2].at(i, group).v, flip);
    const Mask near = in.inside & (a >= Lane(t.slack[0][i])) & (b >= Lane(t.slack[1][i])) & (c >= Lane(t.slack[2][i]));
    if (!any(near)) return near;
    const Mask clear = near & (min(a, min(b, c)) >= Lane(0.0f)) & (abs(along) >= Lane(t.steep[i]));
    const Lane scale = Lane(1.0f) / along, positive = abs(scale);
    Mask taken = takeHits(in, clear, t.height.at(i, group) * scale, b * positive, c * positive, number);
    const Mask doubtful = without(near, clear);
    if (any(doubtful)) taken = taken | castDoubtful(leaf, t, i, group, doubtful, number, in);
    return taken;
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
