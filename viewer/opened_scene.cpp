#include "viewer/opened_scene.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "viewer/interrupt.h"

namespace vcp {

Box OpenedScene::bounds() const {
    Box all = surfaces.bounds;
    for (const Part& part : parts) all = all.joined(placedBox(part.open.bounds(), part.placement));
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
    if (progress && !progress({.stage = "making surfaces", .fraction = 1})) return Error{ErrorCode::Cancelled, "cancelled"};
    auto surfaces = makeMesoScene(scene.file.surfaces);
    if (!surfaces) return surfaces.error();
    scene.surfaces = *std::move(surfaces);
    const Box all = scene.bounds();
    if (!std::isfinite(glm::length(all.high - all.low))) return Error{ErrorCode::InvalidInput, "the datasets lie too far apart to be shown together", inputs.front()};
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
