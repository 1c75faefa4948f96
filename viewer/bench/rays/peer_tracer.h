// A peer as a method of the ray benchmark: its caster over a picture, row by row on several threads.
#pragma once

#include <chrono>

#include "builder/measure/quantile.h"
#include "builder/paper/octree_walk.h"
#include "builder/paper/parallel_rows.h"
#include "viewer/bench/peers/grid_rays.h"
#include "viewer/bench/rays/bench_tracer.h"

namespace vcp {

/// `Caster` has frame(), bytes() and cast(ray, work), which any thread may call.
template <class Caster>
class PeerTracer final : public RayTracer {
public:
    PeerTracer(std::shared_ptr<const Caster> caster, std::string knob, unsigned threads)
        : caster_(std::move(caster)), knob_(std::move(knob)), threads_(threads) {}

    [[nodiscard]] std::string device() const override { return "CPU, single precision"; }
    [[nodiscard]] std::string knob() const override { return knob_; }
    [[nodiscard]] uint64_t bytes() const override { return caster_->bytes(); }

    Result<TracedPicture> trace(const Camera& camera, glm::ivec2 size, int repetitions) override {
        const GridRays rays(camera, size, caster_->frame());
        std::vector<GridHit> hits(size_t(size.x) * size.y);
        std::vector<double> seconds;
        for (int repetition = 0; repetition <= repetitions; ++repetition) {
            const auto start = std::chrono::steady_clock::now();
            forEachRow(size.y, threads_, [&](int y) {
                NoWork work;
                for (int x = 0; x < size.x; ++x) hits[size_t(y) * size.x + x] = caster_->cast(rays.ray(x, y), work);
            });
            if (repetition > 0)
                seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        TracedPicture picture;
        picture.seconds = upperQuantile(seconds, 0.5);
        picture.hits.resize(hits.size());
        std::vector<RaysWork> works(size.y);
        forEachRow(size.y, threads_, [&](int y) {
            for (int x = 0; x < size.x; ++x) {
                const GridRay ray = rays.ray(x, y);
                RayWork work;
                static_cast<void>(caster_->cast(ray, work));
                works[y].add(work.steps, work.cells, work.fetches);
                const size_t pixel = size_t(y) * size.x + x;
                picture.hits[pixel] = worldHit(ray, hits[pixel]);
            }
        });
        for (const RaysWork& work : works) picture.work.merge(work);
        return picture;
    }

private:
    [[nodiscard]] std::optional<SurfaceHit> worldHit(const GridRay& ray, const GridHit& hit) const {
        if (std::isinf(hit.t)) return {};
        const double length = glm::length(glm::dvec3(hit.normal));
        // The peers promise no bound.
        return SurfaceHit{(ray.tStart + double(hit.t)) * caster_->frame().cell,
                          length > 0 ? glm::dvec3(hit.normal) / length : glm::dvec3(0),
                          std::numeric_limits<double>::infinity()};
    }

    std::shared_ptr<const Caster> caster_;
    std::string knob_;
    unsigned threads_;
};

}  // namespace vcp
