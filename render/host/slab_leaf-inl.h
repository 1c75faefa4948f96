// Slab leaves for groups of rays: intersectSlab of leaf_math.h, decided lane by lane; tests/render/host compare the
// two.
#if defined(VCP_RENDER_HOST_SLAB_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_SLAB_LEAF_INL_H
#undef VCP_RENDER_HOST_SLAB_LEAF_INL_H
#else
#define VCP_RENDER_HOST_SLAB_LEAF_INL_H
#endif

#include "octree/surface/leaf_math.h"
#include "render/host/ray_group-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

struct SlabLeaf {
    glm::vec3 normal;
    float offset, half;  ///< of the middle plane from the leaf's centre; of the thickness; leaf edges
    uint32_t octants;
};

HWY_INLINE SlabLeaf decodeSlabLeaf(const PageView& view, uint32_t node) {
    const uint32_t code = vectorWord(view.faces, slabVector(node));
    return {f32::decodeDirection(code >> kSlabDirectionShift), f32::slabOffset(code), f32::slabHalfThickness(code),
            slabOctants(node)};
}

/// Where rays are in the lower or the upper half of a leaf, along an axis.
struct HalfSpan {
    Lane first, last;
};

/// `p`, `d`: start and extent along the axis.
HWY_INLINE HalfSpan halfSpan(Lane p, Lane d, bool isUpper) {
    const Lane least(1e-20f), far(1e30f);
    const Lane inverse = Lane(1.0f) / select(abs(d) < least, least, d);
    const Lane halfway = (Lane(0.5f) - p) * inverse, wide = abs(inverse) * Lane(kSlabSlack);
    const Mask ahead = inverse > Lane(0.0f);
    if (isUpper) return {select(ahead, halfway - wide, -far), select(ahead, far, halfway + wide)};
    return {select(ahead, -far, halfway - wide), select(ahead, halfway + wide, far)};
}

/// Casts the rays of a group through a slab leaf. Returns those that hit, with their hits in the group.
template <bool kIsCut>
HWY_INLINE Mask castSlabLeaf(const SlabLeaf& slab, const LeafRays& leaf, RayGroup& group) {
    const GroupSegment s = segmentIn<kIsCut>(group, leaf);
    if (!any(s.inside)) return s.inside;
    const LeafPart part = partInLeaf(group, s);
    const auto& [p, d] = part;
    const Lane3 n = spread(slab.normal);
    const Lane slope = dot(n, d), least(1e-20f);
    const Lane scale = Lane(1.0f) / select(abs(slope) < least, least, slope);
    const Lane height = Lane(slab.offset + 0.5f * (slab.normal.x + slab.normal.y + slab.normal.z)) - dot(n, p);
    const Lane middle = height * scale, reach = Lane(slab.half) * abs(scale);
    const Lane first = max(middle - reach, Lane(0.0f)), last = min(middle + reach, Lane(1.0f));
    const HalfSpan x[2] = {halfSpan(p.x, d.x, false), halfSpan(p.x, d.x, true)};
    const HalfSpan y[2] = {halfSpan(p.y, d.y, false), halfSpan(p.y, d.y, true)};
    const HalfSpan z[2] = {halfSpan(p.z, d.z, false), halfSpan(p.z, d.z, true)};
    Lane enter(2.0f), leave(2.0f);
    for (uint32_t rest = slab.octants; rest != 0; rest &= rest - 1) {
        const int o = std::countr_zero(rest);
        const HalfSpan &a = x[o & 1], &b = y[o >> 1 & 1], &c = z[o >> 2];
        const Lane begin = max(max(a.first, b.first), max(c.first, first));
        const Lane end = min(min(a.last, b.last), min(c.last, last));
        const Mask nearer = (begin <= end) & (begin < enter);
        enter = select(nearer, begin, enter);
        leave = select(nearer, end, leave);
    }
    const Lane u = min(max(middle, enter), leave);
    // What lies where a ray begins inside the leaf does not count.
    const Mask fromWall = s.first > s.kept.begin;
    const Mask hit = keptHits<kIsCut>(s, s.inside & (enter <= Lane(1.0f)) & (fromWall | (u > Lane(0.0f))), u);
    if (!any(hit)) return hit;
    keepHits(group, leaf, s, part, hit, u);
    group.normal = select(hit, select(dot(n, group.direction) > Lane(0.0f), -n, n), group.normal);
    return hit;
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
