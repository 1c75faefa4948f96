#include "viewer/bench/stress/bench_stream.h"

#include <chrono>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "builder/build.h"
#include "streaming/web_address.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/report/bench_folder.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

void leaveSystemCache(const std::string& file) {
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return;
    static_cast<void>(::posix_fadvise(descriptor, 0, 0, POSIX_FADV_DONTNEED));
    ::close(descriptor);
}

class StreamBench {
public:
    explicit StreamBench(const BenchStreamOptions& options) : o_(options), folder_(options.out) {}

    Result<std::vector<StressReport>> run() {
        std::vector<std::string> models = o_.models;
        if (models.empty()) {
            VCP_TRY_ASSIGN(models, buildAnalyticModels());
        }
        const size_t runs = models.size() * o_.paths.size() * o_.budgets.size();
        std::vector<StressReport> rows;
        for (const std::string& model : models) {
            VCP_TRY_ASSIGN(auto file, datasetOf(model));
            for (const std::string& path : o_.paths)
                for (const uint64_t budget : o_.budgets) {
                    done_ = double(rows.size()) / double(runs);
                    share_ = 1.0 / double(runs);
                    VCP_TRY_ASSIGN(auto row, runOne(file, path, budget));
                    rows.push_back(std::move(row));
                }
        }
        return rows;
    }

private:
    [[nodiscard]] bool progress(const std::string& what, double fraction) const {
        return !o_.run.progress || o_.run.progress(what, done_ + share_ * fraction);
    }

    /// Builds the models with cells half as large as other benchmarks take: more to load.
    Result<std::vector<std::string>> buildAnalyticModels() {
        VCP_TRY(folder_.make());
        VCP_TRY_ASSIGN(const auto meshes, writeAnalyticModels(folder_.path()));
        std::vector<std::string> files;
        for (const std::filesystem::path& mesh : meshes) {
            BuildOptions build;
            build.inputs = {mesh};
            build.output = std::filesystem::path(mesh).replace_extension(".vcp");
            build.cell = 0.5 * kAnalyticModelCell;
            const std::string name = mesh.stem().string();
            build.progress = [&](const BuildProgress&) { return progress(fmt::format("{}: building", name), 0); };
            if (const auto built = buildOctree(build); !built) return built.error();
            files.push_back(build.output.string());
        }
        return files;
    }

    Result<std::string> datasetOf(const std::string& model) const {
        BuildOptions build;
        build.progress = [&](const BuildProgress&) { return progress(fmt::format("{}: building", model), 0); };
        VCP_TRY_ASSIGN(auto file, datasetFor({model}, std::move(build)));
        return file.string();
    }

    Result<StressReport> runOne(const std::string& file, const std::string& path, uint64_t budget) const {
        leaveSystemCache(file);
        const auto start = Clock::now();
        VCP_TRY_ASSIGN(const auto open, openDataset(file, o_.access));
        StressOptions run = o_.run;
        run.openSeconds = std::chrono::duration<double>(Clock::now() - start).count();
        run.name = open.isRemote ? shownAddress(file) : std::filesystem::path(file).filename().string();
        run.path = path;
        run.renderer.budgetBytes = budget;
        run.renderer.loaderThreads = open.loaderThreads();
        run.progress = [&](const std::string& what, double fraction) {
            return progress(fmt::format("{}, {}, {}: {}", run.name, path, formatBytes(budget), what), fraction);
        };
        return runStress(open, run);
    }

    const BenchStreamOptions& o_;
    BenchFolder folder_;
    double done_ = 0, share_ = 0;
};

}  // namespace

Result<std::vector<StressReport>> benchStream(const BenchStreamOptions& options) { return StreamBench(options).run(); }

}  // namespace vcp
