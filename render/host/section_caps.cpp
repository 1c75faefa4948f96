// castCaps, compiled for several instruction sets, as castTile is (tile_caster.cpp).
#include "render/host/section_caps.h"

#include <cmath>
#include <optional>

#include <glm/geometric.hpp>

#include "render/host/instruction_sets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/host/section_caps.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "render/host/ray_caster-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

// These are as in trace.comp, which says what they are for.
constexpr int kMostCrossings = 64;
constexpr float kPastHit = 0.15f, kPastTriangle = 4e-4f, kRounding = 0x1p-21f;
constexpr float kOneSheetCosine = 0.6f, kOneSheetCells = 0.6f;
constexpr double kLinePixels = 1, kLeastCosine = 1e-3;

/// Counts the walls that rays cross.
class WallCounter {
public:
    /// `ofClosed`: open parts have no walls.
    WallCounter(const HostScene& scene, bool ofClosed, PageMarks* marks)
        : scene_(scene),
          ofClosed_(ofClosed),
          rounding_(kRounding * std::ldexp(1.0f, int(scene.rootBits() - kMaxSubcellDepth))),
          caster_(scene, marks) {}

    /// Returns a wall behind a point where the point is inside of the solid: an odd number of walls lies behind. Two of
    /// three rays decide, for one may graze a wall. `direction`: unit.
    std::optional<WalkEntry> wallBehind(glm::dvec3 point, glm::vec3 direction) {
        const glm::vec3& d = direction;
        const glm::vec3 side = glm::normalize(std::abs(d.z) < 0.7f ? glm::vec3(d.y, -d.x, 0) : glm::vec3(0, d.z, -d.y));
        int inside = 0, outside = 0;
        std::optional<WalkEntry> wall;
        for (const float aside : {0.0f, 0.13f, -0.17f}) {
            if (inside == 2 || outside == 2) break;
            const bool isOdd = crossings(point, glm::normalize(d + aside * side), wall) % 2 == 1;
            ++(isOdd ? inside : outside);
        }
        return inside == 2 ? wall : std::nullopt;
    }

    /// Returns the first wall between two points, if it may be of an open part.
    std::optional<WalkEntry> openBetween(glm::dvec3 from, glm::dvec3 to) {
        const auto length = float(glm::distance(from, to));
        caster_.begin(from, glm::vec3(glm::normalize(to - from)), length);
        if (!(caster_.next(0) <= length)) return std::nullopt;
        const WalkEntry& leaf = caster_.hitLeaf();
        return (kindsOfHit() & kPageHasOpen) != 0 ? std::optional(leaf) : std::nullopt;
    }

private:
    /// Returns of which kinds of parts the wall of the last hit may be (PageEntry).
    [[nodiscard]] uint32_t kindsOfHit() const {
        const WalkEntry& leaf = caster_.hitLeaf();
        const HostScene::Page& page = scene_.page(leaf.page);
        if ((page.parts & kPageHasMarks) == 0) return page.parts;
        const uint32_t type = nodeType(leaf.word);
        const bool isOpen = (type == kNodeSlab && isOpenSlab(leaf.word)) ||
                            (type == kNodeHard && isOpenVertex(page.view->vertices[caster_.hitVertex()]));
        return isOpen ? kPageHasOpen : kPageHasClosed;
    }

    /// `first` gets the first wall that any ray crosses.
    int crossings(glm::dvec3 point, glm::vec3 direction, std::optional<WalkEntry>& first) {
        caster_.begin(point, direction, RayCaster::kNothing);
        int count = 0;
        float from = 0, gap = 0;
        glm::vec3 before(0);  // normal of the slab that is the wall before; of others 0
        for (int turn = 0; turn < kMostCrossings; ++turn) {
            const float distance = caster_.next(from);
            if (!(distance < RayCaster::kNothing)) break;
            const WalkEntry& leaf = caster_.hitLeaf();
            const HostScene::Page& page = scene_.page(leaf.page);
            const auto cell = float(1u << page.cellBits);
            const float past = nodeType(leaf.word) == kNodeHard ? kPastTriangle * cell + rounding_ : kPastHit * cell;
            if (ofClosed_ && kindsOfHit() == kPageHasOpen) {
                gap += distance - from + past;
                from = distance + past;
                continue;
            }
            if (!first) first = leaf;
            const glm::vec3 normal = slabNormal(*page.view, leaf.word);
            const bool isSameSheet =
                std::abs(glm::dot(normal, before)) > kOneSheetCosine &&
                std::abs(glm::dot(direction, before)) * (gap + distance - from) < kOneSheetCells * cell;
            count += isSameSheet ? 0 : 1;
            before = normal;
            gap = past;
            from = distance + gap;
        }
        return count;
    }

    static glm::vec3 slabNormal(const PageView& view, uint32_t node) {
        if (nodeType(node) != kNodeSlab) return glm::vec3(0);
        return f32::decodeDirection(vectorWord(view.faces, slabVector(node)) >> kSlabDirectionShift);
    }

    const HostScene& scene_;
    bool ofClosed_;
    float rounding_;  // of distances along a ray in the scene; finest cells
    RayCaster caster_;
};

/// A point of a section plane that a ray enters by.
struct Entrance {
    glm::dvec2 pixel;   ///< of the ray
    glm::dvec3 point;   ///< world
    glm::dvec3 normal;  ///< of the plane
};

/// Returns the point of the entrance's plane that is seen at another pixel; none where the plane is seen from its edge.
std::optional<glm::dvec3> inPlane(const PictureRays& rays, const Entrance& at, glm::dvec2 pixel) {
    const glm::dvec3 origin = rays.originAt(pixel.x, pixel.y),
                     direction = glm::normalize(rays.directionAt(pixel.x, pixel.y));
    const double along = glm::dot(at.normal, direction);
    if (along < kLeastCosine) return std::nullopt;
    return origin + glm::dot(at.normal, at.point - origin) / along * direction;
}

/// Returns a wall of an open surface whose cut is so near in the picture that its line covers the entrance.
std::optional<WalkEntry> lineAt(WallCounter& walls, const HostGrid& grid, const PictureRays& rays, const Entrance& at) {
    for (const glm::dvec2 aside : {glm::dvec2(kLinePixels, 0), glm::dvec2(0, kLinePixels)}) {
        const auto from = inPlane(rays, at, at.pixel - aside), to = inPlane(rays, at, at.pixel + aside);
        if (!from || !to) continue;
        if (const auto wall = walls.openBetween((*from - grid.origin) / grid.cell, (*to - grid.origin) / grid.cell))
            return wall;
    }
    return std::nullopt;
}

void setCap(TileHits& hits, int i, double depth, glm::dvec3 normal, const WalkEntry& wall) {
    if (!hits.any) {
        std::fill_n(hits.depth, kTilePixels, RayCaster::kNothing);
        for (float* plane : {hits.normalX, hits.normalY, hits.normalZ}) std::fill_n(plane, kTilePixels, 0.0f);
        hits.any = true;
    }
    hits.depth[i] = float(depth);
    hits.normalX[i] = float(normal.x), hits.normalY[i] = float(normal.y), hits.normalZ[i] = float(normal.z);
    hits.onCap.set(size_t(i));
    if (hits.leaves.empty() || hits.leaves.back().node != wall.word || hits.leaves.back().page != wall.page)
        hits.leaves.push_back({.page = wall.page, .node = wall.word});
    hits.leaf[i] = uint32_t(hits.leaves.size() - 1);
}

void castCapsHere(const HostScene& scene, const PictureRays& rays, Caps caps, TileHits& hits, PageMarks* marks) {
    const bool ofClosed = caps == Caps::Closed;
    WallCounter walls(scene, ofClosed, marks);
    for (int i = 0; i < kTilePixels; ++i) {
        const glm::ivec2 in(i % kTileWidth, i / kTileWidth);
        if (in.x >= hits.size.x || in.y >= hits.size.y) continue;
        const glm::dvec2 at = glm::dvec2(hits.corner + in) + 0.5;
        const glm::dvec3 origin = rays.originAt(at.x, at.y), direction = glm::normalize(rays.directionAt(at.x, at.y));
        const KeptInterval kept = keptInterval(rays.sections, origin, direction);
        if (kept.begin == nullptr) continue;
        const Entrance entrance{at, origin + kept.first * direction, glm::dvec3(*kept.begin)};
        const glm::dvec3 point = entrance.point - scene.grid().origin;
        auto wall = walls.wallBehind(point / scene.grid().cell, glm::vec3(direction));
        if (!wall && ofClosed) wall = lineAt(walls, scene.grid(), rays, entrance);
        if (wall) setCap(hits, i, kept.first, -glm::dvec3(*kept.begin), *wall);
    }
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcp {

HWY_EXPORT(castCapsHere);

void castCaps(const HostScene& scene, const PictureRays& rays, Caps caps, TileHits& hits, PageMarks* marks) {
    if (!rays.sections.empty()) HWY_DYNAMIC_DISPATCH(castCapsHere)(scene, rays, caps, hits, marks);
}

}  // namespace vcp
#endif
