#include "viewer/bench/frames/bench_frames.h"

#include <array>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "render/frame_setup.h"
#include "render/host/hit_light.h"
#include "viewer/bench/frames/frame_drawer.h"
#include "viewer/bench/picture/mesh_picture.h"
#include "viewer/bench/picture/settled_drawing.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/bench_model.h"
#include "viewer/bench/report/bench_folder.h"

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

constexpr uint32_t kOcclusionRays = 8;

struct FrameKind {
    const char* name;
    bool isHitsOnly, shadows;
    uint32_t occlusionRays;
};
constexpr std::array<FrameKind, 4> kKinds = {{{"trace", true, false, 0},
                                              {"light", false, false, 0},
                                              {"shadows", false, true, 0},
                                              {"occlusion", false, false, kOcclusionRays}}};

/// One side's times, and its last picture.
struct Side {
    FrameDrawer& drawer;
    std::vector<double> wallMs = {}, cpuMs = {};
    std::optional<HostPicture> picture = {};

    Result<void> draw(const FrameTask& task) {
        picture.emplace(glm::ivec2(task.request.width, task.request.height), backgroundRows(task.request));
        const auto start = Clock::now();
        const double cpuStart = processorSeconds();
        VCP_TRY(drawer.draw(task, *picture));
        cpuMs.push_back(1e3 * (processorSeconds() - cpuStart));
        wallMs.push_back(1e3 * std::chrono::duration<double>(Clock::now() - start).count());
        return {};
    }
    /// Leaves the warm-up out.
    [[nodiscard]] FrameCost cost() const {
        const auto median = [](const std::vector<double>& ms) {
            return upperQuantile(std::vector<double>(ms.begin() + 1, ms.end()), 0.5);
        };
        return {median(wallMs), median(cpuMs)};
    }
};

FrameTask taskOf(const FrameKind& kind, const Camera& camera, glm::ivec2 size, const Dataset& dataset) {
    FrameTask task;
    task.request = lightRequest(camera, size);
    task.request.shading.shadows = kind.shadows;
    task.request.shading.occlusionRays = kind.occlusionRays;
    task.rays = pictureRays(task.request);
    task.frame = frameConstants(task.request, &dataset, 1, false, task.request.errorPixels);
    task.isHitsOnly = kind.isHitsOnly;
    task.cell = dataset.header.cell;
    return task;
}

uint64_t lightRaysOf(const FrameTask& task, const HostPicture& picture) {
    uint64_t rays = 0;
    const glm::vec3 light(task.frame.lightDirection);
    for (size_t i = 0; i < picture.depth.size(); ++i) {
        if (std::isinf(picture.depth[i])) continue;
        rays += task.frame.occlusionRays;
        if (task.frame.hasShadows != 0 && glm::dot(picture.normals[i], light) > 0) ++rays;
    }
    return rays;
}

void comparePictures(const HostPicture& ours, const HostPicture& theirs, bool hasColours, BenchFramesRow& row) {
    double sum = 0;
    uint64_t both = 0;
    for (size_t i = 0; i < ours.depth.size(); ++i) {
        const bool hit = std::isfinite(ours.depth[i]), other = std::isfinite(theirs.depth[i]);
        row.hits += hit ? 1 : 0;
        row.otherHits += hit != other ? 1 : 0;
        if (!hit || !other) continue;
        ++both;
        sum += std::abs(double(ours.colours[i] & 255) - double(theirs.colours[i] & 255));
    }
    row.differenceMean = hasColours && both > 0 ? sum / double(both) : 0;
}

class FramesBench {
public:
    explicit FramesBench(const BenchFramesOptions& options) : options_(options), folder_(options.out) {}

    Result<std::vector<BenchFramesRow>> run() {
        VCP_TRY(checkNames(options_.cameras, benchCameraNames(), "camera"));
        VCP_TRY(folder_.make());
        for (const auto& model : options_.models) VCP_TRY(runModel(model));
        return std::move(rows_);
    }

private:
    Result<void> report(const std::string& what) const {
        const double all = double(options_.models.size() * options_.cameras.size() * kKinds.size());
        if (!options_.progress || options_.progress(what, double(rows_.size()) / all)) return {};
        return Error::cancelled();
    }

    Result<void> runModel(const std::filesystem::path& path) {
        VCP_TRY_ASSIGN(const auto model, loadBenchModel(path, folder_.path(), options_.cell, options_.threads,
                                                        [&](const std::string& what) { return report(what); }));
        VCP_TRY_ASSIGN(const auto embree, makeEmbreeDrawer(model->mesh, options_.threads));
        const auto host = makeHostDrawer(*model->cache, options_.threads);
        for (const std::string& camera : options_.cameras)
            for (const FrameKind& kind : kKinds) {
                VCP_TRY(report(fmt::format("{}: {}, {}", model->files.name, kind.name, camera)));
                VCP_TRY(runFrame(*model, camera, kind, *host, *embree));
            }
        return {};
    }

    Result<void> runFrame(const BenchModel& model, const std::string& name, const FrameKind& kind, FrameDrawer& host,
                          FrameDrawer& embree) {
        const Dataset& dataset = model.cache->dataset();
        const FileHeader& header = dataset.header;
        const glm::dvec3 origin(header.origin[0], header.origin[1], header.origin[2]);
        const Camera camera = *benchCamera(name, *model.bvh, {origin, header.cell}, options_.size, 0, 1);
        const FrameTask task = taskOf(kind, camera, options_.size, dataset);
        VCP_TRY(host.prepare(task));
        VCP_TRY(embree.prepare(task));
        Side ours{host}, theirs{embree};
        for (int repetition = 0; repetition <= options_.repetitions; ++repetition) {
            Side &first = repetition % 2 == 0 ? ours : theirs, &second = repetition % 2 == 0 ? theirs : ours;
            VCP_TRY(first.draw(task));
            VCP_TRY(second.draw(task));
        }
        BenchFramesRow row{.model = model.files.name, .camera = name, .frame = kind.name};
        row.rays = ours.picture->depth.size();
        row.lightRays = lightRaysOf(task, *ours.picture);
        row.host = ours.cost();
        row.embree = theirs.cost();
        comparePictures(*ours.picture, *theirs.picture, !kind.isHitsOnly, row);
        rows_.push_back(std::move(row));
        return {};
    }

    const BenchFramesOptions& options_;
    BenchFolder folder_;
    std::vector<BenchFramesRow> rows_;
};

}  // namespace

Result<std::vector<BenchFramesRow>> benchFrames(const BenchFramesOptions& options) {
    return FramesBench(options).run();
}

}  // namespace vcp
