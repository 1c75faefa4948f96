#include "octree/reference_caster.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace vcp {

namespace {

/// A closed interval of the ray's parameter; empty where first > last.
struct Interval {
    double first, last;
};

/// Returns where a line is inside a closed cube. A line within a face of the cube is inside.
Interval clipToCube(glm::dvec3 origin, glm::dvec3 direction, glm::dvec3 lowest, double edge) {
    Interval in{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
        const double low = lowest[axis] - origin[axis], high = lowest[axis] + edge - origin[axis];
        if (direction[axis] == 0) {
            if (low > 0 || high < 0) return {1, 0};
            continue;
        }
        const double a = low / direction[axis], b = high / direction[axis];
        in.first = std::max(in.first, std::min(a, b));
        in.last = std::min(in.last, std::max(a, b));
    }
    return in;
}

glm::dvec3 octantOffset(uint32_t octant) { return {octant & 1u, octant >> 1 & 1u, octant >> 2 & 1u}; }

/// Up to eight children with the distances at which a ray enters their boxes, nearest first.
struct EnteredChildren {
    std::array<double, 8> distance;
    std::array<uint64_t, 8> child;
    uint32_t count = 0;

    void insert(double entered, uint64_t which) {
        uint32_t i = count++;
        for (; i > 0 && distance[i - 1] > entered; --i) {
            distance[i] = distance[i - 1];
            child[i] = child[i - 1];
        }
        distance[i] = entered;
        child[i] = which;
    }
};

/// The ray in the space of one page: in cells of the page's level, from its lowest corner.
struct PageRay {
    const PageView* view;
    uint64_t page;
    double cell;  ///< world units
    glm::dvec3 origin, direction;
    double slack;  ///< rounding of the transformation, in cells: no gap may open between neighbouring pages
};

struct LeafHit {
    double t;  ///< cells
    glm::dvec3 normal;
    bool onWall;
};

uint32_t softAxis(uint32_t node) { return node >> kSoftAxisShift & 3u; }

std::optional<LeafHit> castSoftF64(const PageView& view, uint32_t node, glm::dvec3 p, glm::dvec3 d, double wallIn,
                                   double wallOut, int steps) {
    const uint32_t face = node & kLeafIndexMask;
    const f64::RayField ray = f64::restrictToRay(view.faces[face], view.faces[face + 1], softAxis(node), p, d);
    const double u = f64::firstCrossing(ray, wallIn, wallOut, f64::dipBound(node), steps);
    if (!(u >= 0)) return {};
    const f64::LeafField leaf = f64::decodeLeaf(view.faces[face], view.faces[face + 1], softAxis(node));
    const glm::dvec3 normal = f64::facingNormal(f64::leafNormal(leaf, p + u * d), d, f64::sideBefore(ray, u, d));
    return LeafHit{u, normal, u == 0 || u == 1};
}

std::optional<LeafHit> castSoftF32(const PageView& view, uint32_t node, glm::vec3 p, glm::vec3 d, float wallIn,
                                   float wallOut, int steps) {
    const uint32_t face = node & kLeafIndexMask;
    const f32::RayField ray = f32::restrictToRay(view.faces[face], view.faces[face + 1], softAxis(node), p, d);
    const float u = f32::firstCrossing(ray, wallIn, wallOut, f32::dipBound(node), steps);
    if (!(u >= 0)) return {};
    const f32::LeafField leaf = f32::decodeLeaf(view.faces[face], view.faces[face + 1], softAxis(node));
    const glm::vec3 normal = f32::facingNormal(f32::leafNormal(leaf, p + u * d), d, f32::sideBefore(ray, u, d));
    return LeafHit{u, normal, u == 0 || u == 1};
}

/// Casts the part p + u d, u in [0, 1], of a ray against a slab leaf. Where it begins in the leaf (`fromWall` false),
/// what lies at its begin does not count: it may be the surface that it comes from.
std::optional<LeafHit> castSlab(const PageView& view, uint32_t node, glm::dvec3 p, glm::dvec3 d, bool fromWall,
                                bool single) {
    const uint32_t code = vectorWord(view.faces, slabVector(node)), octants = slabOctants(node);
    const double u = single ? double(f32::intersectSlab(code, octants, glm::vec3(p), glm::vec3(d)))
                            : f64::intersectSlab(code, octants, p, d);
    if (u < 0 || (u == 0 && !fromWall)) return {};
    return LeafHit{u, f64::turnedTo(f64::decodeDirection(code >> kSlabDirectionShift), -d), false};
}

/// Returns s as x, and the weights of the second and third vertex as y and z; x = 1e30 for a miss.
glm::dvec3 castTriangle(const PageView& view, const Index3& v, glm::dvec3 q, glm::dvec3 d, bool single) {
    const glm::u32vec2 a = view.vertices[v[0]], b = view.vertices[v[1]], c = view.vertices[v[2]];
    if (single)
        return f32::intersectTriangle(glm::vec3(q), glm::vec3(d), f32::decodeVertex(a.x, a.y),
                                      f32::decodeVertex(b.x, b.y), f32::decodeVertex(c.x, c.y), f32::kTriangleSlack);
    return f64::intersectTriangle(q, d, f64::decodeVertex(a.x, a.y), f64::decodeVertex(b.x, b.y),
                                  f64::decodeVertex(c.x, c.y), f64::kTriangleSlack);
}

/// Returns the blend of the vertex normals, each on the side of the triangle that the ray comes from; at a crease the
/// triangle's own normal.
glm::dvec3 triangleNormal(const PageView& view, const Index3& v, double weight1, double weight2, glm::dvec3 direction) {
    glm::dvec3 p[3];
    for (int i = 0; i < 3; ++i) p[i] = f64::decodeVertex(view.vertices[v[i]].x, view.vertices[v[i]].y);
    glm::dvec3 flat = glm::cross(p[1] - p[0], p[2] - p[0]);
    const double length = glm::length(flat);
    if (length > 0) flat /= length;
    flat = f64::turnedTo(flat, -direction);
    const double weights[3] = {1 - weight1 - weight2, weight1, weight2};
    glm::dvec3 normal{0};
    for (int i = 0; i < 3; ++i) normal += weights[i] * f64::cornerNormal(view.normals[v[i]], flat);
    return normal;
}

}  // namespace

// One ray's way through the page tree.
class CastWalk {
public:
    CastWalk(const ReferenceCaster& caster, const Ray& ray, CastCounters* counters, std::vector<RayHit>* all)
        : caster_(caster), dataset_(caster.cache_->dataset()), ray_(ray), counters_(counters), all_(all) {}

    std::optional<RayHit> run() {
        if (counters_) ++counters_->rays;
        if (!dataset_.pages.empty()) visitPage(0);
        return best_;
    }

private:
    using Mark = ReferenceCaster::Mark;

    void visitPage(uint64_t page) {
        if ((*caster_.marks_)[page] == Mark::None) return;
        const PageEntry& entry = dataset_.pages[page];
        const double cell = dataset_.cellOf(entry.level);
        const glm::dvec3 origin = (ray_.origin - dataset_.originOf(entry)) / cell;
        const double reach = std::max({std::abs(origin.x), std::abs(origin.y), std::abs(origin.z)});
        const PageRay in{caster_.cache_->view(page), page, cell, origin, ray_.direction, 1e-9 + 1e-14 * reach};
        const double edge = double(uint64_t{1} << dataset_.header.log2Cells);
        if (!touches(in, clipToCube(in.origin, in.direction, glm::dvec3(0), edge))) return;
        if ((*caster_.marks_)[page] == Mark::Chosen) {
            if (counters_) ++counters_->pages;
            visitNode(in, in.view->header.root, glm::dvec3(0), edge);
            return;
        }
        visitChildPages(entry, in, edge / 2);
    }

    void visitChildPages(const PageEntry& entry, const PageRay& in, double edge) {
        EnteredChildren order;
        for (uint32_t octant = 0; octant < 8; ++octant) {
            if ((entry.childMask >> octant & 1) == 0) continue;
            const uint64_t child = childIn(entry, octant);
            order.insert(clipToCube(in.origin, in.direction, octantOffset(octant) * edge, edge).first, child);
        }
        for (uint32_t i = 0; i < order.count; ++i) visitPage(order.child[i]);
    }

    void visitNode(const PageRay& in, uint32_t node, glm::dvec3 lowest, double edge) {
        const Interval inside = clipToCube(in.origin, in.direction, lowest, edge);
        if (!touches(in, inside)) return;
        if (counters_) ++counters_->nodes;
        if (nodeType(node) == kNodeInternal) return visitChildren(in, node, lowest, edge / 2);
        if (nodeType(node) == kNodeEmpty) return;
        Interval segment{std::max(inside.first, ray_.tMin / in.cell), std::min(inside.last, ray_.tMax / in.cell)};
        segment.last = std::max(segment.first, segment.last);
        if (nodeType(node) == kNodeSoft)
            castSoft(in, node, lowest, edge, segment);
        else if (nodeType(node) == kNodeSlab)
            castSlabLeaf(in, node, lowest, edge, segment);
        else
            castHard(in, node, lowest, edge, segment);
    }

    void visitChildren(const PageRay& in, uint32_t node, glm::dvec3 lowest, double edge) {
        const uint32_t group = node & kNodePayloadMask;
        EnteredChildren order;
        for (uint32_t octant = 0; octant < 8; ++octant)
            order.insert(clipToCube(in.origin, in.direction, lowest + octantOffset(octant) * edge, edge).first, octant);
        for (uint32_t i = 0; i < 8; ++i) {
            const auto octant = uint32_t(order.child[i]);
            visitNode(in, in.view->nodes[8 * group + octant], lowest + octantOffset(octant) * edge, edge);
        }
    }

    /// Whether the interval may hold a hit nearer than the best so far.
    [[nodiscard]] bool touches(const PageRay& in, Interval t) const {
        const double last = best_ && !all_ ? std::min(best_->t, ray_.tMax) : ray_.tMax;
        // A triangle's hit may lie outside of its leaf by kIntervalSlack.
        const double ahead = in.slack + (best_ ? f64::kIntervalSlack : 0);
        return t.first <= t.last + in.slack && t.last >= ray_.tMin / in.cell - in.slack &&
               t.first <= last / in.cell + ahead;
    }

    void castSoft(const PageRay& in, uint32_t node, glm::dvec3 lowest, double edge, Interval segment) {
        if (counters_) ++counters_->softLeaves;
        const glm::dvec3 p = (in.origin - lowest + segment.first * in.direction) / edge;
        const glm::dvec3 d = (segment.last - segment.first) * in.direction / edge;
        const double wall = f64::wallTolerance(node);
        // Where the ray starts or ends inside the leaf, that end is no wall.
        const double wallIn = segment.first > ray_.tMin / in.cell ? wall : 0;
        const double wallOut = segment.last < ray_.tMax / in.cell ? wall : 0;
        const CastOptions& o = caster_.options_;
        auto hit = o.singlePrecision ? castSoftF32(*in.view, node, p, d, float(wallIn), float(wallOut), o.steps)
                                     : castSoftF64(*in.view, node, p, d, wallIn, wallOut, o.steps);
        if (!hit) return;
        hit->t = segment.first + hit->t * (segment.last - segment.first);
        keep(in, node, lowest, edge, *hit);
    }

    void castSlabLeaf(const PageRay& in, uint32_t node, glm::dvec3 lowest, double edge, Interval segment) {
        if (counters_) ++counters_->slabLeaves;
        const glm::dvec3 p = (in.origin - lowest + segment.first * in.direction) / edge;
        const glm::dvec3 d = (segment.last - segment.first) * in.direction / edge;
        const bool fromWall = segment.first > ray_.tMin / in.cell;
        auto hit = castSlab(*in.view, node, p, d, fromWall, caster_.options_.singlePrecision);
        if (!hit) return;
        hit->t = segment.first + hit->t * (segment.last - segment.first);
        keep(in, node, lowest, edge, *hit);
    }

    void castHard(const PageRay& in, uint32_t node, glm::dvec3 lowest, double edge, Interval segment) {
        if (counters_) ++counters_->hardLeaves;
        const glm::dvec3 q = in.origin + segment.first * in.direction;
        const double length = segment.last - segment.first + f64::kIntervalSlack;
        std::optional<LeafHit> nearest;
        forEachTriangle(in.view->strips, node, [&](const Index3& vertices) {
            if (counters_) ++counters_->triangles;
            const glm::dvec3 hit = castTriangle(*in.view, vertices, q, in.direction, caster_.options_.singlePrecision);
            const double at = segment.first + hit.x;
            if (!(hit.x >= -f64::kIntervalSlack && hit.x <= length) || (nearest && nearest->t <= at)) return;
            if (at * in.cell < ray_.tMin || at * in.cell > ray_.tMax) return;
            nearest = LeafHit{at, triangleNormal(*in.view, vertices, hit.y, hit.z, in.direction), false};
        });
        if (nearest) keep(in, node, lowest, edge, *nearest);
    }

    void keep(const PageRay& in, uint32_t node, glm::dvec3 lowest, double edge, const LeafHit& hit) {
        const double t = hit.t * in.cell;
        if (!all_ && best_ && best_->t <= t) return;
        const double length = glm::length(hit.normal);
        glm::dvec3 normal = length > 0 ? hit.normal / length : -ray_.direction;
        // A blended normal may lean away from the ray near a silhouette: it is bent back to it.
        normal = glm::normalize(normal - std::max(glm::dot(normal, ray_.direction), 0.0) * ray_.direction);
        const PageEntry& entry = dataset_.pages[in.page];
        const RayHit found{t,           ray_.origin + t * ray_.direction,
                           normal,      in.page,
                           entry.level, node,
                           hit.onWall,  lowest,
                           edge,        entry.certifiedError};
        if (all_) all_->push_back(found);
        if (!best_ || t < best_->t) best_ = found;
    }

    const ReferenceCaster& caster_;
    const Dataset& dataset_;
    const Ray& ray_;
    CastCounters* counters_;
    std::vector<RayHit>* all_;
    std::optional<RayHit> best_;
};

PageCache::PageCache(std::shared_ptr<const ByteReader> reader, Dataset dataset)
    : reader_(std::move(reader)), dataset_(std::move(dataset)), pages_(dataset_.pages.size()) {}

Result<PageCache> PageCache::fromPages(Dataset dataset, std::vector<PageBytes> pages) {
    PageCache cache(nullptr, std::move(dataset));
    if (pages.size() != cache.pages_.size())
        return Error{.code = ErrorCode::Usage, .message = "as many pages are needed as the directory names"};
    for (size_t page = 0; page < pages.size(); ++page) {
        auto loaded = std::make_unique<Loaded>();
        loaded->bytes = std::move(pages[page]);
        VCP_TRY_ASSIGN(loaded->view, parsePage(loaded->bytes.geometryBytes(), loaded->bytes.colourBytes()));
        cache.keep(page, std::move(loaded));
    }
    return cache;
}

Result<PageCache> PageCache::open(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(auto reader, openFile(path));
    return open(std::shared_ptr<const ByteReader>(std::move(reader)));
}

Result<PageCache> PageCache::open(std::shared_ptr<const ByteReader> reader) {
    VCP_TRY_ASSIGN(auto dataset, readDataset(*reader));
    if (dataset.header.method != Method::Certified)
        return Error{.code = ErrorCode::Unsupported,
                     .message = "was built by the paper's method and has no certified surface; build it by the other",
                     .file = reader->name()};
    return PageCache(std::move(reader), std::move(dataset));
}

void PageCache::keep(uint64_t page, std::unique_ptr<const Loaded> loaded) {
    loaded_.push_back(std::move(loaded));
    pages_[page] = loaded_.back().get();
}

Result<void> PageCache::load(uint64_t page) {
    if (page >= pages_.size())
        return Error{.code = ErrorCode::Usage, .message = "no such page", .element = fmt::format("page {}", page)};
    if (pages_[page]) return {};
    VCP_TRY_ASSIGN(auto bytes, readPage(*reader_, dataset_, page, dataset_.hasColour()));
    auto loaded = std::make_unique<Loaded>();
    loaded->bytes = std::move(bytes);
    VCP_TRY_ASSIGN(loaded->view, parsePage(loaded->bytes.geometryBytes(), loaded->bytes.colourBytes()));
    keep(page, std::move(loaded));
    return {};
}

Result<void> PageCache::load(std::span<const uint64_t> pages) {
    for (const uint64_t page : pages) VCP_TRY(load(page));
    return {};
}

Result<void> PageCache::loadLevel(uint32_t level) {
    for (const uint64_t page : cutAtLevel(dataset_, level)) VCP_TRY(load(page));
    return {};
}

Result<void> PageCache::loadAll() {
    for (uint64_t page = 0; page < pages_.size(); ++page) VCP_TRY(load(page));
    return {};
}

const PageView* PageCache::view(uint64_t page) const {
    return page < pages_.size() && pages_[page] ? &pages_[page]->view : nullptr;
}

uint64_t PageCache::bytes() const {
    uint64_t sum = 0;
    for (const auto& page : loaded_) sum += page->bytes.geometryBytes().size() + page->bytes.colourBytes().size();
    return sum;
}

std::vector<uint64_t> cutAtLevel(const Dataset& dataset, uint32_t level) {
    std::vector<uint64_t> cut;
    for (uint64_t page = 0; page < dataset.pages.size(); ++page)
        if (const PageEntry& entry = dataset.pages[page];
            entry.level == level || (entry.level < level && entry.childMask == 0))
            cut.push_back(page);
    return cut;
}

Result<ReferenceCaster> ReferenceCaster::create(const PageCache& cache, std::span<const uint64_t> cut,
                                                CastOptions options) {
    ReferenceCaster caster(cache, options);
    const PageDirectory& pages = cache.dataset().pages;
    auto marks = std::make_shared<SparseArray<Mark>>(pages.size());
    for (const uint64_t page : cut) {
        if (!cache.view(page))
            return Error{.code = ErrorCode::Usage,
                         .message = "a page of the cut is not loaded",
                         .element = fmt::format("page {}", page)};
        (*marks)[page] = Mark::Chosen;
    }
    // Children come after their parents in the directory: backwards, all marks below a page are made before it.
    for (uint64_t page = pages.size(); page-- > 0;) {
        if (!pages.knows(page)) {
            page -= page % kEntriesPerBlock;  // no other page of its block is marked either
            continue;
        }
        for (const uint64_t child : childrenOf(pages[page])) {
            if ((*marks)[child] == Mark::None) continue;
            if ((*marks)[page] == Mark::Chosen)
                return Error{.code = ErrorCode::Usage,
                             .message = "the cut names a page and one below it",
                             .element = fmt::format("page {}", page)};
            (*marks)[page] = Mark::Above;
        }
    }
    caster.marks_ = std::move(marks);
    return caster;
}

std::optional<RayHit> ReferenceCaster::cast(const Ray& ray, CastCounters* counters) const {
    auto hit = CastWalk(*this, ray, counters, nullptr).run();
    if (hit && nodeType(hit->node) == kNodeSlab && std::isfinite(options_.pixelEdge))
        hit->normal = blendedNormal(ray, *hit);
    return hit;
}

std::vector<RayHit> ReferenceCaster::castAll(const Ray& ray, CastCounters* counters) const {
    std::vector<RayHit> hits;
    CastWalk(*this, ray, counters, &hits).run();
    std::sort(hits.begin(), hits.end(), [](const RayHit& a, const RayHit& b) { return a.t < b.t; });
    return hits;
}

}  // namespace vcp
