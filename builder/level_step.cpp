#include "builder/level_step.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <glm/geometric.hpp>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include "builder/coarsen.h"

namespace vcp {

Result<void> LevelSink::Batch::add(const LatticeTriangle& t) {
    // A triangle seldom spans more than two bins: the list of those seen is short.
    touched_.clear();
    sink_.grid_.forPagesNear(t.corner, kStepMarginCells, [&](uint64_t page) {
        const size_t bin = sink_.partition_.binOf(page);
        if (std::find(touched_.begin(), touched_.end(), bin) == touched_.end()) touched_.push_back(bin);
    });
    for (const size_t bin : touched_) VCP_TRY(batch_.add(bin, t));
    return {};
}

/// Per vertex of the bin's mesh.
struct LevelStep::Images {
    std::vector<uint32_t> bin;    ///< that the vertex lies in
    std::vector<uint8_t> known;
    std::vector<uint32_t> of;     ///< its number among the following; empty: its own
    const std::vector<glm::i32vec3>* position;
    const std::vector<uint32_t>* colour;
    const std::vector<uint32_t>* normal;
    Clusters clusters;

    void fill(WaitingTriangle& w, int corner, uint32_t vertex) const {
        const uint32_t image = of.empty() ? vertex : of[vertex];
        w.image[corner] = (*position)[image];
        w.colour[corner] = colour->empty() ? 0xffffffffu : (*colour)[image];
        w.normal[corner] = (*normal)[image];
        w.known |= 1u << corner;
    }
};

LevelStep::Images LevelStep::imagesOf(size_t bin, const LatticeMesh& mesh) const {
    Images images;
    if (first_) {
        images.position = &mesh.positions;
        images.colour = &mesh.colours;
        images.normal = &mesh.normals;
    } else {
        images.clusters = clusterVertices(mesh);
        images.of = images.clusters.of;
    }
    images.bin.resize(mesh.positions.size());
    images.known.resize(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.positions.size(), 4096), [&](const auto& range) {
        for (size_t v = range.begin(); v < range.end(); ++v) {
            images.bin[v] = static_cast<uint32_t>(partition_.binOf(grid_.pageOf(mesh.positions[v])));
            images.known[v] = images.bin[v] == bin;
        }
    });
    return images;
}

float LevelStep::strayOf(const WaitingTriangle& w) const {
    if (first_) return w.from.stray;
    double moved = 0;
    for (int i = 0; i < 3; ++i) moved = std::max(moved, glm::length(glm::dvec3(w.from.corner[i]) / 2.0 - glm::dvec3(w.image[i])) / kLatticePerCell);
    return std::nextafter(static_cast<float>(w.from.stray / 2 + moved), 1e9f);
}

Result<void> LevelStep::pass(const WaitingTriangle& w, LevelSink::Batch& batch) {
    if (w.known != 7) {
        size_t lowest = partition_.bins();
        for (int i = 0; i < 3; ++i)
            if (!(w.known >> i & 1)) lowest = std::min(lowest, partition_.binOf(grid_.pageOf(w.from.corner[i])));
        return waiting_.append(lowest, std::span(&w, 1));
    }
    if (!hasArea(w.image[0], w.image[1], w.image[2])) return {};
    LatticeTriangle t;
    for (int i = 0; i < 3; ++i) {
        t.corner[i] = w.image[i];
        t.colour[i] = w.colour[i];
        t.normal[i] = w.normal[i];
    }
    t.stray = strayOf(w);
    return batch.add(t);
}

Result<void> LevelStep::stepWaiting(size_t bin, const LatticeMesh& mesh, const Images& images) {
    VCP_TRY(waiting_.raw().flush(bin));
    LevelSink::Batch batch(sink_);
    for (const RawBins::Block& block : waiting_.raw().blocks(bin)) {
        auto records = waiting_.read(block);
        if (!records) return records.error();
        for (WaitingTriangle& w : *records) {
            for (int i = 0; i < 3; ++i) {
                if (w.known >> i & 1) continue;
                const auto vertex = findVertex(mesh, w.from.corner[i]);
                if (vertex && images.known[*vertex]) images.fill(w, i, *vertex);
            }
            VCP_TRY(pass(w, batch));
        }
    }
    return batch.flush();
}

Result<void> LevelStep::run(size_t bin, const LatticeMesh& mesh) {
    Images images = imagesOf(bin, mesh);
    if (!first_) {
        images.position = &images.clusters.position;
        images.colour = &images.clusters.colour;
        images.normal = &images.clusters.normal;
    }
    VCP_TRY(stepWaiting(bin, mesh, images));
    tbb::enumerable_thread_specific<LevelSink::Batch> batches([&] { return LevelSink::Batch(sink_); });
    std::mutex mutex;
    std::atomic<bool> failed = false;
    Result<void> result;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.triangles.size(), 4096), [&](const auto& range) {
        if (failed) return;
        LevelSink::Batch& batch = batches.local();
        const auto all = [&]() -> Result<void> {
            for (size_t k = range.begin(); k < range.end(); ++k) {
                const auto& v = mesh.triangles[k];
                if (std::min({images.bin[v[0]], images.bin[v[1]], images.bin[v[2]]}) != bin) continue;
                WaitingTriangle w{};
                w.from.stray = mesh.stray[k];
                for (int i = 0; i < 3; ++i) {
                    w.from.corner[i] = mesh.positions[v[i]];
                    if (images.known[v[i]]) images.fill(w, i, v[i]);
                }
                VCP_TRY(pass(w, batch));
            }
            return {};
        };
        if (auto done = all(); !done) {
            const std::scoped_lock lock(mutex);
            if (!failed.exchange(true)) result = done;
        }
    });
    if (failed) return result;
    for (auto& batch : batches) VCP_TRY(batch.flush());
    return {};
}

}  // namespace vcp
