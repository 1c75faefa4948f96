// How the reference ray-caster blends slab leaves: octree/shared/slab_blend.h, leaf by leaf from the root.
#include <algorithm>
#include <cstddef>

#include <glm/geometric.hpp>

#include "octree/reference_caster.h"
#include "octree/surface/morton.h"
#include "octree/surface/slab_blend.h"

namespace vcp {

namespace {

static_assert(offsetof(PageHeader, root) == 4 * f32::kPageHeaderRoot);

/// A place among the leaves, in cells of one level from the root's lowest corner: of the boxes that meet at `point`,
/// the one in an octant about it.
struct CornerPlace {
    glm::dvec3 point;
    uint32_t octant;

    [[nodiscard]] bool isUpper(int axis, double middle) const {
        return point[axis] > middle || (point[axis] == middle && (octant >> axis & 1u) != 0);
    }
    [[nodiscard]] bool isWithin(glm::dvec3 low, double edge) const {
        for (int axis = 0; axis < 3; ++axis)
            if (!isUpper(axis, low[axis]) || isUpper(axis, low[axis] + edge)) return false;
        return true;
    }
};

struct Box {
    glm::dvec3 low;
    double edge;

    /// Makes it the child that a place is in, and returns the child's octant.
    uint32_t goDown(const CornerPlace& place) {
        edge /= 2;
        uint32_t octant = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (!place.isUpper(axis, low[axis] + edge)) continue;
            octant |= 1u << axis;
            low[axis] += edge;
        }
        return octant;
    }
};

}  // namespace

glm::dvec3 ReferenceCaster::blendedNormal(const Ray& ray, const RayHit& hit) const {
    const Dataset& dataset = cache_->dataset();
    const PageEntry& entry = dataset.pages[hit.page];
    const double cell = dataset.cellOf(hit.level);
    const double share =
        f64::slabBlendShare(hit.leafEdge * cell / (options_.pixelEdge + options_.pixelEdgePerT * hit.t));
    const double pageEdge = double(uint64_t{1} << dataset.header.log2Cells);
    const Box ownPage{glm::dvec3(mortonDecode(entry.morton)) * pageEdge, pageEdge};
    const Box ownLeaf{ownPage.low + hit.leafMin, hit.leafEdge};
    const glm::dvec3 x = ((hit.position - dataset.originOf(entry)) / cell - hit.leafMin) / hit.leafEdge;
    const glm::dvec3 corner = f64::nearestCorner(x);
    const uint32_t ownOctant = f64::octantOfLeaf(corner);
    const auto directionOf = [](uint32_t code) { return f64::decodeDirection(code >> kSlabDirectionShift); };
    const glm::dvec3 own =
        f64::turnedTo(directionOf(vectorWord(cache_->view(hit.page)->faces, slabVector(hit.node))), -ray.direction);
    const CornerPlace ends[] = {{ownLeaf.low + hit.leafEdge * corner, 0}, {ownLeaf.low + hit.leafEdge * corner, 7}};
    const bool inOwnPage = ends[0].isWithin(ownPage.low, pageEdge) && ends[1].isWithin(ownPage.low, pageEdge);

    f64::SlabBlend sum{glm::dvec3(0), glm::dvec4(0), 0};
    for (uint32_t octant = 0; octant < 8; ++octant) {
        const CornerPlace place{ends[0].point, octant};
        uint64_t page = inOwnPage ? hit.page : 0;
        Box box = inOwnPage ? ownPage : Box{glm::dvec3(0), pageEdge * double(uint64_t{1} << hit.level)};
        if (!place.isWithin(box.low, box.edge)) continue;
        bool exists = true;
        while (exists && (*marks_)[page] != Mark::Chosen) {
            const uint32_t child = box.goDown(place);
            exists = (dataset.pages[page].childMask >> child & 1u) != 0;
            if (exists) page = childIn(dataset.pages[page], child);
            exists = exists && (*marks_)[page] != Mark::None;
        }
        if (!exists) continue;
        const PageView& view = *cache_->view(page);
        uint32_t node = view.header.root;
        while (nodeType(node) == kNodeInternal) node = view.nodes[8 * (node & kNodePayloadMask) + box.goDown(place)];
        if (nodeType(node) != kNodeSlab) continue;
        const uint32_t code = vectorWord(view.faces, slabVector(node));
        const glm::dvec3 fromCentre = (ownLeaf.low + hit.leafEdge * x - box.low) / box.edge - 0.5;
        const double weight = f64::octantWeight(f64::shareAbove(x), octant) *
                              f64::slabNearness(directionOf(code), f64::slabOffset(code), fromCentre) *
                              (octant == ownOctant ? 1 : share);
        sum = f64::withSlab(sum, directionOf(code), glm::dvec4(0), weight, own);
    }
    const double length = glm::length(sum.normal);
    if (!(share > 0) || !(length > 0)) return hit.normal;
    const glm::dvec3 normal = sum.normal / length;
    return glm::normalize(normal - std::max(glm::dot(normal, ray.direction), 0.0) * ray.direction);
}

}  // namespace vcp
