// The methods of the ray benchmark that are ours: the renderer, and the reference ray-caster.
#include "viewer/bench/rays/bench_tracer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>

#include <fmt/format.h>

#include "builder/measure/quantile.h"
#include "builder/paper/parallel_rows.h"
#include "render/view/renderer.h"
#include "streaming/page_source.h"

namespace vcp {

namespace {

class ReferenceTracer final : public RayTracer {
public:
    ReferenceTracer(ReferenceCaster caster, unsigned threads) : caster_(std::move(caster)), threads_(threads) {}

    [[nodiscard]] std::string device() const override { return "CPU, double precision"; }
    [[nodiscard]] uint64_t bytes() const override { return caster_.cache().bytes(); }

    Result<TracedPicture> trace(const Camera& camera, glm::ivec2 size, int) override {
        TracedPicture picture;
        picture.hits.resize(size_t(size.x) * size.y);
        std::mutex mutex;
        const auto start = std::chrono::steady_clock::now();
        forEachRow(size.y, threads_, [&](int y) {
            RaysWork work;
            for (int x = 0; x < size.x; ++x) {
                CastCounters counters;
                const CameraRay ray = cameraRay(camera, uint32_t(size.x), uint32_t(size.y), x + 0.5, y + 0.5);
                const auto hit = caster_.cast({ray.origin, ray.direction}, &counters);
                if (hit) picture.hits[size_t(y) * size.x + x] = SurfaceHit{hit->t, hit->normal, hit->certifiedError};
                work.add(uint32_t(counters.nodes),
                         uint32_t(counters.softLeaves + counters.slabLeaves + counters.hardLeaves),
                         uint32_t(counters.softLeaves + counters.slabLeaves + counters.triangles));
            }
            const std::lock_guard lock(mutex);
            picture.work.merge(work);
        });
        picture.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return picture;
    }

private:
    ReferenceCaster caster_;
    unsigned threads_;
};

/// What the renderer is asked for, and what is certified of its hits.
struct RendererKnob {
    std::string name;
    double errorPixels = 0.5;
    PaperMarch march = {};
    double certifiedError = 0;  // world units; infinite: nothing is certified
};

class RendererTracer final : public RayTracer {
public:
    RendererTracer(std::unique_ptr<Renderer> renderer, RendererKnob knob)
        : renderer_(std::move(renderer)), knob_(std::move(knob)) {}

    [[nodiscard]] std::string device() const override { return renderer_->device().name; }
    [[nodiscard]] std::string knob() const override { return knob_.name; }
    [[nodiscard]] uint64_t bytes() const override { return residentBytes_; }

    Result<TracedPicture> trace(const Camera& camera, glm::ivec2 size, int repetitions) override {
        FrameRequest request;
        request.camera = camera;
        request.width = uint32_t(size.x);
        request.height = uint32_t(size.y);
        request.errorPixels = knob_.errorPixels;
        request.colourError = kMostColourError;
        request.march = knob_.march;
        VCP_TRY_ASSIGN(const auto settled, renderer_->settle(request));
        residentBytes_ = settled.residentBytes;
        TracedPicture picture;
        std::vector<double> seconds;
        for (int repetition = 0; repetition <= repetitions; ++repetition) {
            VCP_TRY_ASSIGN(const auto frame, renderer_->render(request));
            if (repetition > 0) seconds.push_back(frame.msFrame * 1e-3);
        }
        picture.seconds = upperQuantile(seconds, 0.5);
        VCP_TRY(readHits(camera, size, settled.errorPixels, picture));
        VCP_TRY(countWork(request, picture));
        return picture;
    }

private:
    Result<void> readHits(const Camera& camera, glm::ivec2 size, double errorPixels, TracedPicture& picture) {
        VCP_TRY_ASSIGN(const auto depth, renderer_->readDepth());
        VCP_TRY_ASSIGN(const auto normals, renderer_->readNormals());
        // A coarser page's error projects to at most errorPixels where the page is nearest: no more than this
        // many world units at the hit.
        const bool parallel = camera.projection == Projection::Orthographic;
        const double perPixel = 2 * cameraBasis(camera, uint32_t(size.x), uint32_t(size.y)).halfHeight / size.y;
        picture.hits.resize(depth.size());
        for (size_t i = 0; i < depth.size(); ++i) {
            const double t = depth[i];
            if (std::isinf(t)) continue;
            // t is not a number where a ray gave up: the judge calls that unresolved.
            const double allowed = std::isinf(knob_.certifiedError) || std::isnan(t)
                                       ? knob_.certifiedError
                                       : std::max(knob_.certifiedError, errorPixels * perPixel * (parallel ? 1 : t));
            picture.hits[i] = SurfaceHit{t, glm::dvec3(normals[i]), allowed};
        }
        return {};
    }

    /// Counts work ray by ray, from pictures in false colours; rays of tiles that the beam pass proves empty do none.
    Result<void> countWork(FrameRequest request, TracedPicture& picture) {
        const std::pair<ShadingMode, WorkHistogram*> modes[] = {{ShadingMode::Steps, &picture.work.steps},
                                                                {ShadingMode::Cells, &picture.work.cells},
                                                                {ShadingMode::Fetches, &picture.work.fetches}};
        for (const auto& [mode, histogram] : modes) {
            request.shading.mode = mode;
            VCP_TRY(renderer_->render(request));
            VCP_TRY_ASSIGN(const auto work, renderer_->readWork());
            for (const uint32_t count : work) histogram->add(count);
        }
        return {};
    }

    std::unique_ptr<Renderer> renderer_;
    RendererKnob knob_;
    uint64_t residentBytes_ = 0;
};

Result<std::unique_ptr<RayTracer>> makeRendererTracer(std::shared_ptr<const Dataset> dataset,
                                                      std::shared_ptr<const PageSource> source,
                                                      const std::string& device, RendererKnob knob) {
    RendererOptions options;
    options.device = device;
    options.budgetBytes = uint64_t{2} << 30;
    VCP_TRY_ASSIGN(auto renderer, Renderer::create(options));
    VCP_TRY(renderer->open(std::move(dataset), std::move(source)));
    return std::unique_ptr<RayTracer>(std::make_unique<RendererTracer>(std::move(renderer), std::move(knob)));
}

}  // namespace

Result<std::unique_ptr<RayTracer>> makeReferenceTracer(const PageCache& cache, unsigned threads) {
    const auto cut = cutAtLevel(cache.dataset(), cache.dataset().header.levels);
    VCP_TRY_ASSIGN(auto caster, ReferenceCaster::create(cache, cut));
    return std::unique_ptr<RayTracer>(std::make_unique<ReferenceTracer>(std::move(caster), threads));
}

Result<std::unique_ptr<RayTracer>> makeCertifiedTracer(const std::filesystem::path& file, const std::string& device,
                                                       double errorPixels) {
    VCP_TRY_ASSIGN(const auto reader, openFile(file));
    VCP_TRY_ASSIGN(auto dataset, readDataset(*reader));
    const auto shared = std::make_shared<const Dataset>(std::move(dataset));
    return makeRendererTracer(shared, std::make_shared<FilePageSource>(reader, shared), device,
                              {.name = fmt::format("error-pixels {:g}", errorPixels),
                               .errorPixels = errorPixels,
                               .certifiedError = shared->header.certifiedErrorMax});
}

Result<std::unique_ptr<RayTracer>> makePaperGpuTracer(std::shared_ptr<const Dataset> dataset,
                                                      std::shared_ptr<const PageSource> source,
                                                      const std::string& device, const PaperMarch& march) {
    return makeRendererTracer(std::move(dataset), std::move(source), device,
                              {.name = fmt::format("eps {:g}", march.epsilon),
                               .march = march,
                               .certifiedError = std::numeric_limits<double>::infinity()});
}

}  // namespace vcp
