#include "builder/measure/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/measure/hit_colour.h"
#include "builder/measure/mesh_samples.h"
#include "builder/stream/colour_difference.h"

namespace vcp {

namespace {

constexpr uint64_t kBlock = SampleRunner::kBlock;

/// A convex polygon, of a triangle cut off at the walls of a box: up to 3 + 6 corners.
struct Polygon {
    std::array<glm::dvec3, 12> corner;
    int count = 0;
};

Polygon clipToHalfSpace(const Polygon& in, int axis, double wall, double side) {
    Polygon out;
    for (int i = 0; i < in.count; ++i) {
        const glm::dvec3 a = in.corner[i], b = in.corner[(i + 1) % in.count];
        const double da = side * (wall - a[axis]), db = side * (wall - b[axis]);
        if (da >= 0) out.corner[out.count++] = a;
        if ((da >= 0) == (db >= 0)) continue;
        glm::dvec3 cut = a + (da / (da - db)) * (b - a);
        cut[axis] = wall;
        out.corner[out.count++] = cut;
    }
    return out;
}

double distanceToClipped(glm::dvec3 p, const std::array<glm::dvec3, 3>& triangle, glm::dvec3 lowest, double edge) {
    Polygon polygon;
    for (const glm::dvec3& corner : triangle) polygon.corner[polygon.count++] = corner;
    for (int axis = 0; axis < 3 && polygon.count > 0; ++axis) {
        polygon = clipToHalfSpace(polygon, axis, lowest[axis] + edge, 1);
        if (polygon.count > 0) polygon = clipToHalfSpace(polygon, axis, lowest[axis], -1);
    }
    double nearest = kInfinity;
    for (int i = 1; i + 1 < std::max(polygon.count, 2); ++i)
        nearest = std::min(nearest, glm::distance(p, closestPointOfTriangle(p, polygon.corner[0], polygon.corner[i],
                                                                            polygon.corner[i + 1])));
    return nearest;
}

double boxDistance(glm::dvec3 p, glm::dvec3 lowest, double edge) {
    return glm::length(glm::max(glm::max(lowest - p, p - lowest - glm::dvec3(edge)), glm::dvec3(0)));
}

glm::dvec3 octantOffset(uint32_t octant) { return {octant & 1u, octant >> 1 & 1u, octant >> 2 & 1u}; }

/// A leaf of the measured level.
struct LeafBox {
    uint64_t page;
    glm::dvec3 lowest;  ///< in cells from the page's lowest corner
    double edge;
};

/// The leaves of the cut, as a list; and a descent to the nearest hard leaves.
class LevelLeaves {
public:
    LevelLeaves(const PageCache& cache, const std::vector<uint64_t>& cut)
        : cache_(cache), inCut_(cache.dataset().pages.size(), false) {
        for (const uint64_t page : cut) inCut_[page] = true;
    }

    [[nodiscard]] std::vector<LeafBox> list() const {
        std::vector<LeafBox> leaves;
        for (uint64_t page = 0; page < inCut_.size(); ++page)
            if (inCut_[page]) collect(page, cache_.view(page)->header.root, glm::dvec3(0), pageCells(), leaves);
        return leaves;
    }

    /// Returns the distance from a world point to the triangles of hard leaves, or `best` if that is less.
    [[nodiscard]] double hardDistance(glm::dvec3 p, double best) const {
        visitPage(0, p, best);
        return best;
    }

private:
    [[nodiscard]] double pageCells() const { return double(uint64_t{1} << cache_.dataset().header.log2Cells); }

    void collect(uint64_t page, uint32_t node, glm::dvec3 lowest, double edge, std::vector<LeafBox>& leaves) const {
        if (nodeType(node) == kNodeEmpty) return;
        if (nodeType(node) != kNodeInternal) return leaves.push_back({page, lowest, edge});
        for (uint32_t o = 0; o < 8; ++o)
            collect(page, cache_.view(page)->nodes[8 * (node & kNodePayloadMask) + o],
                    lowest + octantOffset(o) * (edge / 2), edge / 2, leaves);
    }

    void visitPage(uint64_t page, glm::dvec3 p, double& best) const {
        const Dataset& dataset = cache_.dataset();
        const PageEntry& entry = dataset.pages[page];
        const double cell = dataset.cellOf(entry.level);
        const glm::dvec3 inPage = (p - dataset.originOf(entry)) / cell;
        if (boxDistance(inPage, glm::dvec3(0), pageCells()) * cell >= best) return;
        if (inCut_[page]) {
            double cells = best / cell;
            visitNode(*cache_.view(page), cache_.view(page)->header.root, inPage, glm::dvec3(0), pageCells(), cells);
            best = std::min(best, cells * cell);
            return;
        }
        for (const uint64_t child : childrenOf(entry)) visitPage(child, p, best);
    }

    void visitNode(const PageView& view, uint32_t node, glm::dvec3 p, glm::dvec3 lowest, double edge,
                   double& best) const {
        if (boxDistance(p, lowest, edge) >= best) return;
        if (nodeType(node) == kNodeInternal) {
            for (uint32_t o = 0; o < 8; ++o)
                visitNode(view, view.nodes[8 * (node & kNodePayloadMask) + o], p, lowest + octantOffset(o) * (edge / 2),
                          edge / 2, best);
            return;
        }
        if (nodeType(node) != kNodeHard) return;
        forEachTriangle(view.strips, node, [&](const Index3& v) {
            std::array<glm::dvec3, 3> triangle;
            for (int i = 0; i < 3; ++i) triangle[i] = f64::decodeVertex(view.vertices[v[i]].x, view.vertices[v[i]].y);
            best = std::min(best, distanceToClipped(p, triangle, lowest, edge));
        });
    }

    const PageCache& cache_;
    std::vector<bool> inCut_;
};

/// Returns an upper bound on the distance of a world point to the rendered surface.
double distanceToSurface(const ReferenceCaster& caster, const LevelLeaves& leaves, const MeshSampler::Sample& sample,
                         double cell, double certifiedError) {
    double best = kInfinity;
    glm::dvec3 surfaceNormal{0};
    const auto take = [&](double distance, const RayHit& hit) {
        if (distance >= best) return;
        best = distance;
        surfaceNormal = hit.normal;
    };
    const auto tryAlong = [&](glm::dvec3 direction, double reach) {
        if (reach < kInfinity) {
            // A ray that begins in the surface itself would not meet it.
            const double r = std::min(best, reach);
            for (const RayHit& hit : caster.castAll({sample.position - r * direction, direction, 0, 2 * r}))
                take(std::abs(hit.t - r), hit);
            return;
        }
        for (const double sign : {1.0, -1.0})
            if (const auto hit = caster.cast({sample.position, sign * direction, 0, best})) take(hit->t, *hit);
    };
    tryAlong(sample.normal, cell);
    if (best < kInfinity) tryAlong(surfaceNormal, cell);
    best = leaves.hardDistance(sample.position, best);
    if (best <= 0.25 * certifiedError) return best;
    if (best == kInfinity) tryAlong(sample.normal, kInfinity);
    constexpr double d = 0.57735026918962573;
    for (const glm::dvec3 direction :
         {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(d, d, d), glm::dvec3(-d, d, d),
          glm::dvec3(d, -d, d), glm::dvec3(d, d, -d)})
        tryAlong(direction, best < kInfinity ? cell : kInfinity);
    if (best < kInfinity && surfaceNormal != glm::dvec3(0)) tryAlong(surfaceNormal, kInfinity);
    return best;
}

/// Returns the angle between two units' lines, 0 to 90 degrees.
double lineDegrees(glm::dvec3 a, glm::dvec3 b) {
    return std::acos(std::min(std::abs(glm::dot(a, b)), 1.0)) * 180 / std::numbers::pi;
}

/// Returns the unit normal of a triangle, of length 0 where it has no area.
glm::dvec3 triangleNormal(const IndexedMesh& mesh, uint32_t triangle) {
    const auto v = mesh.corners(triangle);
    const glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double length = glm::length(n);
    return length > 0 ? n / length : glm::dvec3(0);
}

/// Finds the hits of one random ray through a leaf that lie in the leaf.
void hitsOfLeaf(const ReferenceCaster& caster, const LeafBox& leaf, SampleRandom& random, std::vector<RayHit>& hits) {
    const Dataset& dataset = caster.cache().dataset();
    const PageEntry& entry = dataset.pages[leaf.page];
    const double cell = dataset.cellOf(entry.level);
    const glm::dvec3 inLeaf = leaf.lowest + leaf.edge * glm::dvec3(random.unit(), random.unit(), random.unit());
    const glm::dvec3 direction = random.direction();
    const double reach = 2 * leaf.edge * cell;
    const glm::dvec3 middle = dataset.originOf(entry) + inLeaf * cell;
    for (const RayHit& hit : caster.castAll({middle - reach * direction, direction, 0, 2 * reach}))
        if (hit.page == leaf.page && hit.leafMin == leaf.lowest && hit.leafEdge == leaf.edge) hits.push_back(hit);
}

/// Returns how the colours of a hit and of the mesh's point nearest to it differ; nothing where one has none, or images
/// cut the point out.
std::optional<double> differenceAt(const PageCache& cache, const RayHit& hit, const SurfaceDistanceOptions& options,
                                   const IndexedMesh& mesh, const NearestPoint& nearest) {
    const MeshPaint& paint = *options.paint;
    const auto light = lightOfHit(cache, hit, options.images);
    if (!light || !paint.hasColour()) return {};
    const auto corners = mesh.corners(nearest.triangle);
    const PaintedLight painted =
        paint.lightAt(mesh, nearest.triangle, cornerWeights(nearest.point, corners[0], corners[1], corners[2]));
    if (!(painted.cover > 0)) return {};
    return colourDifference(*light, painted.light / painted.cover);
}

/// Joins what blocks of samples found, in their order.
template <class T>
std::vector<T> joined(const std::vector<std::vector<T>>& blocks) {
    std::vector<T> all;
    for (const auto& block : blocks) all.insert(all.end(), block.begin(), block.end());
    return all;
}

/// The difference of colours at a hit.
struct ColourSample {
    float deltaE;
    bool isOfSlab;
};

/// `cut`: the pages that are measured.
SlabColours slabColoursOf(const Dataset& dataset, std::span<const uint64_t> cut,
                          std::span<const ColourSample> samples) {
    SlabColours colours;
    for (const uint64_t page : cut) {
        colours.p95 = std::max(colours.p95, colourErrorOf(dataset.pages[page].colourErrorP95));
        colours.max = std::max(colours.max, colourErrorOf(dataset.pages[page].colourErrorMax));
    }
    double squares = 0;
    for (const ColourSample& sample : samples) {
        if (!sample.isOfSlab) continue;
        squares += double(sample.deltaE) * double(sample.deltaE);
        ++colours.samples;
    }
    if (colours.samples > 0) colours.rms = std::sqrt(squares / double(colours.samples));
    return colours;
}

/// Keeps the largest distance that threads report; ties go to the lowest sample.
struct Worst {
    std::mutex mutex;
    double distance = -1;
    uint64_t sample = 0;
    glm::dvec3 position{0};
    void add(double candidate, uint64_t number, glm::dvec3 at) {
        const std::lock_guard lock(mutex);
        if (candidate < distance || (candidate == distance && number >= sample)) return;
        distance = candidate;
        sample = number;
        position = at;
    }
};

}  // namespace

Result<SurfaceDistance> measureSurfaceDistance(const PageCache& cache, const MeshBvh& mesh,
                                               const SurfaceDistanceOptions& options) {
    const Dataset& dataset = cache.dataset();
    const uint32_t level = std::min(options.level, dataset.header.levels - 1);
    const std::vector<uint64_t> cut = cutAtLevel(dataset, level);
    VCP_TRY_ASSIGN(const auto caster, ReferenceCaster::create(cache, cut));
    const LevelLeaves leavesOfLevel(cache, cut);
    const MeshSampler sampler(mesh.mesh());
    if (sampler.empty()) return Error{.code = ErrorCode::InvalidInput, .message = "the mesh has no triangle with area"};
    const double cell = dataset.cellOf(level);
    double certified = 0;
    for (const uint64_t page : cut) certified = std::max(certified, double(dataset.pages[page].certifiedError));
    SurfaceDistance result;
    result.cell = cell;
    result.certifiedErrorMax = certified;
    SampleRunner runner(options.threads, options.progress);
    const Error cancelled = Error::cancelled();

    std::vector<float> toSurface(options.samples);
    Worst worstOfMesh;
    if (!runner.run(options.samples, 0, 0.6, [&](uint64_t i) {
            SampleRandom random(options.seed, 2 * i);
            const MeshSampler::Sample sample = sampler.sample(i, random);
            const double distance = distanceToSurface(caster, leavesOfLevel, sample, cell, certified);
            toSurface[i] = float(distance);
            worstOfMesh.add(distance, i, sample.position);
        }))
        return cancelled;

    const std::vector<LeafBox> leaves = leavesOfLevel.list();
    std::vector<std::vector<float>> toMesh((options.samples + kBlock - 1) / kBlock), degrees(toMesh.size());
    std::vector<std::vector<ColourSample>> colours(toMesh.size());
    Worst worstOfSurface;
    if (!leaves.empty() && !runner.run(options.samples, 0.6, 1, [&](uint64_t i) {
            SampleRandom random(options.seed, 2 * i + 1);
            std::vector<RayHit> hits;
            // Most lines through a leaf miss its surface.
            const LeafBox& leaf = leaves[random.below(leaves.size())];
            for (int ray = 0; ray < 8 && hits.empty(); ++ray) hitsOfLeaf(caster, leaf, random, hits);
            for (const RayHit& hit : hits) {
                const auto nearest = *mesh.nearestPoint(hit.position);
                toMesh[i / kBlock].push_back(float(nearest.distance));
                worstOfSurface.add(nearest.distance, i, hit.position);
                const glm::dvec3 normal = triangleNormal(mesh.mesh(), nearest.triangle);
                if (normal != glm::dvec3(0)) degrees[i / kBlock].push_back(float(lineDegrees(hit.normal, normal)));
                if (options.paint == nullptr) continue;
                if (const auto difference = differenceAt(cache, hit, options, mesh.mesh(), nearest))
                    colours[i / kBlock].push_back({float(*difference), nodeType(hit.node) == kNodeSlab});
            }
        }))
        return cancelled;

    std::vector<float> allToMesh = joined(toMesh), differences;
    const std::vector<ColourSample> allColours = joined(colours);
    for (const ColourSample& sample : allColours) differences.push_back(sample.deltaE);
    result.samples = toSurface.size() + allToMesh.size();
    result.meshToSurface = quantilesOf(std::move(toSurface));
    result.surfaceToMesh = quantilesOf(std::move(allToMesh));
    result.normalDegrees = quantilesOf(joined(degrees));
    result.colourSamples = allColours.size();
    result.colourDifference = quantilesOf(std::move(differences));
    result.slabColours = slabColoursOf(dataset, cut, allColours);
    result.worstOfMesh = worstOfMesh.position;
    result.worstOfSurface = worstOfSurface.position;
    return result;
}

}  // namespace vcp
