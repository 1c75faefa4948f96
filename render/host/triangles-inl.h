// The triangles of a hard leaf, set up for the rays of a tile: a lane a triangle.
//
// Along the rays of a tile, the volumes that intersectTriangle of octree/shared/leaf_math.h compares are linear in the
// pixel's place: their three coefficients are found once a triangle.
#if defined(VCP_RENDER_HOST_TRIANGLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_TRIANGLES_INL_H
#undef VCP_RENDER_HOST_TRIANGLES_INL_H
#else
#define VCP_RENDER_HOST_TRIANGLES_INL_H
#endif

#include <algorithm>
#include <span>
#include <vector>

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
    Lane3 turnX, turnY;   // direction x startPerX, direction x startPerY
    float slack;          // by so much triangles are widened
    glm::vec2 halfGroup;  // how far rays of a group are from its middle at most, pixels
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
    h.halfGroup = rays.halfGroup;
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

/// The vertices of up to kLanes triangles of a hard leaf.
struct TriangleVertices {
    int count;
    alignas(32) uint32_t corners[3][8];           // vertices a, b and c in the page
    alignas(32) float x[3][8], y[3][8], z[3][8];  // vertices, as in HardLeaf
};

/// Up to kLanes triangles of a hard leaf. `volume[k]`: of the ray with the edge opposite vertex k; all three have the
/// sign of `along` inside. height / along: distance to the plane.
struct Triangles : TriangleVertices {
    static constexpr uint32_t kNoNumber = ~0u;

    uint32_t number[8];  // as of TriangleNormals, once a ray has hit
    LinearSums volume[3], along, height;
    alignas(32) float slack[3][8];   // a ray misses where a volume is below that, which is less than 0
    alignas(32) float lowest[3][8];  // all rays of a group miss where their middle's volume is below that
    alignas(32) float reach[8];      // by so much `along` differs in a group from its middle's
    alignas(32) float steep[8];      // the least |along| that is clear
    alignas(32) float flat[3][8];    // (b - a) x (c - a)
};

HWY_INLINE LaneWords field21(LaneWords word) { return hn::And(word, hn::Set(Words(), kField21Mask)); }

/// decodeVertex of leaf_math.h, from a corner of the leaf: exact.
HWY_INLINE Lane3 decodeVertices(LaneWords lo, LaneWords hi, glm::ivec3 corner) {
    const LaneWords y = hn::Or(hn::ShiftRight<21>(lo), hn::ShiftLeft<11>(hn::And(hi, hn::Set(Words(), 0x3ffu))));
    const glm::uvec3 from = glm::uvec3(corner + kLatticeBias);
    const Lane cell(1.0f / float(kLatticePerCell));
    return {toFloats(hn::Sub(field21(lo), hn::Set(Words(), from.x))) * cell,
            toFloats(hn::Sub(y, hn::Set(Words(), from.y))) * cell,
            toFloats(hn::Sub(field21(hn::ShiftRight<10>(hi)), hn::Set(Words(), from.z))) * cell};
}

/// Takes the next triangles of a leaf. Returns false where there are none left.
HWY_INLINE bool nextTriangles(StripWalk& walk, TriangleVertices& t) {
    t.count = 0;
    for (Index3 corners{}; t.count < kLanes && walk.next(); ++t.count) {
        corners = walk.triangle();
        for (size_t k = 0; k < 3; ++k) t.corners[k][t.count] = corners[k];
    }
    if (t.count == 0) return false;
    for (int k = 0; k < 3; ++k) std::fill(t.corners[k] + t.count, t.corners[k] + kLanes, t.corners[k][t.count - 1]);
    return true;
}

HWY_INLINE Lane3 vertexOf(const TriangleVertices& t, int k) { return {load(t.x[k]), load(t.y[k]), load(t.z[k])}; }

/// Reads the vertices of triangles whose corners are known. `corner`: as of HardLeaf.
HWY_INLINE void loadVertices(const PageView& view, glm::ivec3 corner, TriangleVertices& t) {
    for (int k = 0; k < 3; ++k) {
        const LaneWords twice = hn::ShiftLeft<1>(hn::Load(Words(), t.corners[k]));
        const uint32_t* words = &view.vertices.data()->x;
        const Lane3 p = decodeVertices(gather(words, twice), gather(words + 1, twice), corner);
        store(p.x, t.x[k]);
        store(p.y, t.y[k]);
        store(p.z, t.z[k]);
    }
}

/// Finds the sums of triangles whose corners are known.
HWY_INLINE void setUpTriangles(const PageView& view, const HardLeaf& leaf, Triangles& t) {
    loadVertices(view, leaf.corner, t);
    const Lane3 p[3] = {vertexOf(t, 0), vertexOf(t, 1), vertexOf(t, 2)};
    Lane length[3];
    for (int k = 0; k < 3; ++k) {
        const Lane3 from = p[(k + 1) % 3] - leaf.start, e = p[(k + 2) % 3] - p[(k + 1) % 3], moment = cross(from, e);
        const Lane perX = dot(leaf.directionPerX, moment) - dot(e, leaf.turnX);
        const Lane perY = dot(leaf.directionPerY, moment) - dot(e, leaf.turnY);
        length[k] = sqrt(dot(e, e));
        const Lane slack = Lane(-leaf.slack) * length[k];
        t.volume[k].set(dot(leaf.direction, moment), perX, perY);
        store(slack, t.slack[k]);
        store(Lane(2.0f) * slack - reachInGroup(perX, perY, leaf.halfGroup), t.lowest[k]);
    }
    const Lane3 n = cross(p[1] - p[0], p[2] - p[0]);
    const Lane perX = dot(n, leaf.directionPerX), perY = dot(n, leaf.directionPerY);
    t.along.set(dot(n, leaf.direction), perX, perY);
    store(Lane(1.001f) * reachInGroup(perX, perY, leaf.halfGroup), t.reach);
    t.height.set(dot(n, p[0] - leaf.start), -dot(n, leaf.startPerX), -dot(n, leaf.startPerY));
    store(Lane(kSteep) * length[1] * length[2], t.steep);
    storeLanes(n, t.flat);
    std::fill_n(t.number, kLanes, Triangles::kNoNumber);
}

/// decodeNormal of leaf_math.h.
HWY_INLINE Lane3 decodeNormals(LaneWords code) {
    const Lane below(-1.0f);
    return unfoldOctahedron(mulAdd(toFloats(hn::And(code, hn::Set(Words(), 0xfffeu))), Lane(2.0f / 65534.0f), below),
                            mulAdd(toFloats(hn::ShiftRight<16>(code)), Lane(2.0f / 65535.0f), below), Lane(1.0f));
}

/// Returns the normals that are blended from vertices: their own, on the side of the triangle's, `flat`, or at a crease
/// that.
HWY_INLINE Lane3 vertexNormals(LaneWords code, Lane3 flat) {
    const LaneWords bit = hn::Set(Words(), kNormalCreaseBit);
    const Mask isCrease = hn::RebindMask(Floats(), hn::Eq(hn::And(code, bit), bit));
    const Lane3 smooth = decodeNormals(code);
    return select(isCrease, flat, select(dot(smooth, flat) < Lane(0.0f), -smooth, smooth));
}

/// Normals of the triangles that rays of a tile hit, which are numbered as TileHits::leaves are.
class TriangleNormals {
public:
    /// Finds the normals at the vertices of all.
    HWY_NOINLINE void find(const HostScene& scene, std::span<const HitLeaf> leaves) {
        room_ = (leaves.size() + kLanes - 1) / kLanes * kLanes;
        normals_.resize(9 * room_);
        for (size_t first = 0; first < room_; first += kLanes) {
            alignas(32) uint32_t codes[3][8] = {};
            alignas(32) float flats[3][8] = {};
            for (size_t i = first; i < std::min(first + kLanes, leaves.size()); ++i) {
                if (nodeType(leaves[i].node) != kNodeHard) continue;
                const std::span<const uint32_t> normals = scene.page(leaves[i].page).view->normals;
                for (size_t k = 0; k < 3; ++k) {
                    codes[k][i - first] = normals[leaves[i].corners[k]];
                    flats[k][i - first] = leaves[i].flat[int(k)];
                }
            }
            Lane3 flat = loadLanes(flats), normals[3];
            flat = (Lane(1.0f) / sqrt(max(dot(flat, flat), Lane(1e-30f)))) * flat;
            for (size_t k = 0; k < 3; ++k) normals[k] = vertexNormals(hn::Load(Words(), codes[k]), flat);
            const Lane3 kept[3] = {normals[0], normals[1] - normals[0], normals[2] - normals[0]};
            for (size_t k = 0; k < 3; ++k) {
                float* to = &normals_[3 * k * room_ + first];
                hn::StoreU(kept[k].x.v, Floats(), to);
                hn::StoreU(kept[k].y.v, Floats(), to + room_);
                hn::StoreU(kept[k].z.v, Floats(), to + 2 * room_);
            }
        }
    }

    /// Returns the normals at points of triangles, on the side of `flat`. `b`, `c`: the weights of the vertices.
    [[nodiscard]] HWY_INLINE Lane3 at(LaneWords numbers, Lane b, Lane c) const {
        const auto kept = [&](size_t k) HWY_ATTR {
            const float* from = &normals_[3 * k * room_];
            return Lane3(gatherFloats(from, numbers), gatherFloats(from + room_, numbers),
                         gatherFloats(from + 2 * room_, numbers));
        };
        return mulAdd(b, kept(1), mulAdd(c, kept(2), kept(0)));
    }

private:
    size_t room_ = 0;
    // Of vertex a, then the differences of b's and c's from it: x, y and z, room_ numbers each.
    std::vector<float> normals_;
};

/// Returns which triangles a ray of a group may meet: bit i is triangle i.
HWY_INLINE uint32_t trianglesMet(const Triangles& t, const RayGroup& group) {
    const Lane column(group.middleColumn), row(group.middleRow);
    const auto middle = [&](const LinearSums& sums) HWY_ATTR {
        return mulAdd(column, load(sums.perX), mulAdd(row, load(sums.perY), load(sums.middle)));
    };
    const Lane along = middle(t.along);
    const auto flip = hn::And(along.v, hn::Set(Floats(), -0.0f));
    Mask inside = Lane(hn::Xor(middle(t.volume[0]).v, flip)) >= load(t.lowest[0]);
    inside = inside & (Lane(hn::Xor(middle(t.volume[1]).v, flip)) >= load(t.lowest[1]));
    inside = inside & (Lane(hn::Xor(middle(t.volume[2]).v, flip)) >= load(t.lowest[2]));
    const Mask isEitherSide = abs(along) <= load(t.reach);
    return bitsOf(inside | isEitherSide) & ((1u << t.count) - 1);
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
