#include "viewer/scene/dataset_opening.h"

#include <utility>

#include <fmt/format.h>

#include "streaming/web_address.h"

namespace vcp {

std::string nameOf(const std::vector<std::string>& inputs) {
    if (inputs.empty()) return {};
    std::string first = std::filesystem::path(shownAddress(inputs.front())).filename().string();
    return inputs.size() == 1 ? first : fmt::format("{} and {} more", first, inputs.size() - 1);
}

Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildSettings& build,
                              const SourceAccess& source, const std::function<bool(const BuildProgress&)>& progress) {
    VCP_TRY_ASSIGN(const auto kind, kindOf(inputs));
    SceneFile file;
    if (kind == InputKind::Scene) {
        VCP_TRY_ASSIGN(file, readScene(inputs.front()));
    } else if (kind == InputKind::Datasets) {
        for (const std::string& input : inputs) file.datasets.push_back({input, {}});
    } else {
        VCP_TRY_ASSIGN(const auto path, datasetFor(inputs, build, progress));
        file.datasets.push_back({path.string(), {}});
    }
    const auto count = double(file.datasets.size());
    double opened = 0;
    std::vector<std::filesystem::path> filesRead = filesOf(file);
    filesRead.insert(filesRead.end(), inputs.begin(), inputs.end());
    const auto addSideFiles = [&](const std::vector<std::string>& meshes) {
        const auto named = sideFilesOf(meshes, build);
        filesRead.insert(filesRead.end(), named.begin(), named.end());
    };
    if (kind == InputKind::Meshes) addSideFiles(inputs);
    auto scene = openScene(std::move(file), inputs.front(), [&](const std::string& each) -> Result<OpenDataset> {
        if (progress && !progress({.stage = "opening", .fraction = opened++ / count}))
            return Error{ErrorCode::Cancelled, "cancelled"};
        VCP_TRY_ASSIGN(const auto path, datasetFor({each}, build, progress));
        addSideFiles({each});
        return openDataset(path.string(), source);
    });
    if (scene) scene->filesRead = std::move(filesRead);
    return scene;
}

DatasetOpening::DatasetOpening(std::vector<std::string> inputs, BuildSettings build, const SourceAccess& source,
                               std::function<bool(const BuildProgress&)> told)
    : inputs_(std::move(inputs)), build_(std::move(build)), source_(source), told_(std::move(told)) {
    source_.cancelled = [token = cancelled_, others = source.cancelled] { return *token || (others && others()); };
    thread_ = std::thread([this] {
        opened_ = open();
        done_ = true;
    });
}

DatasetOpening::~DatasetOpening() {
    // A dataset that was opened stays usable.
    if (!done_) cancel();
    thread_.join();
}

DatasetOpening::Progress DatasetOpening::progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
}

Result<OpenedScene> DatasetOpening::take() { return *std::exchange(opened_, std::nullopt); }

Result<OpenedScene> DatasetOpening::open() {
    // The display goes with the work: it is taken away before an error is shown.
    const auto told = std::exchange(told_, nullptr);
    return openScene(inputs_, build_, source_, [&](const BuildProgress& at) {
        const bool goesOn = !told || told(at);
        const std::lock_guard lock(mutex_);
        progress_ = {at.stage, at.fraction, at.triangles};
        return goesOn && !*cancelled_;
    });
}

}  // namespace vcp
