// Judges the outcome of rays, and counts their cost.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {

using namespace meso;

MesoJudged judgeMeso(const std::vector<MarchResult>& results, const std::vector<TruthHit>& truths, double texel) {
    MesoJudged judged;
    std::vector<double> errors, angles;
    double counted = 0;
    std::array<double, 6> counts{};
    for (size_t i = 0; i < results.size(); ++i) {
        const MarchResult& found = results[i];
        const TruthHit& truth = truths[i];
        if (!truth.resolved) continue;
        ++counted;
        MesoClass c = MesoClass::Unresolved;
        if (found.state == MarchState::Miss) c = truth.hit ? MesoClass::Missed : MesoClass::Miss;
        if (found.state == MarchState::Hit) {
            const double error = std::abs(found.t - truth.t) / texel;
            c = !truth.hit ? MesoClass::False : error > 2 ? MesoClass::WrongFeature : MesoClass::Hit;
            if (c == MesoClass::Hit) {
                errors.push_back(error);
                if (found.normal != glm::vec3(0))
                    angles.push_back(
                        std::acos(std::clamp(glm::dot(glm::dvec3(found.normal), truth.normal), -1.0, 1.0)) * 180 /
                        std::numbers::pi);
            }
        }
        ++counts[size_t(c)];
    }
    for (size_t i = 0; i < counts.size(); ++i) judged.fractions[i] = counted > 0 ? counts[i] / counted : 0;
    judged.p50 = upperQuantile(errors, 0.5), judged.p95 = upperQuantile(errors, 0.95),
    judged.p99 = upperQuantile(errors, 0.99), judged.max = upperQuantile(errors, 1);
    judged.hasNormals = !angles.empty();
    judged.normalP50 = upperQuantile(angles, 0.5), judged.normalP95 = upperQuantile(angles, 0.95);
    return judged;
}

void countWork(const std::vector<MarchResult>& results, BenchMesoRow& row) {
    std::vector<double> iterations;
    for (const MarchResult& r : results) {
        row.fetchesMean += r.fetches, row.iterationsMean += r.iterations, row.surfaceTestsMean += r.surfaceTests;
        row.surfaceTestsMost = std::max<uint64_t>(row.surfaceTestsMost, r.surfaceTests);
        row.iterationBins[r.iterations <= 10 ? 0 : r.iterations <= 34 ? 1 : r.iterations <= 59 ? 2 : 3] += 1;
        iterations.push_back(r.iterations);
    }
    const double n = std::max<double>(1, double(results.size()));
    for (double* sum : {&row.fetchesMean, &row.iterationsMean, &row.surfaceTestsMean, &row.iterationBins[0],
                        &row.iterationBins[1], &row.iterationBins[2], &row.iterationBins[3]})
        *sum /= n;
    int groups = 0;
    for (size_t i = 0; i + 8 <= iterations.size(); i += 8, ++groups) {
        double most = 0, sum = 0;
        for (size_t k = i; k < i + 8; ++k) most = std::max(most, iterations[k]), sum += iterations[k];
        row.divergence8 += most / (sum / 8);
    }
    if (groups > 0) row.divergence8 /= groups;
    row.iterationsP95 = upperQuantile(iterations, 0.95);
}

}  // namespace vcp
