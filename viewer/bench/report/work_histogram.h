// How much work rays took: how many rays took 0, 1, 2, ... steps.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace vcp {

/// Exact up to kLast; rays with more count as kLast.
class WorkHistogram {
public:
    static constexpr uint32_t kLast = 65535;

    void add(uint32_t work) {
        work = std::min(work, kLast);
        if (work >= rays_.size()) rays_.resize(work + 1);
        ++rays_[work];
    }
    void merge(const WorkHistogram& other) {
        rays_.resize(std::max(rays_.size(), other.rays_.size()));
        for (size_t work = 0; work < other.rays_.size(); ++work) rays_[work] += other.rays_[work];
    }
    [[nodiscard]] bool empty() const { return rays_.empty(); }
    [[nodiscard]] uint64_t rays() const {
        uint64_t sum = 0;
        for (const uint64_t count : rays_) sum += count;
        return sum;
    }
    [[nodiscard]] double mean() const {
        double sum = 0;
        for (size_t work = 0; work < rays_.size(); ++work) sum += double(work * rays_[work]);
        return empty() ? 0 : sum / double(rays());
    }
    /// Returns the least work that this part of the rays does not exceed.
    [[nodiscard]] uint32_t quantile(double part) const {
        const auto wanted = uint64_t(std::ceil(part * double(rays())));
        uint64_t sum = 0;
        for (size_t work = 0; work < rays_.size(); ++work) {
            sum += rays_[work];
            if (sum >= wanted) return uint32_t(work);
        }
        return 0;
    }

private:
    std::vector<uint64_t> rays_;
};

/// What rays did, ray by ray: steps (nodes visited, or samples taken), cells (leaves whose surface was looked at), and
/// fetches (reads of at most 16 bytes).
struct RaysWork {
    WorkHistogram steps, cells, fetches;

    void add(uint32_t ofSteps, uint32_t ofCells, uint32_t ofFetches) {
        steps.add(ofSteps);
        cells.add(ofCells);
        fetches.add(ofFetches);
    }
    void merge(const RaysWork& other) {
        steps.merge(other.steps);
        cells.merge(other.cells);
        fetches.merge(other.fetches);
    }
};

}  // namespace vcp
