// The options that say how a mesh is built: those of `vcp build`, and of the commands that build a mesh into
// the cache first.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "builder/build.h"
#include "viewer/commands.h"

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

void addBuildSettings(CLI::App& app, BuildSettings& settings);

/// What a display is told of a build.
ProgressDetails detailsOf(const BuildProgress& at);

/// True for one .vcp or address, false for meshes. Errors: Usage (a .vcp among several inputs).
Result<bool> isOneDataset(const std::vector<std::string>& inputs);

/// The .vcp to show for `inputs`: themselves when they are one, else built into the default cache. `progress` as in
/// BuildOptions. Any thread. Errors: those of isOneDataset and MeshCache.
Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, const BuildSettings& settings,
                                         const std::function<bool(const BuildProgress&)>& progress);

/// The same with progress on stderr, cancelled by Ctrl-C.
Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, const BuildSettings& settings,
                                         ProgressStyle progress);

}  // namespace vcp
