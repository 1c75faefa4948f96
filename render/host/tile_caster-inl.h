// The rays of a tile of a picture, from the eye, and their hits.
#if defined(VCP_RENDER_HOST_TILE_CASTER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_TILE_CASTER_INL_H
#undef VCP_RENDER_HOST_TILE_CASTER_INL_H
#else
#define VCP_RENDER_HOST_TILE_CASTER_INL_H
#endif

#include "render/host/tile_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

class TileCaster : public TileWalk<TileCaster> {
public:
    TileCaster(const HostScene& scene, const TileRays& rays, TileHits& hits)
        : TileWalk(scene, rays, tileSides(rays, kGroupHeight)), hits_(hits) {}

    void run() {
        hits_.any = false;
        hits_.onCap.reset();
        hits_.leaves.clear();
        hits_.widestSlab = 0;
        walk();
        if (hits_.work)
            for (int i = 0; i < kGroups; ++i) countUntil(i, haveRays_ ? groups_[i].alive : hn::Not(maskOf(0)));
        hits_.any = !hits_.leaves.empty();
        if (hits_.any) writeHits();
    }

private:
    friend TileWalk<TileCaster>;

    /// Returns the groups with rays that may meet a box; arguments as those of childrenMet.
    [[nodiscard]] uint32_t groupsMet(glm::vec3 middle, float half) const {
        const float rounding = (std::abs(middle.x) + std::abs(middle.y) + std::abs(middle.z)) * kPlaceRounding;
        const Lane3 c = spread(middle);
        uint32_t inside = 0;
        for (int i = 0; i < kGroupColumns + kGroupRows; i += kLanes) {
            const TilePlanes &first = sides_.first, &last = sides_.last;
            const auto height = [&](const TilePlanes& p) HWY_ATTR {
                return mulAdd(c.x, load(p.x + i),
                              mulAdd(c.y, load(p.y + i), mulAdd(c.z, load(p.z + i), load(p.w + i))));
            };
            const Mask below = height(first) < -mulAdd(load(first.sum + i), Lane(half), Lane(rounding));
            const Mask above = height(last) > mulAdd(load(last.sum + i), Lane(half), Lane(rounding));
            inside |= bitsOf(hn::Not(below | above)) << i;
        }
        const uint32_t columns = inside & ((1u << kGroupColumns) - 1);
        uint32_t groups = 0;
        for (int row = 0; row < kGroupRows; ++row)
            groups |= (inside >> (kGroupColumns + row) & 1) * columns << (row * kGroupColumns);
        return groups;
    }

    void makeGroups() {
        for (int i = 0; i < kGroups; ++i) {
            groups_[i] = rayGroup(rays_, hits_.size, i);
            if (!any(groups_[i].alive)) open_ &= ~(1u << i);
        }
    }

    [[nodiscard]] uint32_t nextLeaf() const { return uint32_t(hits_.leaves.size()); }
    void keepLeaf(const WalkEntry& at) {
        hits_.leaves.push_back({.page = at.page, .node = at.word, .corner = at.corner, .bits = at.bits});
        if (nodeType(at.word) == kNodeSlab) hits_.widestSlab = std::max(hits_.widestSlab, float(cellsOf(at.bits)));
    }
    /// Notes that triangle t has stopped the rays in `taken`.
    HWY_INLINE void keepTriangle(const WalkEntry& at, Triangles& triangles, int t, const RayGroup& group, Mask taken,
                                 GroupInHardLeaf& in) {
        if (triangles.number[t] == Triangles::kNoNumber) {
            triangles.number[t] = nextLeaf();
            const auto& corners = triangles.corners;
            const auto& flat = triangles.flat;
            hits_.leaves.push_back({.page = at.page,
                                    .node = at.word,
                                    .corners = {corners[0][t], corners[1][t], corners[2][t]},
                                    .flat = {flat[0][t], flat[1][t], flat[2][t]}});
        }
        takeTriangle(triangles, t, group, taken, in);
    }

    HWY_INLINE void countNode(glm::vec3 middle, float half) {
        if (!hits_.work) return;
        for (uint32_t groups = open_ & groupsMet(middle, half); groups != 0; groups &= groups - 1)
            ++nodes_[std::countr_zero(groups)];
    }
    HWY_INLINE void count(uint32_t groups, uint32_t leaves, uint32_t reads) {
        if (!hits_.work) return;
        for (; groups != 0; groups &= groups - 1) {
            leaves_[std::countr_zero(groups)] += leaves;
            reads_[std::countr_zero(groups)] += reads;
        }
    }
    HWY_INLINE void countUntil(int i, Mask rays) {
        if (hits_.work) writeWork(i, bitsOf(rays));
    }
    HWY_NOINLINE void writeWork(int i, uint32_t rays) {
        for (; rays != 0; rays &= rays - 1) {
            const int lane = std::countr_zero(rays),
                      at = firstOf(i) + lane / kGroupWidth * kTileWidth + lane % kGroupWidth;
            hits_.work->steps[at] = nodes_[i];
            hits_.work->cells[at] = leaves_[i];
            hits_.work->fetches[at] = nodes_[i] + reads_[i];
        }
    }

    void writeHits() {
        const auto isOnTriangles = [](const RayGroup& group) HWY_ATTR { return any(group.onTriangle); };
        if (std::any_of(groups_, groups_ + kGroups, isOnTriangles)) normals_.find(scene_, hits_.leaves);
        // The edge of a cell in two parts, so that depths are rounded once.
        const Lane cell{float(scene_.grid().cell)}, rest{scene_.grid().cell - double(float(scene_.grid().cell))};
        for (int i = 0; i < kGroups; ++i) {
            const RayGroup& group = groups_[i];
            const int at = firstOf(i);
            const Mask missed = group.t >= Lane(hwy::HighestValue<float>());
            const Lane depth = mulAdd(group.t, cell, group.t * mulAdd(cell, lengthAboveOne(group), rest));
            writeRows(select(missed, Lane(std::numeric_limits<float>::infinity()), depth), hits_.depth + at);
            writeRows(group.x, hits_.x + at);
            writeRows(group.y, hits_.y + at);
            writeRows(group.z, hits_.z + at);
            writeRows(group.side, hits_.side + at);
            const Lane3 normal = normalOf(group);
            writeRows(normal.x, hits_.normalX + at);
            writeRows(normal.y, hits_.normalY + at);
            writeRows(normal.z, hits_.normalZ + at);
            writeRows(Lane(hn::BitCast(Floats(), group.leaf)), reinterpret_cast<float*>(hits_.leaf) + at);
        }
    }

    [[nodiscard]] HWY_INLINE Lane3 normalOf(const RayGroup& group) const {
        if (!any(group.onTriangle)) return group.normal;
        const LaneWords numbers = hn::IfThenElseZero(hn::RebindMask(Words(), group.onTriangle), group.leaf);
        return select(group.onTriangle, group.side * normals_.at(numbers, group.x, group.y), group.normal);
    }

    /// Returns by how much a group's directions are longer than the tile's middle one, which has unit length.
    [[nodiscard]] Lane lengthAboveOne(const RayGroup& group) const {
        const glm::dvec3 &d = rays_.direction, &x = rays_.directionPerX, &y = rays_.directionPerY;
        const Lane i = group.column, j = group.row;
        const Lane ofX = mulAdd(i, Lane(glm::dot(x, x)), Lane(2 * glm::dot(d, x)));
        const Lane ofY = mulAdd(j, Lane(glm::dot(y, y)), mulAdd(i, Lane(2 * glm::dot(x, y)), Lane(2 * glm::dot(d, y))));
        const Lane square = mulAdd(i, ofX, j * ofY);
        return square / (Lane(1.0f) + sqrt(Lane(1.0f) + square));
    }

    /// Returns the element of a tile's arrays that a group's first ray has.
    static int firstOf(int group) {
        return group / kGroupColumns * kGroupHeight * kTileWidth + group % kGroupColumns * kGroupWidth;
    }

    static void writeRows(Lane lanes, float* first) {
        alignas(32) float numbers[8];
        store(lanes, numbers);
        for (int row = 0; row < kGroupHeight; ++row)
            std::copy_n(numbers + row * kGroupWidth, kGroupWidth, first + row * kTileWidth);
    }

    TileHits& hits_;
    TriangleNormals normals_;
    uint32_t nodes_[kGroups] = {}, leaves_[kGroups] = {}, reads_[kGroups] = {};  // of each group
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
