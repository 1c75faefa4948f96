// One ray in one leaf, with the same mathematics as in the shaders (octree/shared/leaf_math.h): for rays that part in
// all directions.
#if defined(VCP_RENDER_HOST_SINGLE_RAY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_SINGLE_RAY_INL_H
#undef VCP_RENDER_HOST_SINGLE_RAY_INL_H
#else
#define VCP_RENDER_HOST_SINGLE_RAY_INL_H
#endif

#include <limits>
#include <optional>

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
    SingleRay(glm::dvec3 begin, glm::vec3 unit) : origin(begin), nearest(nearestOf(unit)) {
        for (int axis = 0; axis < 3; ++axis) direction[axis] = std::abs(unit[axis]) < kLeast ? kLeast : unit[axis];
        inverse = 1.0f / direction;
    }
    static uint32_t nearestOf(glm::vec3 unit) {
        return uint32_t(unit.x <= -kLeast) | uint32_t(unit.y <= -kLeast) << 1 | uint32_t(unit.z <= -kLeast) << 2;
    }

private:
    static constexpr float kLeast = 1e-18f;
};

/// A line q + s d, with its moment q x d.
struct Line {
    glm::vec3 from, direction, moment;

    Line(glm::vec3 q, glm::vec3 d) : from(q), direction(d), moment(glm::cross(q, d)) {}
};

/// Triangles of a hard leaf as single lines meet them. The volume of a line with the edge opposite vertex k is
/// d . moment[k] + edge[k] . (q x d) (Pluecker coordinates).
struct MetTriangles : TriangleVertices {
    alignas(32) float edge[3][3][8], moment[3][3][8];
    alignas(32) float slack[3][8];              // a line misses where a volume is below that, which is less than 0
    alignas(32) float normal[3][8], height[8];  // (b - a) x (c - a), and its product with a
    alignas(32) float steep[8];                 // the least |normal . d| at which planes are met clearly
};

/// Finds what is kept of triangles whose vertices are known.
HWY_INLINE void setUpTriangles(MetTriangles& t) {
    const Lane3 p[3] = {vertexOf(t, 0), vertexOf(t, 1), vertexOf(t, 2)};
    Lane length[3];
    for (int k = 0; k < 3; ++k) {
        const Lane3 from = p[(k + 1) % 3], edge = p[(k + 2) % 3] - from;
        storeLanes(edge, t.edge[k]);
        storeLanes(cross(from, edge), t.moment[k]);
        // Four times the slack of intersectTriangle, and what the products are rounded by.
        const Lane rounding = Lane(0x1p-19f) * (Lane(8.0f) + abs(from.x) + abs(from.y) + abs(from.z));
        length[k] = sqrt(dot(edge, edge));
        store(-(Lane(4 * f32::kTriangleSlack) + rounding) * length[k], t.slack[k]);
    }
    const Lane3 n = cross(p[1] - p[0], p[2] - p[0]);
    storeLanes(n, t.normal);
    store(dot(n, p[0]), t.height);
    store(Lane(0.25f) * length[1] * length[2], t.steep);
}

/// Returns which triangles a line may meet between two distances, a bit each: the first tests of intersectTriangle
/// (leaf_math.h), with more slack, a triangle a lane.
HWY_INLINE uint32_t trianglesNear(const MetTriangles& t, const Line& line, float least, float most) {
    const Lane3 d = spread(line.direction), m = spread(line.moment), n = loadLanes(t.normal);
    const Lane along = dot(n, d), height = load(t.height) - dot(n, spread(line.from));
    const auto flip = hn::And(along.v, hn::Set(Floats(), -0.0f));
    Mask near = hn::Not(maskOf(0));
    for (int k = 0; k < 3; ++k) {
        const Lane volume = dot(d, loadLanes(t.moment[k])) + dot(loadLanes(t.edge[k]), m);
        near = near & (Lane(hn::Xor(volume.v, flip)) >= load(t.slack[k]));
    }
    const Lane steepness = abs(along), ahead = hn::Xor(height.v, flip), margin(0.05f);
    const Mask isBetween = (ahead >= (Lane(least) - margin) * steepness) & (ahead <= (Lane(most) + margin) * steepness);
    return bitsOf(near & (isBetween | (steepness < load(t.steep)))) & ((1u << t.count) - 1);
}

/// Casts single rays at leaves, one leaf after the other. Hard leaves that were met before stay decoded.
class LeafCaster {
public:
    static constexpr float kNothing = std::numeric_limits<float>::infinity();

    explicit LeafCaster(const HostScene& scene) : scene_(scene) {}

    /// Chooses the leaf that rays are cast at.
    void choose(const WalkEntry& at) {
        at_ = at;
        page_ = &scene_.page(at.page);
        edge_ = cellsOf(at.bits);
        lowest_ = glm::dvec3(at.corner) * kSubcell;
        decoded_ = nullptr;
    }

    /// Returns the distance of a ray's first hit in the leaf, or kNothing.
    [[nodiscard]] float cast(const SingleRay& ray) {
        Part part;
        if (!enterLeaf(ray, part)) return kNothing;
        if (nodeType(at_.word) == kNodeHard) return castHard(ray, part);
        const float u = nodeType(at_.word) == kNodeSlab ? castSlab(part) : castSoft(part);
        return u < 0 ? kNothing : float(part.distance) + (part.first + u * (part.last - part.first)) * float(edge_);
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
    [[nodiscard]] HWY_INLINE bool enterLeaf(const SingleRay& ray, Part& part) const {
        const double perEdge = 1 / edge_;  // a power of two
        const glm::dvec3 direction(ray.direction), lowest = lowest_ - ray.origin;
        part.distance = std::max(0.0, glm::dot(lowest + 0.5 * edge_, direction));
        const glm::vec3 start((part.distance * direction - lowest) * perEdge);
        const auto begin = float((double(ray.from) - part.distance) * perEdge);
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

    [[nodiscard]] float castSlab(const Part& part) const {
        const uint32_t code = vectorWord(page_->view->faces, slabVector(at_.word));
        const float u = f32::intersectSlab(code, slabOctants(at_.word), part.p, part.d);
        return u > 0 || (u == 0 && part.fromWall) ? u : -1;
    }

    [[nodiscard]] float castSoft(const Part& part) const {
        constexpr int kSteps = 8;
        const uint32_t node = at_.word, axis = node >> kSoftAxisShift & 3u;
        const auto* face = &page_->view->faces[node & kLeafIndexMask];
        const f32::RayField field = f32::restrictToRay(face[0], face[1], axis, part.p, part.d);
        const float wall = f32::wallTolerance(node);
        return f32::firstCrossing(field, part.fromWall ? wall : 0.0f, wall, f32::dipBound(node), kSteps);
    }

    [[nodiscard]] float castHard(const SingleRay& ray, const Part& part) {
        const auto cell = float(1u << page_->cellBits);  // page space counts in cells of the page's level
        const float edgeInCells = float(edge_) / cell;
        const Line line(part.p * edgeInCells, ray.direction);
        const float least = part.fromWall ? -f32::kIntervalSlack : 0.0f;
        float best = (part.last - part.first) * edgeInCells + f32::kIntervalSlack;
        bool isHit = false;
        forEachTriangles([&](const MetTriangles& t) HWY_ATTR {
            for (uint32_t rest = trianglesNear(t, line, least, best); rest != 0; rest &= rest - 1) {
                const int k = std::countr_zero(rest);
                const auto vertex = [&](int i) { return glm::vec3(t.x[i][k], t.y[i][k], t.z[i][k]); };
                const glm::vec3 hit = f32::intersectTriangle(line.from, line.direction, vertex(0), vertex(1), vertex(2),
                                                             f32::kTriangleSlack);
                if (!(hit.x >= least && hit.x <= best)) continue;
                best = hit.x;
                hitVertex_ = t.corners[0][k];
                isHit = true;
            }
        });
        if (!isHit) return kNothing;
        return std::max(float(part.distance) + (part.first * edgeInCells + best) * cell, 0.0f);
    }

    /// The triangles of a hard leaf, relative to its lowest corner. Rays that begin side by side meet the same leaves.
    static constexpr int kDecodedParts = 16 / kLanes;
    struct DecodedLeaf {
        uint32_t page = kNoPage, word = 0;
        int count = 0;                  // parts in use
        std::optional<StripWalk> rest;  // what there is no room for
        MetTriangles triangles[kDecodedParts];
    };
    static constexpr uint32_t kDecodedLeaves = 64;

    bool readTriangles(StripWalk& walk, MetTriangles& triangles) const {
        if (!nextTriangles(walk, triangles)) return false;
        constexpr int kSteps = kLatticePerCell >> kMaxSubcellDepth;
        loadVertices(*page_->view, glm::ivec3((at_.corner - page_->corner) >> page_->cellBits) * kSteps, triangles);
        setUpTriangles(triangles);
        return true;
    }

    [[nodiscard]] const DecodedLeaf& decodedLeaf() {
        DecodedLeaf& leaf = leaves_[(at_.word + 31 * at_.page) % kDecodedLeaves];
        if (leaf.page == at_.page && leaf.word == at_.word) return leaf;
        StripWalk walk(page_->view->strips, at_.word);
        for (leaf.count = 0; leaf.count < kDecodedParts && readTriangles(walk, leaf.triangles[leaf.count]);)
            ++leaf.count;
        leaf.rest.reset();
        if (leaf.count == kDecodedParts && !walk.isWhole()) leaf.rest.emplace(walk);
        leaf.page = at_.page;
        leaf.word = at_.word;
        return leaf;
    }

    /// Calls visit(triangles) for the triangles of the leaf, several at a time.
    template <class Visit>
    HWY_INLINE void forEachTriangles(const Visit& visit) {
        if (decoded_ == nullptr) decoded_ = &decodedLeaf();
        for (int i = 0; i < decoded_->count; ++i) visit(decoded_->triangles[i]);
        if (!decoded_->rest) return;
        MetTriangles triangles;
        for (StripWalk walk = *decoded_->rest; readTriangles(walk, triangles);) visit(triangles);
    }

    const HostScene& scene_;
    WalkEntry at_{};
    const HostScene::Page* page_ = nullptr;
    double edge_ = 1;       // finest cells
    glm::dvec3 lowest_{0};  // finest cells, from the root's lowest corner
    const DecodedLeaf* decoded_ = nullptr;
    uint32_t hitVertex_ = 0;
    DecodedLeaf leaves_[kDecodedLeaves];
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
