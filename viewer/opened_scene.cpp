#include "viewer/opened_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

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

Result<OpenedScene> openScene(SceneFile file, const std::string& name, const std::function<Result<OpenDataset>(const std::string& file)>& open) {
    OpenedScene scene{{}, std::move(file)};
    for (const SceneDataset& each : scene.file.datasets) {
        auto opened = open(each.file);
        if (!opened) return opened.error();
        scene.parts.push_back({*std::move(opened), each.placement});
    }
    const Box all = scene.bounds();
    if (!scene.parts.empty() && !std::isfinite(glm::length(all.high - all.low))) return Error{ErrorCode::InvalidInput, "the datasets lie too far apart to be shown together", name};
    return scene;
}

}  // namespace vcp
