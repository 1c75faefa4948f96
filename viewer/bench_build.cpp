#include "viewer/bench_build.h"

#include <algorithm>

#include <fmt/format.h>
#include <unistd.h>

#include "builder/build.h"
#include "builder/indexed_mesh.h"
#include "viewer/bench_rays.h"
#include "viewer/bench_tracer.h"

namespace vcp {

namespace {

Result<BenchBuildRow> runModel(const BenchBuildOptions& options, const std::filesystem::path& model,
                               const std::filesystem::path& folder,
                               const std::function<Result<void>(const std::string&, double)>& report) {
    BenchBuildRow row;
    row.model = model.stem().string();
    std::vector<double> seconds, embreeSeconds;
    // Ours first: the peak of resident memory never goes down, and Embree needs the mesh in memory.
    for (int repetition = 0; repetition < options.repetitions; ++repetition) {
        VCP_TRY(report(row.model + ": building", 0.8 * repetition / options.repetitions));
        BuildOptions build;
        build.inputs = {model};
        build.output = folder / (row.model + ".vcp");
        build.cell = options.cell;
        build.threads = options.threads;
        const auto built = buildOctree(build);
        if (!built) return built.error();
        seconds.push_back(built->seconds);
        row.triangles = built->triangles;
        row.peakRssBytes = std::max(row.peakRssBytes, built->peakRssBytes);
        row.fileBytes = built->fileBytes;
    }
    row.seconds = medianOf(seconds);
    row.trianglesPerSecond = static_cast<double>(row.triangles) / row.seconds;
    if (!benchHasEmbree()) return row;
    VCP_TRY(report(row.model + ": building Embree's tree", 0.8));
    const auto mesh = loadMesh(model);
    if (!mesh) return mesh.error();
    for (int repetition = 0; repetition < options.repetitions; ++repetition) {
        const auto time = timeEmbreeBuild(*mesh, options.threads);
        if (!time) return time.error();
        embreeSeconds.push_back(*time);
    }
    row.embreeBvhSeconds = medianOf(embreeSeconds);
    row.ratioToEmbree = row.embreeBvhSeconds / row.seconds;
    return row;
}

}  // namespace

Result<BenchBuildReport> benchBuild(const BenchBuildOptions& options) {
    if (options.models.empty()) return Error{.code = ErrorCode::Usage, .message = "no model to measure"};
    const bool temporary = options.out.empty();
    const auto folder =
        temporary ? std::filesystem::temp_directory_path() / fmt::format("vcp-bench-{}", ::getpid()) : options.out;
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    if (failed)
        return Error{.code = ErrorCode::Io,
                     .message = "the folder cannot be made: " + failed.message(),
                     .file = folder.string()};
    BenchBuildReport result;
    Result<void> outcome;
    for (size_t i = 0; i < options.models.size() && outcome; ++i) {
        const auto report = [&](const std::string& what, double fraction) -> Result<void> {
            if (!options.progress || options.progress(what, (static_cast<double>(i) + fraction) /
                                                                static_cast<double>(options.models.size())))
                return {};
            return Error{.code = ErrorCode::Cancelled, .message = "cancelled"};
        };
        auto row = runModel(options, options.models[i], folder, report);
        if (row)
            result.rows.push_back(std::move(*row));
        else
            outcome = row.error();
    }
    if (temporary) std::filesystem::remove_all(folder, failed);
    if (!outcome) return outcome.error();
    return result;
}

}  // namespace vcp
