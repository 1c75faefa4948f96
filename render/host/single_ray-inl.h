// One ray in one leaf, with the same mathematics as in the shaders (octree/shared/leaf_math.h): for rays that part in
// all directions.
#if defined(VCP_RENDER_HOST_SINGLE_RAY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_SINGLE_RAY_INL_H
#undef VCP_RENDER_HOST_SINGLE_RAY_INL_H
#else
#define VCP_RENDER_HOST_SINGLE_RAY_INL_H
#endif

#include <limits>

#include "octree/surface/leaf_math.h"
#include "render/host/scene_walk-inl.h"
#include "render/host/triangles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// A ray in finest cells, from the root's lowest corner.
struct SingleRay {
    glm::dvec3 origin{0};
    glm::vec3 direction{0}, inverse{0};  // unit; no component is 0
    float from = 0;                      // it begins at this distance
    uint32_t nearest = 0;                // the octant of a node that it comes to first

    SingleRay() = default;
    SingleRay(glm::dvec3 begin, glm::vec3 unit) : origin(begin) {
        for (int axis = 0; axis < 3; ++axis) {
            direction[axis] = std::abs(unit[axis]) < 1e-18f ? 1e-18f : unit[axis];
            nearest |= uint32_t(direction[axis] < 0) << axis;
        }
        inverse = 1.0f / direction;
    }
};

/// Casts single rays at leaves. Hard leaves that were met before stay decoded.
class LeafCaster {
public:
    static constexpr float kNothing = std::numeric_limits<float>::infinity();

    explicit LeafCaster(const HostScene& scene) : scene_(scene) {}

    /// Returns the distance of a ray's first hit in a leaf, or kNothing.
    [[nodiscard]] float cast(const WalkEntry& at, const SingleRay& ray) {
        const double edge = cellsOf(at.bits);
        Part part;
        if (!enterLeaf(ray, glm::dvec3(at.corner) * kSubcell - ray.origin, edge, part)) return kNothing;
        const HostScene::Page& page = scene_.page(at.page);
        if (nodeType(at.word) == kNodeHard) return castHard(ray, page, at, float(edge), part);
        const float u =
            nodeType(at.word) == kNodeSlab ? castSlab(*page.view, at.word, part) : castSoft(*page.view, at.word, part);
        return u < 0 ? kNothing : float(part.distance) + (part.first + u * (part.last - part.first)) * float(edge);
    }

    /// A vertex of the triangle that was hit last. Precondition: a triangle was hit.
    [[nodiscard]] uint32_t hitVertex() const { return hitVertex_; }

private:
    /// The part of the ray that is in a leaf: from p over p + d in leaf space, and where that is along the ray.
    struct Part {
        glm::vec3 p, d;
        float first, last;  // leaf edges, from the point at `distance`
        double distance;    // finest cells
        bool fromWall;      // the ray enters the leaf, and does not begin in it
    };

    /// Returns whether the ray passes the leaf.
    static bool enterLeaf(const SingleRay& ray, glm::dvec3 lowest, double edge, Part& part) {
        const glm::dvec3 direction(ray.direction);
        part.distance = std::max(0.0, glm::dot(lowest + 0.5 * edge, direction));
        const glm::vec3 start((part.distance * direction - lowest) / edge);
        const auto begin = float((double(ray.from) - part.distance) / edge);
        const float rounding = 0x1p-22f * (1 + std::max({std::abs(start.x), std::abs(start.y), std::abs(start.z)}));
        const glm::vec3 low = (-rounding - start) * ray.inverse, high = (1 + rounding - start) * ray.inverse;
        const glm::vec3 in = glm::min(low, high), out = glm::max(low, high);
        part.first = std::max({in.x, in.y, in.z, begin});
        part.last = std::min({out.x, out.y, out.z});
        if (!(part.first <= part.last)) return false;
        part.p = glm::clamp(start + part.first * ray.direction, 0.0f, 1.0f);
        part.d = glm::clamp(start + part.last * ray.direction, 0.0f, 1.0f) - part.p;
        part.fromWall = part.first > begin;
        return true;
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

    [[nodiscard]] float castHard(const SingleRay& ray, const HostScene::Page& page, const WalkEntry& at, float edge,
                                 const Part& part) {
        const auto cell = float(1u << page.cellBits);  // page space counts in cells of the page's level
        const float edgeInCells = edge / cell;
        const glm::vec3 from = part.p * edgeInCells;
        const float least = part.fromWall ? -f32::kIntervalSlack : 0.0f;
        float best = (part.last - part.first) * edgeInCells + f32::kIntervalSlack;
        bool isHit = false;
        forEachTriangles(page, at, [&](const TriangleVertices& t) HWY_ATTR {
            for (uint32_t rest = trianglesNear(ray, t, from) & ((1u << t.count) - 1); rest != 0; rest &= rest - 1) {
                const int k = std::countr_zero(rest);
                const auto vertex = [&](int i) { return glm::vec3(t.x[i][k], t.y[i][k], t.z[i][k]); };
                const glm::vec3 hit =
                    f32::intersectTriangle(from, ray.direction, vertex(0), vertex(1), vertex(2), f32::kTriangleSlack);
                if (!(hit.x >= least && hit.x <= best)) continue;
                best = hit.x;
                hitVertex_ = t.corners[0][k];
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
            // A leaf with more triangles than there is room for has only its last ones left: it is decoded each time.
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
    [[nodiscard]] static uint32_t trianglesNear(const SingleRay& ray, const TriangleVertices& t, glm::vec3 from) {
        const Lane3 d = spread(ray.direction), q = spread(from);
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
    uint32_t hitVertex_ = 0;
    DecodedLeaf decoded_[kDecodedLeaves];
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
