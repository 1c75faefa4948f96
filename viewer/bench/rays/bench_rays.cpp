#include "viewer/bench/rays/bench_rays.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "builder/paper/parallel_rows.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/bench_methods.h"
#include "viewer/bench/rays/bench_model.h"
#include "viewer/bench/report/bench_folder.h"

namespace vcp {

namespace {

class RaysBench {
public:
    explicit RaysBench(const BenchRaysOptions& options) : options_(options), folder_(options.out) {
        if (options_.methods.empty())
            for (const std::string& method : rayMethodNames())
                if ((benchHasEmbree() || !method.starts_with("embree")) && isUsualRayMethod(method))
                    options_.methods.push_back(method);
    }

    Result<BenchRaysReport> run() {
        VCP_TRY(checkNames(options_.methods, rayMethodNames(), "method"));
        VCP_TRY(checkNames(options_.cameras, benchCameraNames(), "camera"));
        VCP_TRY(folder_.make());
        if (options_.models.empty()) {
            VCP_TRY_ASSIGN(options_.models, writeAnalyticModels(folder_.path()));
            if (!(options_.cell > 0)) options_.cell = kAnalyticModelCell;
        }
        for (size_t i = 0; i < options_.models.size(); ++i) {
            modelFrom_ = double(i) / double(options_.models.size());
            modelShare_ = 1.0 / double(options_.models.size());
            VCP_TRY(runModel(options_.models[i]));
        }
        if (options_.stability) VCP_TRY(runStability());
        return std::move(report_);
    }

private:
    Result<void> runStability() {
        StabilityOptions options;
        options.device = options_.device;
        options.threads = options_.threads;
        options.folder = folder_.path();
        options.progress = options_.progress;
        VCP_TRY_ASSIGN(report_.stability, benchStability(options));
        return {};
    }

    Result<void> report(const std::string& what, double fractionOfModel) const {
        if (!options_.progress || options_.progress(what, modelFrom_ + modelShare_ * fractionOfModel)) return {};
        return Error::cancelled();
    }

    Result<void> runModel(const std::filesystem::path& path) {
        VCP_TRY_ASSIGN(const auto model, loadBenchModel(path, folder_.path(), options_.cell, options_.threads,
                                                        [&](const std::string& what) { return report(what, 0); }));
        const BenchModel& m = *model;
        VCP_TRY(m.cache->loadLevel(m.cache->dataset().header.levels - 1));
        std::unique_ptr<RayTracer> peer;
        if (benchHasEmbree()) {
            VCP_TRY_ASSIGN(peer, makeEmbreeTracer(m.mesh, true, options_.threads));
        }
        RayMethods methods({m.mesh, *m.bvh, *m.cache, m.files.vcp, options_.device, options_.threads,
                            m.cache->dataset().header.cell, options_.paper, m.files.mesh, folder_.path()});
        size_t runs = 0, done = 0;
        for (const std::string& method : options_.methods) runs += knobsOf(method).size() * options_.cameras.size();
        const auto fraction = [&] { return 0.1 + 0.9 * double(done) / double(runs); };
        for (const std::string& method : options_.methods)
            for (const double knob : knobsOf(method)) {
                VCP_TRY(report(fmt::format("{}: making {}", m.files.name, method), fraction()));
                VCP_TRY_ASSIGN(auto tracer, methods.make(method, knob));
                for (const std::string& camera : options_.cameras) {
                    VCP_TRY(
                        report(fmt::format("{}: {} {}, {}", m.files.name, method, tracer->knob(), camera), fraction()));
                    VCP_TRY(runCamera(m, method, camera, *tracer, peer.get()));
                    ++done;
                }
            }
        return {};
    }

    [[nodiscard]] std::vector<double> knobsOf(const std::string& method) const {
        if (method.starts_with("paper") && method != "paper-rules" && !options_.sweep)
            return {options_.paper.march.epsilon};
        return rayMethodKnobs(method, options_.sweep);
    }

    Result<void> runCamera(const BenchModel& model, const std::string& method, const std::string& name,
                           RayTracer& tracer, RayTracer* peer) {
        const FileHeader& header = model.cache->dataset().header;
        BenchRaysRow row;
        row.model = model.files.name;
        row.camera = name;
        row.method = method;
        row.knob = tracer.knob();
        row.device = tracer.device();
        row.cell = header.cell;
        RayClassTable classes;
        double seconds = 0, peerSeconds = 0;
        for (int view = 0; view < options_.views; ++view) {
            const Camera camera = *benchCamera(
                name, *model.bvh, {glm::dvec3(header.origin[0], header.origin[1], header.origin[2]), header.cell},
                options_.size, view, options_.views);
            VCP_TRY_ASSIGN(const auto traced, tracer.trace(camera, options_.size, options_.repetitions));
            seconds += traced.seconds;
            row.rays += traced.hits.size();
            row.work.merge(traced.work);
            if (peer) {
                VCP_TRY_ASSIGN(const auto ofPeer, peer->trace(camera, options_.size, options_.repetitions));
                peerSeconds += ofPeer.seconds;
            }
            judge(model, camera, traced, classes);
        }
        row.nsPerRay = 1e9 * seconds / double(row.rays);
        row.ratioToEmbree = peer ? peerSeconds / seconds : 0;
        row.bytes = tracer.bytes();
        row.classes = RaySummary(classes, row.cell);
        report_.rows.push_back(std::move(row));
        return {};
    }

    void judge(const BenchModel& model, const Camera& camera, const TracedPicture& traced,
               RayClassTable& classes) const {
        // In a picture with coarser pages, the largest allowed error is what is excused near silhouettes.
        double error = model.cache->dataset().header.certifiedErrorMax;
        // Peers promise nothing; they are excused as much as ours.
        for (const auto& hit : traced.hits)
            if (hit && std::isfinite(hit->certifiedError)) error = std::max(error, hit->certifiedError);
        const RayJudge judge(*model.bvh, model.cache->dataset().header.cell, error);
        std::mutex mutex;
        const int every = std::max(options_.judgeEvery, 1);
        forEachRow((options_.size.y + every - 1) / every, options_.threads, [&](int row) {
            RayClassTable mine;
            const int y = row * every;
            for (int x = 0; x < options_.size.x; x += every) {
                const CameraRay ray =
                    cameraRay(camera, uint32_t(options_.size.x), uint32_t(options_.size.y), x + 0.5, y + 0.5);
                mine.add(judge.judge(ray.origin, ray.direction, traced.hits[size_t(y) * options_.size.x + x]));
            }
            const std::lock_guard lock(mutex);
            classes.merge(mine);
        });
    }

    BenchRaysOptions options_;
    BenchFolder folder_;
    BenchRaysReport report_;
    double modelFrom_ = 0, modelShare_ = 1;
};

}  // namespace

RaySummary::RaySummary(const RayClassTable& table, double cell)
    : judged(table.rays()),
      holes(table.holes()),
      beyondCertified(table.tooFar()),
      maxOverCertified(table.overCertifiedMax()),
      distanceCells(table.distanceCells(cell)),
      depthCells(table.depthCells(cell)),
      normalDegrees(table.normalDegrees()) {
    for (size_t i = 0; i < fractions.size(); ++i) fractions[i] = table.fraction(static_cast<RayClass>(i));
}

bool benchHasEmbree() {
#ifdef VCP_HAVE_EMBREE
    return true;
#else
    return false;
#endif
}

Result<BenchRaysReport> benchRays(const BenchRaysOptions& options) { return RaysBench(options).run(); }

}  // namespace vcp
