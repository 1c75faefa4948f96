// How far one surface lies from another, with a sign: `vcp compare`.
//
// The distance of a point from a mesh is exact (MeshBvh). Its sign is that of the side that the mesh's triangles face:
// positive in front of them, outside of a closed mesh (MeshSides, which says where the sign means nothing). Figures are
// of points of the first surface, spread evenly over its area, and seeded: they do not depend on the number of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "builder/measure/mesh_bvh.h"
#include "builder/measure/mesh_sides.h"
#include "octree/io/result.h"

namespace vcp {

/// A mesh that distances are measured from. About 200 bytes a triangle beside the mesh, which must outlive it.
class DeviationTarget {
public:
    explicit DeviationTarget(const IndexedMesh& mesh) : bvh_(mesh), sides_(mesh) {}

    /// Returns the signed distance of a point; NaN where the mesh is farther than `within`. Any thread.
    [[nodiscard]] double distance(glm::dvec3 p, double within = std::numeric_limits<double>::infinity()) const;

private:
    MeshBvh bvh_;
    MeshSides sides_;
};

struct DeviationOptions {
    uint64_t samples = 200'000;
    uint64_t seed = 1;
    double within = std::numeric_limits<double>::infinity();  ///< points farther away have no counterpart
    unsigned threads = 0;                                     ///< 0: one a processor
    /// Called from one thread at a time with the fraction done; false cancels. May be empty.
    std::function<bool(double)> progress = {};
};

/// Figures of signed distances, world units.
struct Deviation {
    std::vector<double> distances;  ///< of the samples that have one, ascending
    uint64_t samples = 0;           ///< all samples
    double mean = 0, rms = 0;
    double meanAbsolute = 0;

    /// Returns the distance that a part of the samples does not exceed: 0.5 is the median.
    [[nodiscard]] double quantile(double part) const;
    /// Returns the size that a part of the distances does not exceed in size.
    [[nodiscard]] double absoluteQuantile(double part) const;
    /// Returns how many samples have no distance.
    [[nodiscard]] uint64_t withoutCounterpart() const { return samples - distances.size(); }
};

/// Measures how far points of `mesh` are from the target. Errors: InvalidInput, where no triangle has area or no point
/// a counterpart; Cancelled.
Result<Deviation> measureDeviation(const IndexedMesh& mesh, const DeviationTarget& target,
                                   const DeviationOptions& options = {});

/// Returns the signed distances of points, NaN as above. Errors: Cancelled.
Result<std::vector<float>> distancesOf(std::span<const glm::dvec3> points, const DeviationTarget& target,
                                       const DeviationOptions& options = {});

/// Counts of distances in bins of one width between -range and range, and of those beyond.
struct DeviationHistogram {
    double range = 0;
    std::vector<uint64_t> counts;
    uint64_t below = 0, above = 0;

    [[nodiscard]] double binWidth() const { return 2 * range / double(counts.size()); }
    [[nodiscard]] double lowerEnd(size_t bin) const { return -range + double(bin) * binWidth(); }
};
/// `range` > 0; the last bin has its upper end, too.
DeviationHistogram histogramOf(const Deviation& deviation, double range, size_t bins);

}  // namespace vcp
