// What `vcp view` and `vcp render` show: the datasets that a command line or a scene file names, opened.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "viewer/build_settings.h"
#include "viewer/scene_file.h"
#include "viewer/source_settings.h"

namespace vcp {

struct OpenedScene {
    struct Part {
        OpenDataset open;
        Similarity placement;
    };
    std::vector<Part> parts;  ///< at least one, or a surface
    MesoScene surfaces;       ///< made of those of the file
    SceneFile file;           ///< light, camera and sections of a scene file; empty without one

    /// Of all datasets where they are placed, and of the surfaces.
    [[nodiscard]] Box bounds() const;
    [[nodiscard]] std::vector<PlacedDataset> placed() const;
    [[nodiscard]] uint32_t loaderThreads() const;
};

/// Opens one scene file, or .vcp files and addresses, each where it lies by itself, or meshes, which are built into one
/// dataset in the cache first; meshes of a scene are built one by one, its surfaces after them. `progress` as in BuildOptions. Any thread. Errors:
/// Usage (.vcp files among meshes); those of readScene, MeshCache, openDataset and makeMesoScene.
Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildSettings& build, const SourceSettings& source,
                              const std::function<bool(const BuildProgress&)>& progress);

/// The same with progress on stderr, cancelled by Ctrl-C.
Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildSettings& build, const SourceSettings& source, ProgressStyle progress);

}  // namespace vcp
