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

    /// Returns what the builder should do with `inputs`, without output and progress. Precondition: the values have
    /// been checked while parsing.
    [[nodiscard]] BuildOptions optionsFor(const std::vector<std::string>& inputs) const;
};

/// One scene file (.json), .vcp files and addresses, or meshes.
enum class InputKind { Scene, Datasets, Meshes };
/// Returns the kind of the inputs. Errors: Usage (kinds are mixed; several scenes).
Result<InputKind> kindOf(const std::vector<std::string>& inputs);

/// Returns the .vcp to show for `inputs`: the input itself when it is one, else the mesh built into the default cache.
/// `progress` as in BuildOptions. Any thread. Errors: those of MeshCache. Precondition: one .vcp or address, or meshes.
Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, const BuildSettings& settings,
                                         const std::function<bool(const BuildProgress&)>& progress);

/// Returns the files that meshes named in datasetFor: material files, images, buffers. None for other inputs.
std::vector<std::filesystem::path> sideFilesOf(const std::vector<std::string>& inputs, const BuildSettings& settings);

}  // namespace vcp
