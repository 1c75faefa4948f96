// The folder where `vcp view MESH` and `vcp render MESH` keep the octrees they build.
//
// A dataset is named by a hash of what it was built from: each mesh's absolute path, size and times of last
// change, the same of the files that it names (materials, images, buffers), and the options that shape the output.
// Which files those are is known once it was built: a list beside the datasets says it (KEY.files, KEY the hash of
// meshes and options alone). A mesh that changes gets a new name; the old one ages and goes. The folder is held under a
// size by removing what was used least recently. Several processes may use it at once: a dataset appears by a rename,
// whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "builder/build.h"
#include "octree/io/result.h"

namespace vcp {

/// Returns $XDG_CACHE_HOME/vcp, else $HOME/.cache/vcp. Errors: Io when neither is set.
Result<std::filesystem::path> defaultCacheFolder();

/// Returns true when the file starts like a .vcp or a manifest of shards, or has the name of one, or is the folder of a
/// manifest. Returns false also when it cannot be read.
bool looksLikeDataset(const std::filesystem::path& path);
/// Whether a folder holds the manifest of a dataset in shards.
bool isFolderOfShards(const std::filesystem::path& folder);

class MeshCache {
public:
    static constexpr uint64_t kDefaultLimitBytes = uint64_t(16) << 30;

    explicit MeshCache(std::filesystem::path folder, uint64_t limitBytes = kDefaultLimitBytes)
        : folder_(std::move(folder)), limitBytes_(limitBytes) {}

    using Builder = std::function<Result<BuildReport>(const BuildOptions&)>;

    /// Returns the dataset for `options.inputs`: from the folder when it is there and whole, else built by `build`
    /// (normally buildOctree); `options.output` is ignored. Errors: Io (folder cannot be made, input missing);
    /// InvalidInput (a file was changed while it was read); what the builder reports.
    Result<std::filesystem::path> dataset(BuildOptions options, const Builder& build);

    /// Returns the files that the meshes named when they were built: material files, images, buffers. None before.
    [[nodiscard]] std::vector<std::filesystem::path> sideFilesOf(const BuildOptions& options) const;

    /// Returns where the dataset for `options` is or would be. Errors: Io (input missing).
    [[nodiscard]] Result<std::filesystem::path> pathFor(const BuildOptions& options) const;

    /// Removes the datasets, and the light of bases (base_light.h), used least recently until the folder is within its
    /// limit, and leftovers of builds that died; never `keep`.
    void trim(const std::filesystem::path& keep) const;

private:
    std::filesystem::path folder_;
    uint64_t limitBytes_;
};

}  // namespace vcp
