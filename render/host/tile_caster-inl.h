// One traversal of the scene for all rays of a tile: front to back, eight children at a time.
#if defined(VCP_RENDER_HOST_TILE_CASTER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_TILE_CASTER_INL_H
#undef VCP_RENDER_HOST_TILE_CASTER_INL_H
#else
#define VCP_RENDER_HOST_TILE_CASTER_INL_H
#endif

#include "render/host/hard_leaf-inl.h"
#include "render/host/scene_walk-inl.h"
#include "render/host/slab_leaf-inl.h"
#include "render/host/soft_leaf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

constexpr uint32_t kAllGroups = uint32_t((uint64_t{1} << kGroups) - 1);
class TileCaster {
public:
    TileCaster(const HostScene& scene, const TileRays& rays, TileHits& hits)
        : scene_(scene), walk_(scene), rays_(rays), hits_(hits), sides_(tileSides(rays, kGroupHeight)) {
        for (int axis = 0; axis < 3; ++axis) nearOctant_ |= uint32_t(rays.direction[axis] < 0) << axis;
    }

    void run() {
        hits_.any = false;
        hits_.onCap.reset();
        hits_.leaves.clear();
        hits_.widestSlab = 0;
        while (!walk_.isDone() && open_ != 0) {
            const WalkEntry at = walk_.next();
            if (isNode(at))
                visitNode(at);
            else
                visitLeaf(at);
        }
        if (hits_.any) writeHits();
    }

private:
    /// Pushes the children that rays of the tile may meet, the farthest first.
    HWY_INLINE void visitNode(const WalkEntry& at) {
        const double half = 0.5 * cellsOf(at.bits);
        const glm::dvec3 middle = glm::dvec3(at.corner) * kSubcell + half - rays_.origin;
        uint32_t nearest = nearOctant_;
        if (!rays_.isParallel)
            nearest = uint32_t(middle.x < 0) | uint32_t(middle.y < 0) << 1 | uint32_t(middle.z < 0) << 2;
        uint32_t met = childrenMet(glm::vec3(middle), float(0.5 * half));
        if (!rays_.sections.empty()) met &= childrenKept(glm::vec3(middle), float(0.5 * half));
        walk_.pushChildren(at, met, nearest);
    }

    /// Returns which of the octants about `middle` lie between the tile's outermost planes, and not behind its origin.
    /// `half`: of an octant's edge. All in finest cells, relative to the tile's origin.
    [[nodiscard]] uint32_t childrenMet(glm::vec3 middle, float half) const {
        const glm::vec3 ahead(rays_.direction);
        uint32_t met = 0;
        for (int i = 0; i < 8; i += kLanes) {
            const Lane3 c = octantMiddles(i, middle, half);
            const Lane rounding = (abs(c.x) + abs(c.y) + abs(c.z)) * Lane(kPlaceRounding);
            const int lastColumn = kGroupColumns - 1, firstRow = kGroupColumns,
                      lastRow = kGroupColumns + kGroupRows - 1;
            Mask outside = isBelow(sides_.first, 0, c, half, rounding);
            outside = outside | isAbove(sides_.last, lastColumn, c, half, rounding);
            outside = outside | isBelow(sides_.first, firstRow, c, half, rounding);
            outside = outside | isAbove(sides_.last, lastRow, c, half, rounding);
            outside = outside | (dot(c, spread(ahead)) < -mulAdd(Lane(half), Lane(1.7321f), rounding));
            met |= bitsOf(hn::Not(outside)) << i;
        }
        return met;
    }

    static Lane heightOver(const TilePlanes& p, int k, Lane3 c) {
        return mulAdd(c.x, Lane(p.x[k]), mulAdd(c.y, Lane(p.y[k]), mulAdd(c.z, Lane(p.z[k]), Lane(p.w[k]))));
    }
    static Mask isBelow(const TilePlanes& p, int k, Lane3 c, float half, Lane rounding) {
        return heightOver(p, k, c) < -(Lane(half * p.sum[k]) + rounding);
    }
    static Mask isAbove(const TilePlanes& p, int k, Lane3 c, float half, Lane rounding) {
        return heightOver(p, k, c) > Lane(half * p.sum[k]) + rounding;
    }

    /// Returns which of such octants section planes leave a part of.
    [[nodiscard]] HWY_NOINLINE uint32_t childrenKept(glm::vec3 middle, float half) const {
        uint32_t kept = 0;
        for (int i = 0; i < 8; i += kLanes) {
            const Lane3 c = octantMiddles(i, middle, half);
            const Lane rounding = (abs(c.x) + abs(c.y) + abs(c.z)) * Lane(kPlaceRounding);
            Mask isKept = hn::Not(maskOf(0));
            for (const SectionCut& plane : rays_.sections) {
                const glm::vec3 n(plane), size = glm::abs(n);
                const Lane height = dot(c, spread(n)) - Lane(plane.w);
                isKept = isKept & (height >= -(Lane(half * (size.x + size.y + size.z)) + rounding));
            }
            kept |= bitsOf(isKept) << i;
        }
        return kept;
    }

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

    void visitLeaf(const WalkEntry& at) {
        const double edge = cellsOf(at.bits);
        const glm::dvec3 lowest = glm::dvec3(at.corner) * kSubcell - rays_.origin;
        const uint32_t groups = open_ & groupsMet(glm::vec3(lowest + 0.5 * edge), float(0.5 * edge));
        if (groups == 0) return;
        LeafRays leaf = leafRays(rays_, lowest, edge);
        if (!rays_.sections.empty() && !cutLeaf(rays_, lowest, edge, leaf)) return;
        if (!haveRays_) makeGroups();
        if (leaf.cutCount != 0)
            castLeaf<true>(at, leaf, groups);
        else
            castLeaf<false>(at, leaf, groups);
    }

    template <bool kIsCut>
    HWY_INLINE void castLeaf(const WalkEntry& at, const LeafRays& leaf, uint32_t groups) {
        if (nodeType(at.word) == kNodeHard) return castHard<kIsCut>(at, leaf, groups);
        const PageView& view = *scene_.page(at.page).view;
        if (nodeType(at.word) == kNodeSlab) {
            const SlabLeaf slab = decodeSlabLeaf(view, at.word);
            return castGroups(at, groups,
                              [&](RayGroup& group) HWY_ATTR { return castSlabLeaf<kIsCut>(slab, leaf, group); });
        }
        const SoftLeaf soft = decodeSoftLeaf(view, at.word);
        castGroups(at, groups, [&](RayGroup& group) HWY_ATTR { return castSoftLeaf<kIsCut>(soft, leaf, group); });
    }

    void makeGroups() {
        haveRays_ = true;
        for (int i = 0; i < kGroups; ++i) {
            groups_[i] = rayGroup(rays_, hits_.size, i);
            if (!any(groups_[i].alive)) open_ &= ~(1u << i);
        }
    }

    /// Casts groups of rays through one leaf: cast(group) returns the rays that hit.
    template <class Cast>
    void castGroups(const WalkEntry& at, uint32_t groups, const Cast& cast) {
        const auto number = uint32_t(hits_.leaves.size());
        bool found = false;
        for (groups &= open_; groups != 0; groups &= groups - 1) {
            const int i = std::countr_zero(groups);
            const Mask hit = cast(groups_[i]);
            if (!any(hit)) continue;
            found = true;
            finish(i, hit, hn::Set(Words(), number));
        }
        if (!found) return;
        hits_.leaves.push_back({.page = at.page, .node = at.word, .corner = at.corner, .bits = at.bits});
        if (nodeType(at.word) == kNodeSlab) hits_.widestSlab = std::max(hits_.widestSlab, float(cellsOf(at.bits)));
    }

    /// A group's rays in `hit` go no farther.
    void finish(int i, Mask hit, LaneWords leaf) {
        RayGroup& group = groups_[i];
        group.leaf = hn::IfThenElse(hn::RebindMask(Words(), hit), leaf, group.leaf);
        group.alive = without(group.alive, hit);
        if (!any(group.alive)) open_ &= ~(1u << i);
        hits_.any = true;
    }

    template <bool kIsCut>
    void castHard(const WalkEntry& at, const LeafRays& leaf, uint32_t groups) {
        const HostScene::Page& page = scene_.page(at.page);
        const float cell = float(1u << page.cellBits), edge = leaf.edge / cell;
        uint32_t active = 0;
        for (groups &= open_; groups != 0; groups &= groups - 1) {
            const int i = std::countr_zero(groups);
            enterHardLeaf<kIsCut>(groups_[i], leaf, edge, inLeaf_[i]);
            if (any(inLeaf_[i].inside)) active |= 1u << i;
        }
        if (active == 0) return;
        // An eighth of the page's cell is so many of its lattice's steps.
        constexpr int kSteps = kLatticePerCell >> kMaxSubcellDepth;
        const glm::uvec3 inPage = (at.corner - page.corner) >> page.cellBits;
        const HardLeaf hard = hardLeaf(rays_, leaf, glm::ivec3(inPage) * kSteps, edge);
        Triangles triangles;
        for (StripWalk walk(page.view->strips, at.word); nextTriangles(walk, triangles);) {
            setUpTriangles(*page.view, hard, triangles);
            for (uint32_t rest = active; rest != 0; rest &= rest - 1)
                castAtTriangles(at, hard, triangles, std::countr_zero(rest));
        }
        for (; active != 0; active &= active - 1) takeHits(std::countr_zero(active), leaf, cell);
    }

    void castAtTriangles(const WalkEntry& at, const HardLeaf& hard, Triangles& triangles, int i) {
        const RayGroup& group = groups_[i];
        for (uint32_t met = trianglesMet(triangles, i); met != 0; met &= met - 1) {
            const int t = std::countr_zero(met);
            const Mask taken = castTriangle(hard, triangles, t, group, inLeaf_[i]);
            if (!any(taken)) continue;
            if (!triangles.haveNormals) setUpNormals(*scene_.page(at.page).view, triangles);
            if (triangles.number[t] == Triangles::kNoNumber) {
                triangles.number[t] = uint32_t(hits_.leaves.size());
                const auto& corners = triangles.corners;
                hits_.leaves.push_back({at.page, at.word, {corners[0][t], corners[1][t], corners[2][t]}, {}, 0});
            }
            takeTriangle(triangles, t, group, taken, inLeaf_[i]);
        }
    }

    void takeHits(int i, const LeafRays& leaf, float cell) {
        const GroupInHardLeaf& in = inLeaf_[i];
        if (!any(in.hit)) return;
        RayGroup& group = groups_[i];
        group.t = select(in.hit, max(mulAdd(in.tau, Lane(cell), Lane(leaf.distance)), Lane(0.0f)), group.t);
        group.x = select(in.hit, in.weightB, group.x);
        group.y = select(in.hit, in.weightC, group.y);
        group.normal = select(in.hit, in.normal, group.normal);
        finish(i, in.hit, in.triangle);
    }

    void writeHits() {
        // The edge of a cell in two parts, so that depths are rounded once.
        const Lane cell{float(scene_.grid().cell)}, rest{scene_.grid().cell - double(float(scene_.grid().cell))};
        for (int i = 0; i < kGroups; ++i) {
            const RayGroup& group = groups_[i];
            const int at = i / kGroupColumns * kGroupHeight * kTileWidth + i % kGroupColumns * kGroupWidth;
            const Mask missed = group.t >= Lane(hwy::HighestValue<float>());
            const Lane depth = mulAdd(group.t, cell, group.t * mulAdd(cell, lengthAboveOne(group), rest));
            writeRows(select(missed, Lane(std::numeric_limits<float>::infinity()), depth), hits_.depth + at);
            writeRows(group.x, hits_.x + at);
            writeRows(group.y, hits_.y + at);
            writeRows(group.z, hits_.z + at);
            writeRows(group.side, hits_.side + at);
            writeRows(group.normal.x, hits_.normalX + at);
            writeRows(group.normal.y, hits_.normalY + at);
            writeRows(group.normal.z, hits_.normalZ + at);
            writeRows(Lane(hn::BitCast(Floats(), group.leaf)), reinterpret_cast<float*>(hits_.leaf) + at);
        }
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

    static void writeRows(Lane lanes, float* first) {
        alignas(32) float numbers[8];
        store(lanes, numbers);
        for (int row = 0; row < kGroupHeight; ++row)
            std::copy_n(numbers + row * kGroupWidth, kGroupWidth, first + row * kTileWidth);
    }

    const HostScene& scene_;
    SceneWalk walk_;
    const TileRays& rays_;
    TileHits& hits_;
    const TileSides sides_;
    uint32_t nearOctant_ = 0;     // of parallel rays
    uint32_t open_ = kAllGroups;  // groups with rays that are alive
    bool haveRays_ = false;
    RayGroup groups_[kGroups];
    GroupInHardLeaf inLeaf_[kGroups];
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
