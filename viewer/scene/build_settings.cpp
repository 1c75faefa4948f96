#include "viewer/scene/build_settings.h"

#include <algorithm>

#include "builder/memory_plan.h"
#include "streaming/http_reader.h"
#include "viewer/scene/mesh_cache.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

namespace {

ColourChoice colourNamed(const std::string& name) {
    return name == "vertex"    ? ColourChoice::Vertex
           : name == "texture" ? ColourChoice::Texture
           : name == "none"    ? ColourChoice::None
                               : ColourChoice::Auto;
}

}  // namespace

BuildOptions BuildSettings::optionsFor(const std::vector<std::string>& inputs) const {
    BuildOptions options;
    options.inputs.assign(inputs.begin(), inputs.end());
    if (const auto length = parseLength(cell)) options.cell = length->value;
    if (const auto length = parseLength(error)) {
        options.error = length->value;
        options.errorIsRelative = length->isRelative;
    }
    options.colour = colourNamed(colour);
    options.threads = threads;
    options.format = format;
    options.memoryBytes = parseMemory(memory, 2 * defaultMemoryBytes()).value_or(0);
    options.temp = temp;
    return options;
}

Result<InputKind> kindOf(const std::vector<std::string>& inputs) {
    const auto isDataset = [](const std::string& input) { return isHttpUrl(input) || looksLikeDataset(input); };
    const auto datasets = size_t(std::count_if(inputs.begin(), inputs.end(), isDataset));
    const auto scenes = size_t(std::count_if(inputs.begin(), inputs.end(), isSceneName));
    if (scenes > 0 && inputs.size() > 1) return Error{ErrorCode::Usage, "a scene file (.json) is opened alone"};
    if (scenes > 0) return InputKind::Scene;
    if (datasets > 0 && datasets < inputs.size())
        return Error{ErrorCode::Usage,
                     "several inputs must all be meshes or all .vcp files; a scene file (.json) takes both"};
    return datasets > 0 ? InputKind::Datasets : InputKind::Meshes;
}

Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, const BuildSettings& settings,
                                         const std::function<bool(const BuildProgress&)>& progress) {
    if (inputs.size() == 1 && (isHttpUrl(inputs.front()) || looksLikeDataset(inputs.front())))
        return std::filesystem::path(inputs.front());

    auto folder = defaultCacheFolder();
    if (!folder) return folder;
    BuildOptions options = settings.optionsFor(inputs);
    options.progress = progress;
    return MeshCache(*folder).dataset(std::move(options), buildOctree);
}

std::vector<std::filesystem::path> sideFilesOf(const std::vector<std::string>& inputs, const BuildSettings& settings) {
    const auto folder = defaultCacheFolder();
    if (!folder || (inputs.size() == 1 && isHttpUrl(inputs.front()))) return {};
    return MeshCache(*folder).sideFilesOf(settings.optionsFor(inputs));
}

}  // namespace vcp
