#include "viewer/scene/opened_scene.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "streaming/web_address.h"

namespace vcp {

Box OpenedScene::bounds() const {
    Box all = surfaces.bounds;
    for (const Part& part : parts) all = all.joined(placedBox(part.open.bounds(), part.placement));
    return all;
}

std::vector<PlacedDataset> OpenedScene::placed() const {
    std::vector<PlacedDataset> datasets;
    for (const Part& part : parts)
        datasets.push_back({part.open.dataset, part.open.source, part.placement, part.open.loaderThreads()});
    return datasets;
}

Result<OpenedScene> openScene(SceneFile file, const std::string& name,
                              const std::function<Result<OpenDataset>(const std::string& file)>& open) {
    OpenedScene scene;
    scene.file = std::move(file);
    for (const SceneDataset& each : scene.file.datasets) {
        auto opened = open(each.file);
        if (!opened) return each.from.blamed(opened.error());
        scene.parts.push_back({*std::move(opened), each.placement});
    }
    VCP_TRY_ASSIGN(scene.surfaces, makeMesoScene(scene.file.surfaces));
    const Box all = scene.bounds();
    if (!std::isfinite(glm::length(all.high - all.low)))
        return Error{ErrorCode::InvalidInput, "the datasets lie too far apart to be shown together",
                     shownAddress(name)};
    return scene;
}

}  // namespace vcp
