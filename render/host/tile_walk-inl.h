// One traversal of the scene for all rays of a tile: front to back, eight children at a time. What the rays are, and
// what becomes of their hits, says the class that is derived from it.
#if defined(VCP_RENDER_HOST_TILE_WALK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_TILE_WALK_INL_H
#undef VCP_RENDER_HOST_TILE_WALK_INL_H
#else
#define VCP_RENDER_HOST_TILE_WALK_INL_H
#endif

#include "render/host/hard_leaf-inl.h"
#include "render/host/scene_walk-inl.h"
#include "render/host/slab_leaf-inl.h"
#include "render/host/soft_leaf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

constexpr uint32_t kAllGroups = uint32_t((uint64_t{1} << kGroups) - 1);

/// `Tile`: has groupsMet(middle, half), the groups with rays that may meet a box (arguments as those of childrenMet);
/// makeGroups(), which fills groups_ before the first leaf; keepLeaf(at), for a leaf that rays hit, which gives its
/// number; keepTriangle(...), for a triangle that rays hit; countNode(middle, half), count(groups, leaves, reads) and
/// countUntil(i, rays), for the boxes of nodes, what groups are cast at, and rays of a group that have hit.
template <class Tile>
class TileWalk {
protected:
    TileWalk(const HostScene& scene, const TileRays& rays, const TileSides& sides)
        : scene_(scene), walk_(scene), rays_(rays), sides_(sides) {
        for (int axis = 0; axis < 3; ++axis) nearOctant_ |= uint32_t(rays.direction[axis] < 0) << axis;
    }

    /// Visits what the rays meet, until all have hit.
    void walk() {
        while (!walk_.isDone() && open_ != 0) {
            const WalkEntry at = walk_.next();
            if (isNode(at))
                visitNode(at);
            else
                visitLeaf(at);
        }
    }

private:
    /// Pushes the children that rays of the tile may meet, the farthest first.
    HWY_INLINE void visitNode(const WalkEntry& at) {
        const double half = 0.5 * cellsOf(at.bits);
        const glm::dvec3 middle = glm::dvec3(at.corner) * kSubcell + half - rays_.origin;
        tile().countNode(glm::vec3(middle), float(half));
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

    void visitLeaf(const WalkEntry& at) {
        const double edge = cellsOf(at.bits);
        const glm::dvec3 lowest = glm::dvec3(at.corner) * kSubcell - rays_.origin;
        const uint32_t groups = open_ & tile().groupsMet(glm::vec3(lowest + 0.5 * edge), float(0.5 * edge));
        if (groups == 0) return;
        LeafRays leaf = leafRays(rays_, lowest, edge);
        if (!rays_.sections.empty() && !cutLeaf(rays_, lowest, edge, leaf)) return;
        if (!haveRays_) tile().makeGroups();
        haveRays_ = true;
        if (leaf.cutCount != 0 || leaf.hasSpans)
            castLeaf<true>(at, leaf, groups);
        else
            castLeaf<false>(at, leaf, groups);
    }

    template <bool kIsCut>
    HWY_INLINE void castLeaf(const WalkEntry& at, const LeafRays& leaf, uint32_t groups) {
        if (nodeType(at.word) == kNodeHard) return castHard<kIsCut>(at, leaf, groups);
        const PageView& view = *scene_.page(at.page).view;
        if (nodeType(at.word) == kNodeSlab) {
            tile().count(groups, 1, 1);
            const SlabLeaf slab = decodeSlabLeaf(view, at.word);
            return castGroups(at, groups,
                              [&](RayGroup& group) HWY_ATTR { return castSlabLeaf<kIsCut>(slab, leaf, group); });
        }
        tile().count(groups, 1, 2);
        const SoftLeaf soft = decodeSoftLeaf(view, at.word);
        castGroups(at, groups, [&](RayGroup& group) HWY_ATTR { return castSoftLeaf<kIsCut>(soft, leaf, group); });
    }

    /// Casts groups of rays through one leaf: cast(group) returns the rays that hit.
    template <class Cast>
    void castGroups(const WalkEntry& at, uint32_t groups, const Cast& cast) {
        const uint32_t number = tile().nextLeaf();
        bool found = false;
        for (groups &= open_; groups != 0; groups &= groups - 1) {
            const int i = std::countr_zero(groups);
            const Mask hit = cast(groups_[i]);
            if (!any(hit)) continue;
            found = true;
            finish(i, hit, hn::Set(Words(), number));
        }
        if (found) tile().keepLeaf(at);
    }

    /// A group's rays in `hit` go no farther.
    void finish(int i, Mask hit, LaneWords leaf) {
        RayGroup& group = groups_[i];
        group.leaf = hn::IfThenElse(hn::RebindMask(Words(), hit), leaf, group.leaf);
        group.alive = without(group.alive, hit);
        tile().countUntil(i, hit);
        if (!any(group.alive)) open_ &= ~(1u << i);
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
        tile().count(active, 1, 0);
        // An eighth of the page's cell is so many of its lattice's steps.
        constexpr int kSteps = kLatticePerCell >> kMaxSubcellDepth;
        const glm::uvec3 inPage = (at.corner - page.corner) >> page.cellBits;
        const HardLeaf hard = hardLeaf(rays_, leaf, glm::ivec3(inPage) * kSteps, edge);
        Triangles triangles;
        for (StripWalk walk(page.view->strips, at.word); nextTriangles(walk, triangles);) {
            setUpTriangles(*page.view, hard, triangles);
            tile().count(active, 0, uint32_t(triangles.count) * kTriangleReads);
            for (uint32_t rest = active; rest != 0; rest &= rest - 1)
                castAtTriangles(at, hard, triangles, std::countr_zero(rest));
        }
        for (; active != 0; active &= active - 1) takeHits(std::countr_zero(active), leaf, cell);
    }

    void castAtTriangles(const WalkEntry& at, const HardLeaf& hard, Triangles& triangles, int i) {
        const RayGroup& group = groups_[i];
        for (uint32_t met = trianglesMet(triangles, group); met != 0; met &= met - 1) {
            const int t = std::countr_zero(met);
            const Mask taken = castTriangle(hard, triangles, t, group, inLeaf_[i]);
            if (any(taken)) tile().keepTriangle(at, triangles, t, group, taken, inLeaf_[i]);
        }
    }

    void takeHits(int i, const LeafRays& leaf, float cell) {
        const GroupInHardLeaf& in = inLeaf_[i];
        if (!any(in.hit)) return;
        RayGroup& group = groups_[i];
        group.t = select(in.hit, max(mulAdd(in.tau, Lane(cell), Lane(leaf.distance)), Lane(0.0f)), group.t);
        group.x = select(in.hit, in.weightB, group.x);
        group.y = select(in.hit, in.weightC, group.y);
        group.side = select(in.hit, in.side, group.side);
        group.onTriangle = group.onTriangle | in.hit;
        finish(i, in.hit, in.triangle);
    }

    Tile& tile() { return static_cast<Tile&>(*this); }

protected:
    static constexpr uint32_t kTriangleReads = 4;  // an entry of its strip, and vertices

    const HostScene& scene_;
    SceneWalk walk_;
    const TileRays& rays_;
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
