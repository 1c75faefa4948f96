// A scene with its datasets opened: what `vcp view`, `vcp render` and the widget show.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "viewer/scene/open_dataset.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

struct OpenedScene {
    struct Part {
        OpenDataset open;
        Similarity placement;
    };
    std::vector<Part> parts;                       ///< at least one, or a surface
    MesoScene surfaces;                            ///< made from the file's surfaces
    SceneFile file;                                ///< light, camera and sections of a scene file; empty without one
    std::vector<std::filesystem::path> filesRead;  ///< files that no output may replace; may include addresses

    /// Returns the box about all datasets where they are placed, and the surfaces.
    [[nodiscard]] Box bounds() const;
    [[nodiscard]] std::vector<PlacedDataset> placed() const;
};

/// Opens the datasets of a scene, each by `open`, which is given its file, and makes its surfaces. `name` stands for
/// the scene in errors. Errors: those of `open` and makeMesoScene; InvalidInput, where they lie too far apart.
Result<OpenedScene> openScene(SceneFile file, const std::string& name,
                              const std::function<Result<OpenDataset>(const std::string& file)>& open);

}  // namespace vcp
