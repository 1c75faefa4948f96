#include "viewer/bench/bench_build.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include <fmt/format.h>
#include <unistd.h>

#include "builder/build.h"
#include "builder/measure/indexed_mesh.h"
#include "builder/measure/quantile.h"
#include "builder/memory_plan.h"
#include "viewer/bench/child_process.h"
#include "viewer/bench/rays/bench_rays.h"
#include "viewer/bench/rays/bench_tracer.h"
#include "viewer/bench/report/bench_folder.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

// Bytes for the mesh, Embree's tree and the oracle's, with what they need while they are built.
constexpr uint64_t kJudgeBytesPerTriangle = 400;

/// Reports what is being done and the fraction of this model; returns an error when the caller wants to stop.
using Report = std::function<Result<void>(const std::string&, double)>;

/// A mesh to build, and where its datasets go.
struct Subject {
    std::string name;
    fs::path mesh, folder;
    bool isGenerated = false;
};

struct Variant {
    BenchBuildRow row;
    fs::path file;
};

/// Passes a value from child to parent as it lies in memory: both are the same program.
template <class T>
std::string bytesOf(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

template <class T>
T valueAt(const std::string& bytes, size_t offset) {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
}

ChildProgress asChildProgress(const Report& report, const std::string& prefix, double from, double to) {
    return [=](const std::string& what, double fraction) {
        return report(what.empty() ? prefix : prefix + ", " + what, from + (to - from) * fraction).ok();
    };
}

BuildOptions buildOptionsFor(const BenchBuildOptions& options, const Subject& subject, const Variant& variant) {
    BuildOptions build;
    build.inputs = {subject.mesh};
    build.output = variant.file;
    build.cell = variant.row.cell;
    build.error = variant.row.errorCells * variant.row.cell;
    build.threads = options.threads;
    build.memoryBytes = options.memoryBytes;
    build.temp = options.temp;
    return build;
}

/// Builds as often as asked for; fills the variant's row. With a cell of 0 the builder chooses.
Result<void> timeBuild(const BenchBuildOptions& options, const Subject& subject, Variant& variant,
                       const Report& report) {
    BenchBuildRow& row = variant.row;
    std::vector<double> seconds, cpuSeconds;
    const BuildOptions build = buildOptionsFor(options, subject, variant);
    for (int repetition = 0; repetition < options.repetitions; ++repetition) {
        const double part = 1.0 / options.repetitions;
        VCP_TRY_ASSIGN(
            const auto outcome,
            runInChild(
                [&](const ChildProgress& progress) -> Result<std::string> {
                    BuildOptions own = build;
                    own.progress = [&](const BuildProgress& at) { return progress(at.stage, at.fraction); };
                    VCP_TRY_ASSIGN(const auto built, buildOctree(own));
                    return bytesOf<BuildFigures>(built);
                },
                asChildProgress(report, subject.name + ": building", repetition * part, (repetition + 1) * part)));
        const auto built = valueAt<BuildFigures>(outcome.value, 0);
        seconds.push_back(built.seconds);
        cpuSeconds.push_back(outcome.cpuSeconds);
        row.triangles = built.triangles;
        row.peakRssBytes = std::max(row.peakRssBytes, outcome.peakRssBytes);
        row.tempBytes = std::max(row.tempBytes, built.tempBytes);
        row.fileBytes = built.fileBytes;
        row.leaves = built.leaves;
        row.hardLeaves = built.hardLeaves;
        row.cell = built.cell;
        row.errorCells = built.errorTarget / built.cell;
        row.certifiedCells = built.certifiedErrorMax / built.cell;
    }
    row.seconds = upperQuantile(seconds, 0.5);
    row.cpuSeconds = upperQuantile(cpuSeconds, 0.5);
    row.trianglesPerSecond = double(row.triangles) / row.seconds;
    return {};
}

/// Runs in a child: measures the distance between a dataset and the mesh that it was built from.
Result<SurfaceDistance> distanceOf(const fs::path& file, const MeshBvh& mesh, const BenchBuildOptions& options,
                                   const std::function<bool(double)>& progress) {
    VCP_TRY_ASSIGN(auto cache, PageCache::open(file));
    VCP_TRY(cache.loadLevel(cache.dataset().header.levels - 1));
    SurfaceDistanceOptions measuring;
    measuring.samples = options.samples;
    measuring.threads = options.threads;
    measuring.progress = progress;
    return measureSurfaceDistance(cache, mesh, measuring);
}

/// Runs in a child: returns the median time of Embree's tree (0 without Embree), then a SurfaceDistance for each file.
Result<std::string> judge(const BenchBuildOptions& options, const fs::path& model, const std::vector<fs::path>& files,
                          const ChildProgress& progress) {
    const auto cancelled = [] { return Error::cancelled(); };
    if (!progress("reading the mesh", 0)) return cancelled();
    VCP_TRY_ASSIGN(const auto mesh, loadMesh(model));
    std::vector<double> embreeSeconds;
    for (int repetition = 0; benchHasEmbree() && repetition < options.repetitions; ++repetition) {
        if (!progress("Embree's tree", 0.1 + 0.3 * repetition / options.repetitions)) return cancelled();
        VCP_TRY_ASSIGN(const auto time, timeEmbreeBuild(mesh, options.threads));
        embreeSeconds.push_back(time);
    }
    std::string value = bytesOf(upperQuantile(embreeSeconds, 0.5));
    if (files.empty()) return value;
    if (!progress("sorting the mesh", 0.4)) return cancelled();
    const MeshBvh bvh(mesh);
    for (size_t i = 0; i < files.size(); ++i) {
        VCP_TRY_ASSIGN(const auto distance, distanceOf(files[i], bvh, options, [&](double fraction) {
                           return progress("measuring the distance",
                                           0.5 + 0.5 * (double(i) + fraction) / double(files.size()));
                       }));
        value += bytesOf(distance);
    }
    return value;
}

/// Writes Embree's time and the distances into the rows.
Result<void> judgeVariants(const BenchBuildOptions& options, const Subject& subject, std::vector<Variant>& variants,
                           const Report& report) {
    if (variants.front().row.triangles * kJudgeBytesPerTriangle > defaultMemoryBytes()) return {};
    std::vector<fs::path> files;
    if (options.samples > 0 && !subject.isGenerated)
        for (const Variant& variant : variants) files.push_back(variant.file);
    if (files.empty() && !benchHasEmbree()) return {};
    VCP_TRY_ASSIGN(
        const auto outcome,
        runInChild([&](const ChildProgress& progress) { return judge(options, subject.mesh, files, progress); },
                   asChildProgress(report, subject.name, 0, 1)));
    for (size_t i = 0; i < variants.size(); ++i) {
        BenchBuildRow& row = variants[i].row;
        row.embreeBvhSeconds = valueAt<double>(outcome.value, 0);
        row.ratioToEmbree = row.embreeBvhSeconds / row.seconds;
        if (i < files.size())
            row.distance = valueAt<SurfaceDistance>(outcome.value, sizeof(double) + i * sizeof(SurfaceDistance));
    }
    return {};
}

/// Measures the default first: its cell is that of the others, which differ only in the tolerance.
Result<std::vector<BenchBuildRow>> measure(const BenchBuildOptions& options, const Subject& subject,
                                           const Report& report) {
    std::vector<double> errors = {0};
    if (!subject.isGenerated) errors.insert(errors.end(), options.errors.begin(), options.errors.end());
    std::vector<Variant> variants;
    for (size_t i = 0; i < errors.size(); ++i) {
        Variant variant;
        variant.row.model = subject.name;
        variant.row.isGenerated = subject.isGenerated;
        variant.row.memoryBytes = options.memoryBytes;
        variant.row.cell = i == 0 ? options.cell : variants.front().row.cell;
        variant.row.errorCells = errors[i];
        variant.file = subject.folder /
                       (i == 0 ? subject.name + ".vcp" : fmt::format("{}_error_{:g}.vcp", subject.name, errors[i]));
        const auto part = [&, i](const std::string& what, double fraction) {
            return report(what, 0.7 * (double(i) + fraction) / double(errors.size()));
        };
        VCP_TRY(timeBuild(options, subject, variant, part));
        variants.push_back(std::move(variant));
    }
    VCP_TRY(judgeVariants(options, subject, variants, [&](const std::string& what, double fraction) {
        return report(what, 0.7 + 0.3 * fraction);
    }));
    std::vector<BenchBuildRow> rows;
    for (Variant& variant : variants) rows.push_back(std::move(variant.row));
    return rows;
}

Result<std::vector<BenchBuildRow>> measureScan(const BenchBuildOptions& options, uint64_t triangles,
                                               const fs::path& folder, const Report& report) {
    Subject subject;
    subject.name = "scan_" + scanSizeName(triangles);
    subject.folder = folder;
    subject.mesh = (options.temp.empty() ? folder : options.temp) / fmt::format("{}-{}.ply", subject.name, ::getpid());
    subject.isGenerated = true;
    VCP_TRY(
        runProgram({options.makeScan.string(), "--triangles", std::to_string(triangles), "-o", subject.mesh.string()},
                   [&] { return report(subject.name + ": making the scan", 0).ok(); }));
    auto rows = measure(options, subject,
                        [&](const std::string& what, double fraction) { return report(what, 0.1 + 0.9 * fraction); });
    std::error_code ignored;
    fs::remove(subject.mesh, ignored);
    return rows;
}

Result<BenchBuildReport> measureAll(const BenchBuildOptions& options, const fs::path& folder) {
    BenchBuildReport result;
    const size_t count = options.models.size() + options.generated.size();
    for (size_t i = 0; i < count; ++i) {
        const Report report = [&](const std::string& what, double fraction) -> Result<void> {
            if (!options.progress || options.progress(what, (double(i) + fraction) / double(count))) return {};
            return Error::cancelled();
        };
        const bool isModel = i < options.models.size();
        auto rows = isModel ? measure(options, {options.models[i].stem().string(), options.models[i], folder}, report)
                            : measureScan(options, options.generated[i - options.models.size()], folder, report);
        if (rows)
            std::move(rows->begin(), rows->end(), std::back_inserter(result.rows));
        else if (rows.error().code == ErrorCode::Cancelled)
            return rows.error();
        else
            result.failures.push_back(rows.error());
    }
    return result;
}

}  // namespace

Quantiles BenchBuildRow::distanceCells() const {
    const Quantiles &a = distance->meshToSurface, &b = distance->surfaceToMesh;
    return {std::max(a.p50, b.p50) / cell, std::max(a.p95, b.p95) / cell, std::max(a.p99, b.p99) / cell,
            std::max(a.max, b.max) / cell};
}

std::string scanSizeName(uint64_t triangles) {
    if (triangles % 1'000'000 == 0) return fmt::format("{}M", triangles / 1'000'000);
    if (triangles % 1'000 == 0) return fmt::format("{}k", triangles / 1'000);
    return std::to_string(triangles);
}

Result<BenchBuildReport> benchBuild(const BenchBuildOptions& options) {
    if (options.models.empty() && options.generated.empty())
        return Error{.code = ErrorCode::Usage, .message = "no model to measure"};
    const BenchFolder folder(options.out);
    VCP_TRY(folder.make());
    return measureAll(options, folder.path());
}

}  // namespace vcp
