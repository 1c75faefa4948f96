#include "builder/paper/region_growing.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"

namespace vcp {

namespace {

constexpr uint32_t kNoTriangle = ~uint32_t{0};

/// The nearest triangle of a point so far.
struct Owner {
    uint32_t triangle = kNoTriangle;
    double squared = std::numeric_limits<double>::infinity();  // world units

    /// Takes the nearer of two; among equals the lower number, whatever the order.
    void offer(uint32_t other, double distance2) {
        if (distance2 < squared || (distance2 == squared && other < triangle)) *this = {other, distance2};
    }
};

class RegionGrowing {
public:
    RegionGrowing(const IndexedMesh& mesh, const RootGrid& frame, unsigned threads,
                  const GridPoints<CornerSample>& points)
        : mesh_(mesh), frame_(frame), threads_(threads), points_(points), owners_(points.slots()) {}

    void insertTriangles() {
        for (uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
            const auto [a, b, c] = mesh_.corners(t);
            const glm::ivec3 low(glm::floor(frame_.gridFromWorld(glm::min(a, glm::min(b, c)))));
            const glm::ivec3 high(glm::ceil(frame_.gridFromWorld(glm::max(a, glm::max(b, c)))));
            const glm::dvec3 count = high - low + 1;
            if (count.x * count.y * count.z < double(points_.slots()))
                insertInto(t, low, high);
            else
                insertIntoAll(t, low, high);
        }
    }

    void grow() {
        std::vector<Owner> next(owners_.size());
        forEachIndex(owners_.size(), threads_, [&](size_t slot) {
            if (points_.isUsed(slot)) next[slot] = bestAround(slot);
        });
        owners_.swap(next);
    }

    [[nodiscard]] CornerSample sampleOf(size_t slot) const {
        if (owners_[slot].triangle == kNoTriangle) return CornerSample::unreached();
        const glm::dvec3 p = worldOf(slot);
        const glm::dvec3 v = (closestTo(p, owners_[slot].triangle) - p) / frame_.cell;
        return {glm::vec3(v), float(glm::length(v))};
    }

private:
    [[nodiscard]] glm::dvec3 worldOf(size_t slot) const {
        return frame_.worldFromGrid(glm::dvec3(points_.pointAt(slot)));
    }
    [[nodiscard]] glm::dvec3 closestTo(glm::dvec3 p, uint32_t triangle) const {
        const auto [a, b, c] = mesh_.corners(triangle);
        return closestPointOfTriangle(p, a, b, c);
    }
    void offer(size_t slot, Owner& owner, uint32_t triangle) const {
        const glm::dvec3 p = worldOf(slot), v = closestTo(p, triangle) - p;
        owner.offer(triangle, glm::dot(v, v));
    }

    void insertInto(uint32_t triangle, glm::ivec3 low, glm::ivec3 high) {
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x)
                    if (const auto slot = points_.slotAt({x, y, z})) offer(*slot, owners_[*slot], triangle);
    }
    /// Handles a box with more grid points than there are points that count.
    void insertIntoAll(uint32_t triangle, glm::ivec3 low, glm::ivec3 high) {
        forEachIndex(owners_.size(), threads_, [&](size_t slot) {
            if (!points_.isUsed(slot)) return;
            const glm::ivec3 p = points_.pointAt(slot);
            if (p == glm::clamp(p, low, high)) offer(slot, owners_[slot], triangle);
        });
    }

    [[nodiscard]] Owner bestAround(size_t slot) const {
        const glm::ivec3 p = points_.pointAt(slot);
        Owner best = owners_[slot];
        std::array<uint32_t, 26> tried;
        size_t count = 0;
        for (int k = 0; k < 27; ++k) {
            const glm::ivec3 q = p + glm::ivec3(k % 3, k / 3 % 3, k / 9) - 1;
            const auto neighbour =
                k == 13 || glm::min(q, glm::ivec3(0)) != glm::ivec3(0) ? std::nullopt : points_.slotAt(q);
            if (!neighbour) continue;
            const uint32_t triangle = owners_[*neighbour].triangle;
            const auto end = tried.begin() + std::ptrdiff_t(count);
            if (triangle == kNoTriangle || triangle == owners_[slot].triangle ||
                std::find(tried.begin(), end, triangle) != end)
                continue;
            tried[count++] = triangle;
            offer(slot, best, triangle);
        }
        return best;
    }

    const IndexedMesh& mesh_;
    const RootGrid& frame_;
    unsigned threads_;
    const GridPoints<CornerSample>& points_;
    std::vector<Owner> owners_;  // one for each slot
};

}  // namespace

void growClosestPoints(const IndexedMesh& mesh, const RootGrid& frame, int rounds, unsigned threads,
                       GridPoints<CornerSample>& points) {
    RegionGrowing growing(mesh, frame, threads, points);
    growing.insertTriangles();
    for (int round = 0; round < rounds; ++round) growing.grow();
    points.fillSlots(threads, [&](size_t slot) { return growing.sampleOf(slot); });
}

}  // namespace vcp
