#include "render/host/slab_blend.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

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
    uint32_t octant;  ///< of the dual cell
};

/// The slabs in the cells of a dual cell, the hit leaf's first.
struct DualCell {
    uint32_t key = ~0u;
    size_t count = 0;
    std::array<NearSlab, 8> slabs;
};

class SlabBlender {
public:
    SlabBlender(const HostScene& scene, const TileHits& hits) : scene_(scene), hits_(hits) {}

    /// Returns what is seen of a pixel's hit on a slab leaf, the normal turned to no side. `x`: the hit in leaf space.
    f32::SlabBlend blend(int pixel, glm::vec3 x, float share) {
        const DualCell& cell = dualCellAt(hits_.leaf[pixel], glm::ivec3(f32::dualCorner(x)));
        const glm::vec3 own = cell.slabs[0].normal;
        f32::SlabBlend sum{glm::vec3(0), glm::vec4(0), 0};
        for (size_t i = 0; i < cell.count; ++i) {
            const NearSlab& slab = cell.slabs[i];
            const float nearness =
                f32::slabNearness(slab.normal, slab.offset, (x - slab.low) * slab.inverseEdge - 0.5f);
            const float weight = nearness * f32::dualWeight(x, slab.octant) * (i == 0 ? 1.0f : share);
            sum = f32::withSlab(sum, slab.normal, slab.colour, weight, own);
        }
        return sum;
    }

private:
    const DualCell& dualCellAt(uint32_t leaf, glm::ivec3 lowest) {
        const uint32_t own = uint32_t(-lowest.x) | uint32_t(-lowest.y) << 1 | uint32_t(-lowest.z) << 2;
        const uint32_t key = leaf << 3 | own;
        DualCell& cell = kept_[key % kept_.size()];
        if (cell.key != key) cell = dualCell(hits_.leaves[leaf], lowest, own);
        cell.key = key;
        return cell;
    }

    /// `own`: the octant of the dual cell that the leaf is.
    [[nodiscard]] DualCell dualCell(const HitLeaf& leaf, glm::ivec3 lowest, uint32_t own) const {
        const int edge = 1 << leaf.bits;
        const glm::ivec3 corner(leaf.corner), from = corner + lowest * edge, to = from + edge;
        DualCell cell;
        add(cell, leaf, corner, {leaf.bits, leaf.page, leaf.node}, own);
        const glm::ivec3 apart = from ^ to;
        const auto apartBits = uint32_t(std::bit_width(uint32_t(apart.x | apart.y | apart.z)));
        const TreeBox common = descend(rootAbout(leaf.page, from, to), from, apartBits);
        for (uint32_t octant = 0; octant < 8; ++octant) {
            const glm::ivec3 at = from + edge * glm::ivec3(octant & 1, octant >> 1 & 1, octant >> 2);
            if (octant != own && isInside(at)) add(cell, leaf, at, descend(common, at, leaf.bits), octant);
        }
        return cell;
    }

    [[nodiscard]] bool isInside(glm::ivec3 at) const {
        return (uint32_t(at.x) | uint32_t(at.y) | uint32_t(at.z)) >> scene_.rootBits() == 0;
    }

    /// Returns the root of a page where it holds both cells, also octants that are not drawn; else the scene's.
    [[nodiscard]] TreeBox rootAbout(uint32_t page, glm::ivec3 from, glm::ivec3 to) const {
        const HostScene::Page& of = scene_.page(page);
        const uint32_t bits = scene_.grid().log2Cells + of.cellBits + kMaxSubcellDepth;
        const glm::ivec3 place = glm::ivec3(of.corner) >> int(bits);
        if (from >> int(bits) == place && to >> int(bits) == place) return {bits, page, of.view->header.root};
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

    /// Adds what a box has in a cell, where that is a slab.
    void add(DualCell& cell, const HitLeaf& leaf, glm::ivec3 at, const TreeBox& box, uint32_t octant) const {
        if (hasChildren(box) || nodeType(box.word) != kNodeSlab) return;
        const PageView& view = *scene_.page(box.page).view;
        const uint32_t vector = slabVector(box.word), code = vectorWord(view.faces, vector);
        const glm::ivec3 corner = at >> int(box.bits) << int(box.bits);
        const float scale = 1.0f / float(1u << leaf.bits);
        NearSlab& slab = cell.slabs[cell.count++];
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
    std::array<DualCell, 32> kept_;  ///< of hits side by side, by the lowest bits of their keys
};

}  // namespace

void blendSlabs(const HostScene& scene, const PictureRays& rays, PixelEdge pixel, TileHits& hits) {
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
        const glm::ivec2 at = hits.corner + glm::ivec2(i % kTileWidth, i / kTileWidth);
        const glm::vec3 direction(rays.directionAt(at.x + 0.5, at.y + 0.5));
        const glm::vec3 normal = f32::turnedTo(sum.normal, -direction);
        hits.normalX[i] = normal.x, hits.normalY[i] = normal.y, hits.normalZ[i] = normal.z;
        hits.blended.set(size_t(i));
        hits.colour[i] = sum.colour / sum.weight;
    }
}

}  // namespace vcp
