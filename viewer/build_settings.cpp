#include "viewer/build_settings.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "builder/memory_plan.h"
#include "builder/open_mesh.h"
#include "streaming/http_reader.h"
#include "viewer/interrupt.h"
#include "viewer/mesh_cache.h"
#include "viewer/scene_file.h"
#include "viewer/option_values.h"

namespace vcp {

namespace {

CLI::Validator lengthCheck() {
    return {[](std::string& text) {
                return parseLength(text) ? std::string() : "must be a length like 0.25 or 0.01%, not \"" + text + "\"";
            },
            ""};
}

CLI::Validator absoluteLengthCheck() {
    return {[](std::string& text) {
                const auto length = parseLength(text);
                return length && !length->isRelative ? std::string()
                                                     : "must be a length in world units like 0.25, not \"" + text + "\"";
            },
            ""};
}

CLI::Validator memoryCheck() {
    return {[](std::string& text) {
                return parseMemory(text, 2 * defaultMemoryBytes()) ? std::string() : "must be like 512M, 4G or 50%, not \"" + text + "\"";
            },
            ""};
}

ColourChoice colourNamed(const std::string& name) {
    return name == "vertex" ? ColourChoice::Vertex : name == "texture" ? ColourChoice::Texture : name == "none" ? ColourChoice::None : ColourChoice::Auto;
}

}  // namespace

void addBuildSettings(CLI::App& app, BuildSettings& settings) {
    app.add_option("--cell", settings.cell, "Edge of the finest cells, world units [chosen from the mesh]")
        ->type_name("LENGTH")
        ->check(absoluteLengthCheck());
    app.add_option("--error", settings.error,
                   fmt::format("Tolerated distance to the mesh: world units, or a part of the bounding box's diagonal like "
                               "0.01% [{:g} cells]", kDefaultErrorCells))
        ->type_name("LENGTH")
        ->check(lengthCheck());
    app.add_option("--colour,--color", settings.colour, "Colour to keep: auto (all there is), vertex, texture or none")
        ->type_name("WHICH")
        ->capture_default_str()
        ->check(CLI::IsMember({"auto", "vertex", "texture", "none"}));
    app.add_option("--threads", settings.threads, "Threads that build [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    app.add_option("--format", settings.format, fmt::format("Format of meshes whose content does not tell it: {}", fmt::join(meshFormats(), ", ")))
        ->type_name("NAME")
        ->check(CLI::IsMember(std::vector<std::string>(meshFormats().begin(), meshFormats().end()), CLI::ignore_case));
    app.add_option("--memory", settings.memory, "Cap on the memory that the build allocates: 512M, 4G, 50% [half of the machine's]")
        ->type_name("BYTES")
        ->check(memoryCheck());
    app.add_option("--temp", settings.temp, "Folder for temporary files [that of the output]")->type_name("DIR")->check(CLI::ExistingDirectory);
}

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

ProgressDetails detailsOf(const BuildProgress& at) { return {.triangles = at.triangles, .tempBytes = at.tempBytes}; }

Result<InputKind> kindOf(const std::vector<std::string>& inputs) {
    const auto isDataset = [](const std::string& input) { return isHttpUrl(input) || looksLikeDataset(input); };
    const auto datasets = static_cast<size_t>(std::count_if(inputs.begin(), inputs.end(), isDataset));
    const auto scenes = static_cast<size_t>(std::count_if(inputs.begin(), inputs.end(), isSceneName));
    if (scenes > 0 && inputs.size() > 1) return Error{ErrorCode::Usage, "a scene file (.json) is opened alone"};
    if (scenes > 0) return InputKind::Scene;
    if (datasets > 0 && datasets < inputs.size())
        return Error{ErrorCode::Usage, "several inputs must all be meshes or all .vcp files; a scene file (.json) takes both"};
    return datasets > 0 ? InputKind::Datasets : InputKind::Meshes;
}

Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, const BuildSettings& settings,
                                         const std::function<bool(const BuildProgress&)>& progress) {
    if (inputs.size() == 1 && (isHttpUrl(inputs.front()) || looksLikeDataset(inputs.front()))) return std::filesystem::path(inputs.front());

    auto folder = defaultCacheFolder();
    if (!folder) return folder;
    BuildOptions options = settings.optionsFor(inputs);
    options.progress = progress;
    return MeshCache(*folder).dataset(std::move(options), buildOctree);
}

}  // namespace vcp
