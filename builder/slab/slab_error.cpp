#include "builder/slab/slab_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "octree/surface/morton.h"

namespace vcp {

namespace {

constexpr int kSide = 4;  // quarters an edge

/// Coordinates count from the leaf's centre, in its edges.
struct Box {
    glm::dvec3 lower, upper;
};

/// The boxes of the surface in the quarters, by place.
class QuarterBoxes {
public:
    explicit QuarterBoxes(std::span<const SurfaceQuarter> quarters) {
        for (const auto& [code, box] : quarters) {
            const glm::ivec3 at(mortonDecode(code));
            const glm::dvec3 lowest = glm::dvec3(at) / double(kSide) - 0.5;
            box_[indexOf(at)] = {lowest + glm::dvec3(box.lower) / (255.0 * kSide),
                                 lowest + glm::dvec3(box.upper) / (255.0 * kSide)};
            isFull_[indexOf(at)] = true;
            octants_ |= octantOf(at);
        }
    }
    [[nodiscard]] bool isDrawn(glm::ivec3 at) const { return (octants_ & octantOf(at)) != 0; }
    /// Returns how far a point in a box is at most from the mesh: from any point of what a quarter around `at` holds.
    /// `enough`: whatever is no more will do.
    [[nodiscard]] double farthest(const Box& points, glm::ivec3 at, double enough) const {
        double least =
            isFull_[indexOf(at)] ? farthestSquared(points, box_[indexOf(at)]) : std::numeric_limits<double>::infinity();
        const glm::ivec3 first = glm::max(at - 1, 0), last = glm::min(at + 1, kSide - 1);
        for (int z = first.z; z <= last.z && least > enough * enough; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    if (const size_t i = indexOf({x, y, z}); isFull_[i])
                        least = std::min(least, farthestSquared(points, box_[i]));
        return std::sqrt(least);
    }

private:
    static double farthestSquared(const Box& a, const Box& b) {
        const glm::dvec3 apart = glm::max(a.upper - b.lower, b.upper - a.lower);
        return glm::dot(apart, apart);
    }
    /// Returns the octant of a quarter, as a bit.
    static uint32_t octantOf(glm::ivec3 at) { return 1u << (at.x / 2 + at.y / 2 * 2 + at.z / 2 * 4); }
    static size_t indexOf(glm::ivec3 at) { return size_t(at.x + kSide * (at.y + kSide * at.z)); }

    std::array<Box, size_t{kSide} * kSide * kSide> box_;  // of those that are full
    std::array<bool, size_t{kSide} * kSide * kSide> isFull_{};
    uint32_t octants_ = 0;
};

}  // namespace

double slabError(glm::dvec3 direction, Extent slab, std::span<const SurfaceQuarter> quarters) {
    const QuarterBoxes boxes(quarters);
    const double reach = (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z)) / (2 * kSide);
    double error = slab.last - slab.first;
    CellSurface cut;  // a quarter, cut by the slab
    cut.axis = glm::vec3(direction);
    cut.first = float(slab.first);
    cut.last = float(slab.last);
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
        const glm::ivec3 at(i % kSide, i / kSide % kSide, i / kSide / kSide);
        const glm::dvec3 lower = glm::dvec3(at) / double(kSide) - 0.5;
        const double along = glm::dot(direction, lower + 0.5 / kSide);
        if (!boxes.isDrawn(at) || along - reach > slab.last || along + reach < slab.first) continue;
        cut.lower = glm::vec3(lower);
        cut.upper = glm::vec3(lower + 1.0 / kSide);
        Box box;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 unit(0);
            unit[axis] = 1;
            const Extent extent = extentAlong(cut, unit);
            box.lower[axis] = extent.first;
            box.upper[axis] = extent.last;
        }
        error = std::max(error, boxes.farthest(box, at, error));
    }
    constexpr double kRounding = 1e-4;
    return error + kRounding;
}

}  // namespace vcp
