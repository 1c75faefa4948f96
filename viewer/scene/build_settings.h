// How a mesh is built: the settings of `vcp build`, and of the commands that build a mesh into the cache first.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "builder/build.h"
#include "octree/result.h"

namespace vcp {

struct BuildSettings {
    std::string cell;
    std::string error;
    std::string colour = "auto";
    unsigned threads = 0;
    std::string format;
    std::string memory;
    std::string temp;

    /// What the builder is to do with `inputs`, without output and progress. The values have been checked
    /// while parsing.
    [[nodiscard]] BuildOptions optionsFor(const std::vector<std::string>& inputs) const;
};

/// One scene file (.json), .vcp files and addresses, or meshes.
enum class InputKind { Scene, Datasets, Meshes };
/// Errors: Usage (kinds are mixed; several scenes).
Result<InputKind> kindOf(const std::vector<std::string>& inputs);

/// The .vcp to show for `inputs`: themselves when they are one, else built into the default cache. `progress` as in
/// BuildOptions. Any thread. Errors: those of MeshCache. Precondition: one .vcp or address, or meshes.
Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, const BuildSettings& settings,
                                         const std::function<bool(const BuildProgress&)>& progress);

/// Files that meshes name, as datasetFor met them: material files, images, buffers. None for what is no mesh.
std::vector<std::filesystem::path> sideFilesOf(const std::vector<std::string>& inputs, const BuildSettings& settings);

}  // namespace vcp
