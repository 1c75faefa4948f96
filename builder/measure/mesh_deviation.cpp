#include "builder/measure/mesh_deviation.h"

#include <algorithm>
#include <cmath>

#include "builder/measure/mesh_samples.h"
#include "builder/measure/quantile.h"

namespace vcp {

double DeviationTarget::distance(glm::dvec3 p, double within) const {
    const auto nearest = bvh_.nearestPoint(p, within);
    if (!nearest) return std::numeric_limits<double>::quiet_NaN();
    return sides_.isInside(p, *nearest) ? -nearest->distance : nearest->distance;
}

double Deviation::quantile(double part) const { return vcp::quantile(distances, part); }

double Deviation::absoluteQuantile(double part) const {
    std::vector<double> sizes(distances.size());
    std::ranges::transform(distances, sizes.begin(), [](double d) { return std::abs(d); });
    return vcp::quantile(std::move(sizes), part);
}

Result<Deviation> measureDeviation(const IndexedMesh& mesh, const DeviationTarget& target,
                                   const DeviationOptions& options) {
    const MeshSampler sampler(mesh);
    if (sampler.empty()) return Error{.code = ErrorCode::InvalidInput, .message = "the mesh has no triangle with area"};
    Deviation deviation{.distances = std::vector<double>(options.samples), .samples = options.samples};
    SampleRunner runner(options.threads, options.progress);
    if (!runner.run(options.samples, 0, 1, [&](uint64_t i) {
            SampleRandom random(options.seed, i);
            deviation.distances[i] = target.distance(sampler.pointByArea(random), options.within);
        }))
        return Error::cancelled();
    std::erase_if(deviation.distances, [](double d) { return std::isnan(d); });
    if (deviation.distances.empty())
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "no point of the surface has a counterpart within the distance that was given"};
    std::ranges::sort(deviation.distances);
    double sum = 0, sumOfSizes = 0, sumOfSquares = 0;
    for (const double d : deviation.distances) {
        sum += d;
        sumOfSizes += std::abs(d);
        sumOfSquares += d * d;
    }
    const double count = double(deviation.distances.size());
    deviation.mean = sum / count;
    deviation.meanAbsolute = sumOfSizes / count;
    deviation.rms = std::sqrt(sumOfSquares / count);
    return deviation;
}

Result<std::vector<float>> distancesOf(std::span<const glm::dvec3> points, const DeviationTarget& target,
                                       const DeviationOptions& options) {
    std::vector<float> distances(points.size());
    SampleRunner runner(options.threads, options.progress);
    if (!runner.run(points.size(), 0, 1,
                    [&](uint64_t i) { distances[i] = float(target.distance(points[i], options.within)); }))
        return Error::cancelled();
    return distances;
}

DeviationHistogram histogramOf(const Deviation& deviation, double range, size_t bins) {
    DeviationHistogram histogram{.range = range, .counts = std::vector<uint64_t>(bins)};
    for (const double d : deviation.distances) {
        if (d < -range) {
            ++histogram.below;
        } else if (d > range) {
            ++histogram.above;
        } else {
            const auto bin = size_t((d + range) / (2 * range) * double(bins));
            ++histogram.counts[std::min(bin, bins - 1)];
        }
    }
    return histogram;
}

}  // namespace vcp
