#include "builder/level/stray_bound.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/level/triangle_cover.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

constexpr uint32_t kNone = VertexClusters::kNone;

// Bounds below this, in coarse cells, are not improved: a page's error is that of its worst triangle.
constexpr double kEnough = 0.25;
// Where the corners moved no farther than this, their motion is the bound.
constexpr double kSmallMotion = 0.1;

// A part of a coarse triangle with more fine triangles near it is quartered, up to so many times.
constexpr size_t kManyPieces = 32;
constexpr int kPartHalvings = 5;

using Index3 = std::array<uint32_t, 3>;

/// For each cluster, the triangles that have it.
class Fans {
public:
    template <class Corners>
    Fans(size_t clusters, size_t triangles, const Corners& corners) : begin_(clusters + 1, 0) {
        for (size_t k = 0; k < triangles; ++k) forDistinct(corners(k), clusters, [&](uint32_t c) { ++begin_[c + 1]; });
        for (size_t c = 0; c < clusters; ++c) begin_[c + 1] += begin_[c];
        all_.resize(begin_.back());
        std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
        for (size_t k = 0; k < triangles; ++k)
            forDistinct(corners(k), clusters, [&](uint32_t c) { all_[next[c]++] = uint32_t(k); });
    }
    /// Returns the triangles at any of the corners, ascending.
    void around(const Index3& corners, std::vector<uint32_t>& out) const {
        out.clear();
        forDistinct(corners, begin_.size() - 1,
                    [&](uint32_t c) { out.insert(out.end(), all_.begin() + begin_[c], all_.begin() + begin_[c + 1]); });
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
    }

private:
    template <class Visit>
    static void forDistinct(const Index3& c, size_t clusters, const Visit& visit) {
        for (int i = 0; i < 3; ++i)
            if (c[i] < clusters && (i < 1 || c[i] != c[0]) && (i < 2 || c[i] != c[1])) visit(c[i]);
    }

    std::vector<uint32_t> begin_, all_;
};

struct Box {
    glm::dvec3 low, high;
    explicit Box(const Triangle3& t)
        : low(glm::min(t[0], glm::min(t[1], t[2]))), high(glm::max(t[0], glm::max(t[1], t[2]))) {}
    [[nodiscard]] double distanceSquared(const Box& other) const {
        const glm::dvec3 gap = glm::max(glm::max(other.low - high, low - other.high), 0.0);
        return glm::dot(gap, gap);
    }
};

Index3 clustersAt(const LatticeMesh& fine, const VertexClusters& clusters, size_t k) {
    const Index3& t = fine.triangles[k];
    return {clusters.ofVertex[t[0]], clusters.ofVertex[t[1]], clusters.ofVertex[t[2]]};
}

/// The meshes that all threads work on.
struct Meshes {
    Meshes(const LatticeMesh& fineMesh, const VertexClusters& vertexClusters, const CoarseTriangles& coarseTriangles)
        : fine(fineMesh),
          clusters(vertexClusters),
          coarse(coarseTriangles),
          coarseFans(clusters.positions.size(), coarse.mesh.triangles.size(),
                     [&](size_t k) { return coarse.mesh.triangles[k]; }),
          fineFans(clusters.positions.size(), fine.triangles.size(),
                   [&](size_t k) { return clustersAt(fine, clusters, k); }),
          stray(coarse.mesh.triangles.size(), 0),
          moved(coarse.mesh.triangles.size(), std::numeric_limits<double>::infinity()) {
        prisms.reserve(stray.size());
        for (const Index3& t : coarse.mesh.triangles) {
            Triangle3 corners;
            for (int i = 0; i < 3; ++i) corners[i] = glm::dvec3(coarse.mesh.positions[t[i]]) / double(kLatticePerCell);
            prisms.emplace_back(corners);
        }
    }

    const LatticeMesh& fine;
    const VertexClusters& clusters;
    const CoarseTriangles& coarse;
    Fans coarseFans, fineFans;
    std::vector<TrianglePrism> prisms;  ///< prisms of the coarse triangles
    std::vector<double> stray;
    std::vector<double> moved;  ///< least motion of a preimage, with its stray; infinite for kept thin parts
};

/// One thread's work on the meshes.
class StrayBound {
public:
    explicit StrayBound(Meshes& meshes)
        : fine_(meshes.fine),
          clusters_(meshes.clusters),
          coarse_(meshes.coarse),
          coarseFans_(meshes.coarseFans),
          fineFans_(meshes.fineFans),
          prisms_(meshes.prisms),
          stray_(meshes.stray),
          moved_(meshes.moved) {}

    void moveFine(size_t k) {
        const uint32_t image = coarse_.imageOf[k];
        if (image != kNone && !isLongFine(k))
            moved_[image] = std::min(moved_[image], motionOf(k) + double(fine_.stray[k]) / 2);
    }
    void boundFine(size_t k);
    void boundCoarse(size_t k);

private:
    [[nodiscard]] Index3 clustersOf(size_t k) const { return clustersAt(fine_, clusters_, k); }
    /// Raises a stray: the largest value counts, whichever thread comes first.
    void raise(size_t coarse, double stray) {
        const std::atomic_ref<double> shared(stray_[coarse]);
        double now = shared.load(std::memory_order_relaxed);
        while (now < stray && !shared.compare_exchange_weak(now, stray, std::memory_order_relaxed)) {
        }
    }
    [[nodiscard]] bool isLongFine(size_t k) const {
        const Index3& t = fine_.triangles[k];
        return isLong(fine_.positions[t[0]], fine_.positions[t[1]], fine_.positions[t[2]]);
    }
    /// A fine triangle in coarse cells; corners by position, so that their numbering does not show in the last bit.
    [[nodiscard]] Triangle3 fineTriangle(size_t k) const {
        std::array<glm::i32vec3, 3> p;
        for (int i = 0; i < 3; ++i) p[i] = fine_.positions[fine_.triangles[k][i]];
        std::sort(p.begin(), p.end(), [](glm::i32vec3 a, glm::i32vec3 b) {
            return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
        });
        Triangle3 t;
        for (int i = 0; i < 3; ++i) t[i] = glm::dvec3(p[i]) / (2.0 * kLatticePerCell);
        return t;
    }
    /// Returns how far a fine triangle's points move to its image's.
    [[nodiscard]] double motionOf(size_t k) const {
        double squared = 0;
        for (const uint32_t v : fine_.triangles[k]) {
            const glm::dvec3 d =
                glm::dvec3(fine_.positions[v]) / 2.0 - glm::dvec3(clusters_.positions[clusters_.ofVertex[v]]);
            squared = std::max(squared, glm::dot(d, d));
        }
        return std::sqrt(squared) / kLatticePerCell;
    }

    static bool overlap(const TrianglePrism& prism, const Triangle3& t) {
        TrianglePrism::Heights a, b, c;
        prism.heights(t[0], a);
        prism.heights(t[1], b);
        prism.heights(t[2], c);
        for (int s = 0; s < 3; ++s)
            if (std::min(a[s], std::min(b[s], c[s])) >= 0) return false;
        return true;
    }

    /// Bounds a part of a coarse triangle, against pieces_[begin, end); `reach` is a bound that is known already.
    /// Where the pieces are many, the part is quartered, so that each quarter has its own few.
    double boundPart(const TrianglePrism& prism, const Triangle3& part, size_t begin, size_t end, double reach,
                     int halvings) {
        const glm::dvec3 centre = (part[0] + part[1] + part[2]) / 3.0;
        double radius = 0;
        for (const glm::dvec3& p : part) radius = std::max(radius, glm::distance(p, centre));
        for (size_t i = begin; i < end; ++i)
            reach = std::min(reach, glm::distance(pieces_[i].corners[0], centre) + radius + pieces_[i].stray);
        if (reach <= kEnough && halvings < kPartHalvings) return reach;
        const Box box(part);
        const size_t first = pieces_.size();
        for (size_t i = begin; i < end; ++i) {
            const double left = reach - pieces_[i].stray;
            const FinePiece piece = pieces_[i];
            if (left >= 0 && box.distanceSquared(Box(piece.corners)) <= left * left) pieces_.push_back(piece);
        }
        double bound = 0;
        if (pieces_.size() - first > kManyPieces && halvings > 0) {
            const glm::dvec3 ab = (part[0] + part[1]) * 0.5, bc = (part[1] + part[2]) * 0.5,
                             ca = (part[2] + part[0]) * 0.5;
            const size_t last = pieces_.size();
            for (const Triangle3& quarter : {Triangle3{part[0], ab, ca}, Triangle3{ab, part[1], bc},
                                             Triangle3{ca, bc, part[2]}, Triangle3{ab, bc, ca}})
                bound = std::max(bound, boundPart(prism, quarter, first, last, reach, halvings - 1));
        } else {
            bound = std::min(reach, coverPart(prism, part, first));
        }
        pieces_.resize(first);
        return bound;
    }

    double coverPart(const TrianglePrism& prism, const Triangle3& part, size_t first) {
        order_.clear();
        ownPrisms_.clear();
        for (size_t i = first; i < pieces_.size(); ++i) {
            double away = pieces_[i].stray;
            for (const glm::dvec3& p : pieces_[i].corners) away = std::max(away, pieces_[i].stray + prism.away(p));
            order_.push_back({away, uint32_t(ownPrisms_.size())});
            ownPrisms_.emplace_back(pieces_[i].corners, pieces_[i].stray);
        }
        std::sort(order_.begin(), order_.end(), [&](const auto& a, const auto& b) {
            return a.first != b.first ? a.first < b.first
                                      : lessThan(ownPrisms_[a.second].corners, ownPrisms_[b.second].corners);
        });
        others_.clear();
        for (const auto& [away, n] : order_) others_.push_back(&ownPrisms_[n]);
        return cover_.bound(part, others_);
    }

    /// Handles a kept thin part: where only long triangles lie along it, only they are at hand at both of its ends.
    void keepThoseAlong(const Index3& t) {
        const size_t clusters = clusters_.positions.size();
        const auto along = [&](uint32_t n) {
            const Index3 c = clustersOf(n);
            return std::all_of(t.begin(), t.end(),
                               [&](uint32_t v) { return v >= clusters || v == c[0] || v == c[1] || v == c[2]; });
        };
        if (std::any_of(near_.begin(), near_.end(), [&](uint32_t n) { return along(n) && !isLongFine(n); })) return;
        std::erase_if(near_, [&](uint32_t n) { return !along(n); });
    }

    static bool lessThan(const Triangle3& a, const Triangle3& b) {
        for (int i = 0; i < 3; ++i)
            for (int axis = 0; axis < 3; ++axis)
                if (a[i][axis] != b[i][axis]) return a[i][axis] < b[i][axis];
        return false;
    }

    struct FinePiece {
        Triangle3 corners;
        double stray;
    };

    const LatticeMesh& fine_;
    const VertexClusters& clusters_;
    const CoarseTriangles& coarse_;
    const Fans &coarseFans_, &fineFans_;
    const std::vector<TrianglePrism>& prisms_;
    std::vector<double>&stray_, &moved_;

    TriangleCover cover_{kEnough};
    std::vector<uint32_t> near_;
    std::vector<std::pair<double, uint32_t>> order_;
    std::vector<FinePiece> pieces_;  ///< a stack: the pieces of each part in work
    std::vector<TrianglePrism> ownPrisms_;
    std::vector<const TrianglePrism*> others_;
    std::vector<double> worst_;
};

void StrayBound::boundFine(size_t k) {
    const double before = double(fine_.stray[k]) / 2, moved = motionOf(k) + before;
    const uint32_t image = coarse_.imageOf[k];
    if (isLongFine(k)) return;
    if (image != kNone && moved - before <= kSmallMotion) {
        raise(image, moved);
        return;
    }
    coarseFans_.around(clustersOf(k), near_);
    const Triangle3 t = fineTriangle(k);
    order_.clear();
    for (const uint32_t c : near_) {
        double away = 0;
        for (const glm::dvec3& p : t) away = std::max(away, prisms_[c].away(p));
        order_.push_back({away, c});
    }
    std::sort(order_.begin(), order_.end());
    others_.clear();
    for (const auto& [away, c] : order_) others_.push_back(&prisms_[c]);
    worst_.assign(others_.size(), 0);
    cover_.bound(t, others_, worst_);
    for (size_t i = 0; i < worst_.size(); ++i)
        if (worst_[i] > 0) raise(order_[i].second, worst_[i] + before);
}

void StrayBound::boundCoarse(size_t k) {
    const Index3& t = coarse_.mesh.triangles[k];
    const bool isImage = moved_[k] < std::numeric_limits<double>::infinity();
    if (moved_[k] <= stray_[k] || moved_[k] <= kSmallMotion) {
        stray_[k] = std::max(stray_[k], moved_[k]);
        return;
    }
    fineFans_.around(t, near_);
    if (!isImage) keepThoseAlong(t);
    // The triangles over or under it are enough, except at ridges and borders.
    pieces_.clear();
    for (const uint32_t n : near_)
        if (const FinePiece piece{fineTriangle(n), double(fine_.stray[n]) / 2}; overlap(prisms_[k], piece.corners))
            pieces_.push_back(piece);
    double bound = boundPart(prisms_[k], prisms_[k].corners, 0, pieces_.size(), moved_[k], kPartHalvings);
    if (bound > kEnough) {
        pieces_.clear();
        for (const uint32_t n : near_) pieces_.push_back({fineTriangle(n), double(fine_.stray[n]) / 2});
        bound = boundPart(prisms_[k], prisms_[k].corners, 0, pieces_.size(), std::min(bound, moved_[k]), kPartHalvings);
    }
    stray_[k] = std::max(stray_[k], std::min(moved_[k], bound));
}

}  // namespace

std::vector<float> boundStray(const LatticeMesh& fine, const VertexClusters& clusters, const CoarseTriangles& coarse) {
    Meshes meshes(fine, clusters, coarse);
    tbb::enumerable_thread_specific<StrayBound> workers([&] { return StrayBound(meshes); });
    for (size_t k = 0; k < fine.triangles.size(); ++k) workers.local().moveFine(k);
    const auto forAll = [&](size_t count, void (StrayBound::*bound)(size_t)) {
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 256), [&](const auto& range) {
            StrayBound& worker = workers.local();
            for (size_t k = range.begin(); k < range.end(); ++k) (worker.*bound)(k);
        });
    };
    forAll(fine.triangles.size(), &StrayBound::boundFine);
    forAll(meshes.stray.size(), &StrayBound::boundCoarse);
    std::vector<float> stray(meshes.stray.size());
    for (size_t k = 0; k < stray.size(); ++k)
        stray[k] = std::nextafter(float(meshes.stray[k]), std::numeric_limits<float>::infinity());
    return stray;
}

}  // namespace vcp
