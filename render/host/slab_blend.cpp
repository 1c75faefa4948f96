#include "render/host/slab_blend.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "octree/surface/slab_blend.h"

namespace vcp {

namespace {

constexpr uint32_t kNoPage = ~0u;

/// A box of the scene's tree, or of a page's.
struct TreeBox {
    uint32_t bits = 0;        ///< log2 of its edge in subcells
    uint32_t page = kNoPage;  ///< of the scene
    uint32_t word = 0;        ///< its node word, or the number of the scene's node
};

bool hasChildren(const TreeBox& box) { return box.page == kNoPage || nodeType(box.word) == kNodeInternal; }

/// A slab in the space of the leaf that was hit.
struct NearSlab {
    glm::vec3 normal, low;      ///< of its plane; the lowest corner of its leaf
    float offset, inverseEdge;  ///< of its plane, in its leaf's edges; of its leaf
    glm::vec4 colour;
    uint32_t octant;  ///< about the corner that the leaves meet at
};

/// The slabs that meet at a corner of a leaf, the leaf's own first.
struct SlabsAtCorner {
    size_t count = 0;
    std::array<NearSlab, 8> slabs;
};

class SlabBlender {
public:
    SlabBlender(const HostScene& scene, const TileHits& hits)
        : scene_(scene), hits_(hits), numbers_(8 * hits.leaves.size(), kNotFound) {}

    /// Returns what is seen of a pixel's hit on a slab leaf, the normal turned to no side. `x`: the hit in leaf space.
    f32::SlabBlend blend(int pixel, glm::vec3 x, float share) {
        const SlabsAtCorner& at = slabsAt(hits_.leaf[pixel], f32::nearestCorner(x));
        const glm::vec3 own = at.slabs[0].normal, above = f32::shareAbove(x);
        f32::SlabBlend sum{glm::vec3(0), glm::vec4(0), 0};
        for (size_t i = 0; i < at.count; ++i) {
            const NearSlab& slab = at.slabs[i];
            const float nearness =
                f32::slabNearness(slab.normal, slab.offset, (x - slab.low) * slab.inverseEdge - 0.5f);
            const float weight = nearness * f32::octantWeight(above, slab.octant) * (i == 0 ? 1.0f : share);
            sum = f32::withSlab(sum, slab.normal, slab.colour, weight, own);
        }
        return sum;
    }

private:
    static constexpr uint32_t kNotFound = ~0u;

    const SlabsAtCorner& slabsAt(uint32_t leaf, glm::vec3 corner) {
        const uint32_t own = f32::octantOfLeaf(corner);
        uint32_t& number = numbers_[8 * leaf + own];
        if (number == kNotFound) {
            number = uint32_t(found_.size());
            found_.push_back(find(hits_.leaves[leaf], glm::ivec3(corner), own));
        }
        return found_[number];
    }

    /// `corner`: of the leaf, 0 or 1 on each axis; `own`: the octant about it that the leaf is in.
    [[nodiscard]] SlabsAtCorner find(const HitLeaf& leaf, glm::ivec3 corner, uint32_t own) const {
        // The subcells about the corner are in the leaves that meet there.
        const glm::ivec3 above = glm::ivec3(leaf.corner) + (corner << int(leaf.bits)), below = above - 1;
        SlabsAtCorner slabs;
        add(slabs, leaf, glm::ivec3(leaf.corner), {leaf.bits, leaf.page, leaf.node}, own);
        const glm::ivec3 apart = below ^ above;
        const auto apartBits = uint32_t(std::bit_width(uint32_t(apart.x | apart.y | apart.z)));
        const TreeBox common = descend(rootAbout(leaf.page, below, above), below, apartBits);
        for (uint32_t octant = 0; octant < 8; ++octant) {
            const glm::ivec3 at = below + glm::ivec3(octant & 1, octant >> 1 & 1, octant >> 2);
            if (octant != own && isInside(at)) add(slabs, leaf, at, descend(common, at, 0), octant);
        }
        return slabs;
    }

    [[nodiscard]] bool isInside(glm::ivec3 at) const {
        return (uint32_t(at.x) | uint32_t(at.y) | uint32_t(at.z)) >> scene_.rootBits() == 0;
    }

    /// Returns the root of a page where it holds both subcells, also with octants that are not drawn; else the scene's.
    [[nodiscard]] TreeBox rootAbout(uint32_t page, glm::ivec3 below, glm::ivec3 above) const {
        const HostScene::Page& of = scene_.page(page);
        const uint32_t bits = scene_.grid().log2Cells + of.cellBits + kMaxSubcellDepth;
        const glm::ivec3 place = glm::ivec3(of.corner) >> int(bits);
        if ((below >> int(bits)) == place && (above >> int(bits)) == place) return {bits, page, of.view->header.root};
        return childBox(scene_.root(), scene_.rootBits());
    }

    [[nodiscard]] TreeBox childBox(HostScene::Child child, uint32_t bits) const {
        if (child.kind == HostScene::Child::Kind::Node) return {bits, kNoPage, child.index};
        if (child.kind == HostScene::Child::Kind::Page) return {bits, child.index, scene_.page(child.index).root};
        return {bits, 0, emptyNode(0)};
    }

    /// Goes down to the box of 2^bits subcells at a place, or to the leaf that holds it.
    [[nodiscard]] TreeBox descend(TreeBox box, glm::ivec3 place, uint32_t bits) const {
        while (box.bits > bits && hasChildren(box)) {
            --box.bits;
            const glm::ivec3 upper = place >> int(box.bits) & 1;
            const auto octant = uint32_t(upper.x | upper.y << 1 | upper.z << 2);
            if (box.page == kNoPage)
                box = childBox(scene_.node(box.word)[octant], box.bits);
            else
                box.word = scene_.page(box.page).view->nodes[8 * (box.word & kNodePayloadMask) + octant];
        }
        return box;
    }

    /// Adds the box that holds a subcell, where it is a slab leaf.
    void add(SlabsAtCorner& slabs, const HitLeaf& leaf, glm::ivec3 at, const TreeBox& box, uint32_t octant) const {
        if (hasChildren(box) || nodeType(box.word) != kNodeSlab) return;
        const PageView& view = *scene_.page(box.page).view;
        const uint32_t vector = slabVector(box.word), code = vectorWord(view.faces, vector);
        const glm::ivec3 corner = at >> int(box.bits) << int(box.bits);
        const float scale = 1.0f / float(1u << leaf.bits);
        NearSlab& slab = slabs.slabs[slabs.count++];
        slab.normal = f32::decodeDirection(code >> kSlabDirectionShift);
        slab.offset = f32::slabOffset(code);
        slab.low = glm::vec3(corner - glm::ivec3(leaf.corner)) * scale;
        slab.inverseEdge = float(1u << leaf.bits) / float(1u << box.bits);
        slab.octant = octant;
        slab.colour =
            view.faceColours.empty() ? glm::vec4(0) : glm::unpackUnorm4x8(vectorWord(view.faceColours, vector));
    }

    const HostScene& scene_;
    const TileHits& hits_;
    std::vector<SlabsAtCorner> found_;
    std::vector<uint32_t> numbers_;  ///< among them, of each corner of the tile's leaves
};

}  // namespace

void blendSlabs(const HostScene& scene, PixelEdge pixel, TileHits& hits) {
    hits.blended.reset();
    if (!hits.any || hits.widestSlab == 0) return;
    const double cell = scene.grid().cell;
    const auto edgeAt = [&](int i) { return pixel.edge + pixel.perDepth * float(double(hits.depth[i]) / cell); };
    // Where all leaves are narrow, no more is done than this.
    const float nearest = *std::min_element(hits.depth, hits.depth + kTilePixels);
    if (hits.widestSlab <= pixel.edge + pixel.perDepth * float(double(nearest) / cell)) return;
    SlabBlender blender(scene, hits);
    for (int i = 0; i < kTilePixels; ++i) {
        if (!std::isfinite(hits.depth[i]) || hits.onCap[size_t(i)]) continue;
        const HitLeaf& leaf = hits.leaves[hits.leaf[i]];
        if (nodeType(leaf.node) != kNodeSlab) continue;
        const float edge = std::ldexp(1.0f, int(leaf.bits) - int(kMaxSubcellDepth));
        const float share = f32::slabBlendShare(edge / edgeAt(i));
        if (!(share > 0)) continue;
        const auto sum = blender.blend(i, {hits.x[i], hits.y[i], hits.z[i]}, share);
        if (!(glm::dot(sum.normal, sum.normal) > 0)) continue;
        // On the side of the hit leaf's normal, which has been turned to the ray.
        const glm::vec3 normal =
            f32::turnedTo(sum.normal, glm::vec3(hits.normalX[i], hits.normalY[i], hits.normalZ[i]));
        hits.normalX[i] = normal.x, hits.normalY[i] = normal.y, hits.normalZ[i] = normal.z;
        hits.blended.set(size_t(i));
        hits.colour[i] = sum.colour / sum.weight;
    }
}

}  // namespace vcp
