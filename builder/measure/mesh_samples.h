// Random points of a mesh, and threads that go through many of them. Seeded: the numbers are the same whatever the
// number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <mutex>
#include <numbers>
#include <thread>
#include <vector>

#include "builder/measure/indexed_mesh.h"

namespace vcp {

/// SplitMix64 (Steele, Lea and Flood 2014): a stream of its own for every sample.
class SampleRandom {
public:
    SampleRandom(uint64_t seed, uint64_t sample) : state_(seed * 0x9e3779b97f4a7c15u ^ sample * 0xd1342543de82ef95u) {}

    uint64_t next() {
        uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
        z = (z ^ z >> 27) * 0x94d049bb133111ebu;
        return z ^ z >> 31;
    }
    double unit() { return double(next() >> 11) * 0x1p-53; }
    uint64_t below(uint64_t count) { return std::min(uint64_t(unit() * double(count)), count - 1); }
    glm::dvec3 direction() {
        const double z = 2 * unit() - 1, phi = 2 * std::numbers::pi * unit();
        const double r = std::sqrt(std::max(1 - z * z, 0.0));
        return {r * std::cos(phi), r * std::sin(phi), z};
    }

private:
    uint64_t state_;
};

/// Runs work for many samples, in blocks, on threads.
class SampleRunner {
public:
    static constexpr uint64_t kBlock = 512;

    /// `threads`: 0: one a processor. `progress`: called from one thread at a time; false cancels; may be empty, and
    /// must outlive this.
    SampleRunner(unsigned threads, const std::function<bool(double)>& progress)
        : progress_(progress), threads_(threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency())) {}

    /// Runs `work(sample)` for all samples below `count`. The progress goes from `from` to `to`. Returns false when
    /// cancelled.
    template <class Work>
    bool run(uint64_t count, double from, double to, const Work& work) {
        std::atomic<uint64_t> next{0};
        std::atomic<bool> cancelled{false};
        const uint64_t blocks = (count + kBlock - 1) / kBlock;
        const auto loop = [&] {
            for (uint64_t block = next++; block < blocks && !cancelled; block = next++) {
                for (uint64_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) work(i);
                if (!report(from + (to - from) * double(block + 1) / double(blocks))) cancelled = true;
            }
        };
        std::vector<std::thread> threads;
        for (unsigned t = 1; t < threads_; ++t) threads.emplace_back(loop);
        loop();
        for (std::thread& thread : threads) thread.join();
        return !cancelled;
    }

private:
    bool report(double fraction) {
        if (!progress_) return true;
        const std::lock_guard lock(mutex_);
        done_ = std::max(done_, fraction);
        return progress_(done_);
    }

    const std::function<bool(double)>& progress_;
    unsigned threads_;
    std::mutex mutex_;
    double done_ = 0;
};

/// Chooses random points of a mesh. Triangles without area are not part of the surface: scans have hairs of them that
/// stick out.
class MeshSampler {
public:
    /// `mesh` must outlive this.
    explicit MeshSampler(const IndexedMesh& mesh);

    /// Whether no triangle has area.
    [[nodiscard]] bool empty() const { return triangles_.empty(); }

    struct Sample {
        glm::dvec3 position, normal;
    };

    /// Returns a point of the surface, all alike. Precondition: not empty.
    [[nodiscard]] glm::dvec3 pointByArea(SampleRandom& random) const;
    /// Returns a point by area, on an edge or at a vertex, in the ratio 2 : 1 : 1 as `number` counts. Precondition: not
    /// empty.
    Sample sample(uint64_t number, SampleRandom& random) const;

private:
    uint64_t byArea(SampleRandom& random) const;

    const IndexedMesh& mesh_;
    std::vector<uint32_t> triangles_;  ///< triangles with area
    std::vector<double> areaUpTo_;     ///< their areas, summed up
};

}  // namespace vcp
