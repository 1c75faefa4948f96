// Single rays through the scene, for those that part in all directions: eight children of a node at a time. A leaf is
// met with the same mathematics as in the shaders (octree/shared/leaf_math.h).
#if defined(VCP_RENDER_HOST_RAY_CASTER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_RAY_CASTER_INL_H
#undef VCP_RENDER_HOST_RAY_CASTER_INL_H
#else
#define VCP_RENDER_HOST_RAY_CASTER_INL_H
#endif

#include <limits>

#include "octree/surface/leaf_math.h"
#include "render/host/page_marks.h"
#include "render/host/scene_walk-inl.h"
#include "render/host/triangles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// Casts one ray after the other, and of each finds one hit after the other.
class RayCaster {
public:
    static constexpr float kNothing = std::numeric_limits<float>::infinity();

    /// `marks`, where given, gets the pages that rays hit or begin in.
    RayCaster(const HostScene& scene, PageMarks* marks) : scene_(scene), marks_(marks), walk_(scene) {}

    /// Begins a ray. `direction`: unit. `reach`: hits from there on do not matter. All in finest cells, from the root's
    /// lowest corner.
    void begin(glm::dvec3 origin, glm::vec3 direction, float reach) {
        origin_ = origin;
        reach_ = reach;
        nearest_ = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float d = direction[axis];
            direction_[axis] = std::abs(d) < 1e-18f ? 1e-18f : d;
            nearest_ |= uint32_t(direction_[axis] < 0) << axis;
        }
        inverse_ = 1.0f / direction_;
        walk_.restart();
    }

    /// Returns the distance of the first hit of a ray that begins at distance `from` on the one that was begun, or
    /// kNothing where that is not within reach. Precondition: `from` is no less than the distance found before.
    float next(float from) {
        from_ = from;
        if (marks_ != nullptr)
            if (const auto page = scene_.pageAt(origin_ + double(from) * glm::dvec3(direction_))) marks_->mark(*page);
        while (!walk_.isDone()) {
            const WalkEntry at = walk_.next();
            if (isNode(at)) {
                visitNode(at);
                continue;
            }
            // Boxes do not overlap and come front to back: the first hit is the nearest.
            const float distance = castLeaf(at);
            if (distance == kNothing) continue;
            if (marks_ != nullptr) marks_->mark(at.page);
            hit_ = at;
            walk_.putBack(at);  // the ray may hit more of it
            return distance < reach_ ? distance : kNothing;
        }
        return kNothing;
    }

    /// The leaf of the last hit. Precondition: next() returned a distance.
    [[nodiscard]] const WalkEntry& hitLeaf() const { return hit_; }

private:
    void visitNode(const WalkEntry& at) {
        const double half = 0.5 * cellsOf(at.bits);
        const glm::vec3 middle(glm::dvec3(at.corner) * kSubcell + half - origin_);
        const auto octantHalf = float(0.5 * half);
        uint32_t met = 0;
        for (int i = 0; i < 8; i += kLanes) met |= bitsOf(isMet(octantMiddles(i, middle, octantHalf), octantHalf)) << i;
        walk_.pushChildren(at, met, nearest_);
    }

    /// Tells which boxes the ray meets within its reach. `c`: their middles relative to its origin.
    [[nodiscard]] Mask isMet(Lane3 c, float half) const {
        const Lane h = mulAdd(abs(c.x) + abs(c.y) + abs(c.z), Lane(kPlaceRounding), Lane(half));
        const Lane x0 = (c.x - h) * Lane(inverse_.x), x1 = (c.x + h) * Lane(inverse_.x);
        const Lane y0 = (c.y - h) * Lane(inverse_.y), y1 = (c.y + h) * Lane(inverse_.y);
        const Lane z0 = (c.z - h) * Lane(inverse_.z), z1 = (c.z + h) * Lane(inverse_.z);
        const Lane first = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), Lane(from_)));
        const Lane last = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), Lane(reach_)));
        return first <= last;
    }

    /// The part of the ray that is in a leaf: from p over p + d in leaf space, and where that is along the ray.
    struct Part {
        glm::vec3 p, d;
        float first, last;  // leaf edges, from the point at `distance`
        double distance;    // finest cells
        bool fromWall;      // the ray enters the leaf, and does not begin in it
    };

    /// Returns whether the ray passes the leaf.
    bool enterLeaf(glm::dvec3 lowest, double edge, Part& part) const {
        const glm::dvec3 direction(direction_);
        part.distance = std::max(0.0, glm::dot(lowest + 0.5 * edge, direction));
        const glm::vec3 start((part.distance * direction - lowest) / edge);
        const auto begin = float((double(from_) - part.distance) / edge);
        const float rounding = 0x1p-22f * (1 + std::max({std::abs(start.x), std::abs(start.y), std::abs(start.z)}));
        const glm::vec3 low = (-rounding - start) * inverse_, high = (1 + rounding - start) * inverse_;
        const glm::vec3 in = glm::min(low, high), out = glm::max(low, high);
        part.first = std::max({in.x, in.y, in.z, begin});
        part.last = std::min({out.x, out.y, out.z});
        if (!(part.first <= part.last)) return false;
        part.p = glm::clamp(start + part.first * direction_, 0.0f, 1.0f);
        part.d = glm::clamp(start + part.last * direction_, 0.0f, 1.0f) - part.p;
        part.fromWall = part.first > begin;
        return true;
    }

    /// Returns the distance of the hit, or infinity.
    [[nodiscard]] float castLeaf(const WalkEntry& at) {
        const double edge = cellsOf(at.bits);
        Part part;
        if (!enterLeaf(glm::dvec3(at.corner) * kSubcell - origin_, edge, part)) return kNothing;
        const HostScene::Page& page = scene_.page(at.page);
        if (nodeType(at.word) == kNodeHard) return castHard(page, at, float(edge), part);
        const float u =
            nodeType(at.word) == kNodeSlab ? castSlab(*page.view, at.word, part) : castSoft(*page.view, at.word, part);
        return u < 0 ? kNothing : float(part.distance) + (part.first + u * (part.last - part.first)) * float(edge);
    }

    static float castSlab(const PageView& view, uint32_t node, const Part& part) {
        const uint32_t code = vectorWord(view.faces, slabVector(node));
        const float u = f32::intersectSlab(code, slabOctants(node), part.p, part.d);
        return u > 0 || (u == 0 && part.fromWall) ? u : -1;
    }

    static float castSoft(const PageView& view, uint32_t node, const Part& part) {
        constexpr int kSteps = 8;
        const uint32_t axis = node >> kSoftAxisShift & 3u, face = node & kLeafIndexMask;
        const f32::RayField field = f32::restrictToRay(view.faces[face], view.faces[face + 1], axis, part.p, part.d);
        const float wall = f32::wallTolerance(node);
        return f32::firstCrossing(field, part.fromWall ? wall : 0.0f, wall, f32::dipBound(node), kSteps);
    }

    [[nodiscard]] float castHard(const HostScene::Page& page, const WalkEntry& at, float edge, const Part& part) {
        const auto cell = float(1u << page.cellBits);  // page space counts in cells of the page's level
        const float edgeInCells = edge / cell;
        const glm::vec3 from = part.p * edgeInCells;
        const float least = part.fromWall ? -f32::kIntervalSlack : 0.0f;
        float best = (part.last - part.first) * edgeInCells + f32::kIntervalSlack;
        bool isHit = false;
        forEachTriangles(page, at, [&](const TriangleVertices& t) HWY_ATTR {
            for (uint32_t rest = trianglesNear(t, from) & ((1u << t.count) - 1); rest != 0; rest &= rest - 1) {
                const int k = std::countr_zero(rest);
                const auto vertex = [&](int i) { return glm::vec3(t.x[i][k], t.y[i][k], t.z[i][k]); };
                const glm::vec3 hit =
                    f32::intersectTriangle(from, direction_, vertex(0), vertex(1), vertex(2), f32::kTriangleSlack);
                if (!(hit.x >= least && hit.x <= best)) continue;
                best = hit.x;
                isHit = true;
            }
        });
        if (!isHit) return kNothing;
        return std::max(float(part.distance) + (part.first * edgeInCells + best) * cell, 0.0f);
    }

    /// Calls visit(triangles) for the triangles of a hard leaf, several at a time, relative to the leaf's lowest
    /// corner.
    template <class Visit>
    HWY_INLINE void forEachTriangles(const HostScene::Page& page, const WalkEntry& at, const Visit& visit) {
        DecodedLeaf& leaf = decoded_[(at.word + 31 * at.page) % kDecodedLeaves];
        if (leaf.page != at.page || leaf.word != at.word) {
            constexpr int kSteps = kLatticePerCell >> kMaxSubcellDepth;
            const glm::ivec3 corner = glm::ivec3((at.corner - page.corner) >> page.cellBits) * kSteps;
            const PageView& view = *page.view;
            StripWalk walk(view.strips, at.word);
            // Of a leaf with more triangles than there is room for, only the last ones are left: it is decoded each
            // time.
            bool isLong = false;
            for (leaf.count = 0; leaf.count < kDecodedParts && nextTriangles(walk, leaf.triangles[leaf.count]);) {
                loadVertices(view, corner, leaf.triangles[leaf.count]);
                if (++leaf.count < kDecodedParts || walk.isWhole()) continue;
                for (const TriangleVertices& t : leaf.triangles) visit(t);
                leaf.count = 0;
                isLong = true;
            }
            leaf.page = isLong ? kNoPage : at.page;
            leaf.word = at.word;
        }
        for (int i = 0; i < leaf.count; ++i) visit(leaf.triangles[i]);
    }

    /// Tells which triangles the line from a point may meet: the first test of intersectTriangle (leaf_math.h), with
    /// four times its slack, a triangle a lane.
    [[nodiscard]] uint32_t trianglesNear(const TriangleVertices& t, glm::vec3 from) const {
        const Lane3 d = spread(direction_), q = spread(from);
        const Lane3 a = vertexOf(t, 0) - q, b = vertexOf(t, 1) - q, c = vertexOf(t, 2) - q;
        const Lane3 ab = b - a, bc = c - b, ca = a - c;
        const Mask isBack = dot(cross(ab, ca), d) > Lane(0.0f);  // the normal is (b - a) x (c - a)
        const auto misses = [&](Lane3 corner, Lane3 edge) HWY_ATTR {
            const Lane volume = dot(d, cross(corner, edge)), inside = select(isBack, -volume, volume);
            const float slack = 4 * f32::kTriangleSlack;
            return (inside < Lane(0.0f)) & (inside * inside > Lane(slack * slack) * dot(edge, edge));
        };
        return ~bitsOf(misses(b, bc) | misses(c, ca) | misses(a, ab));
    }

    /// The triangles of a hard leaf that a ray has met: rays that begin side by side meet the same leaves.
    static constexpr int kDecodedParts = 16 / kLanes;
    struct DecodedLeaf {
        uint32_t page = kNoPage, word = 0;
        int count;  // parts in use
        TriangleVertices triangles[kDecodedParts];
    };
    static constexpr uint32_t kDecodedLeaves = 64;

    const HostScene& scene_;
    PageMarks* const marks_;  // or null
    SceneWalk walk_;
    glm::dvec3 origin_{0};
    glm::vec3 direction_{0}, inverse_{0};
    float reach_ = 0, from_ = 0;
    uint32_t nearest_ = 0;  // octant
    WalkEntry hit_{};
    DecodedLeaf decoded_[kDecodedLeaves];
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
