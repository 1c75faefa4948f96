#include "viewer/opened_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/interrupt.h"

namespace vcp {

Box OpenedScene::bounds() const {
    Box all{glm::dvec3(std::numeric_limits<double>::infinity()), glm::dvec3(-std::numeric_limits<double>::infinity())};
    for (const Part& part : parts) {
        const Box box = placedBox(part.open.bounds(), part.placement);
        all = {glm::min(all.low, box.low), glm::max(all.high, box.high)};
    }
    return all;
}

std::vector<PlacedDataset> OpenedScene::placed() const {
    std::vector<PlacedDataset> datasets;
    for (const Part& part : parts) datasets.push_back({part.open.dataset, part.open.source, part.placement});
    return datasets;
}

uint32_t OpenedScene::loaderThreads() const {
    uint32_t most = 0;
    for (const Part& part : parts) most = std::max(most, part.open.loaderThreads());
    return most;
}

Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildSettings& build, const SourceSettings& source,
                              const std::function<bool(const BuildProgress&)>& progress) {
    const auto kind = kindOf(inputs);
    if (!kind) return kind.error();
    OpenedScene scene;
    if (*kind == InputKind::Scene) {
        auto file = readScene(inputs.front());
        if (!file) return file.error();
        scene.file = *std::move(file);
    } else if (*kind == InputKind::Datasets) {
        for (const std::string& input : inputs) scene.file.datasets.push_back({input, {}});
    } else {
        const auto path = datasetFor(inputs, build, progress);
        if (!path) return path.error();
        scene.file.datasets.push_back({path->string(), {}});
    }
    for (const SceneDataset& each : scene.file.datasets) {
        const double done = static_cast<double>(scene.parts.size()) / static_cast<double>(scene.file.datasets.size());
        if (progress && !progress({.stage = "opening", .fraction = done})) return Error{ErrorCode::Cancelled, "cancelled"};
        const auto path = datasetFor({each.file}, build, progress);
        if (!path) return path.error();
        auto open = openDataset(path->string(), source);
        if (!open) return open.error();
        scene.parts.push_back({*std::move(open), each.placement});
    }
    const Box all = scene.bounds();
    if (!scene.parts.empty() && !std::isfinite(glm::length(all.high - all.low))) return Error{ErrorCode::InvalidInput, "the datasets lie too far apart to be shown together", inputs.front()};
    return scene;
}

Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildSettings& build, const SourceSettings& source, ProgressStyle progress) {
    ProgressDisplay display(progress, stderr);
    const InterruptScope catching;
    return openScene(inputs, build, source, [&](const BuildProgress& at) {
        display.update(at.stage, at.fraction, detailsOf(at));
        return !interrupted();
    });
}

}  // namespace vcp
