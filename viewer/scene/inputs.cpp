#include "viewer/scene/inputs.h"

#include <algorithm>

#include "streaming/http_reader.h"
#include "streaming/shard/shard_manifest.h"
#include "viewer/scene/mesh_cache.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

Result<InputKind> kindOf(const std::vector<std::string>& inputs) {
    const auto isDataset = [](const std::string& input) { return isHttpUrl(input) || looksLikeDataset(input); };
    const auto scenes = size_t(std::count_if(inputs.begin(), inputs.end(), isSceneName));
    if (scenes > 0 && inputs.size() > 1)
        return Error{.code = ErrorCode::Usage, .message = "a scene file (.json) is opened alone"};
    if (scenes > 0) return InputKind::Scene;
    return std::any_of(inputs.begin(), inputs.end(), isDataset) ? InputKind::Datasets : InputKind::Meshes;
}

Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, BuildOptions build) {
    if (inputs.size() == 1 && (isHttpUrl(inputs.front()) || looksLikeDataset(inputs.front())))
        return std::filesystem::path(inputs.front());

    auto folder = defaultCacheFolder();
    if (!folder) return folder;
    build.inputs.assign(inputs.begin(), inputs.end());
    return MeshCache(*folder).dataset(std::move(build), buildOctree);
}

std::vector<std::filesystem::path> sideFilesOf(const std::vector<std::string>& inputs, BuildOptions build) {
    const auto folder = defaultCacheFolder();
    if (!folder || (inputs.size() == 1 && isHttpUrl(inputs.front()))) return {};
    build.inputs.assign(inputs.begin(), inputs.end());
    return MeshCache(*folder).sideFilesOf(build);
}

std::string shownName(const std::string& input) {
    std::filesystem::path path(input);
    if (!path.has_filename() || path.filename() == kManifestName) path = path.parent_path();
    return path.has_filename() ? path.filename().string() : input;
}

}  // namespace vcp
