#include "viewer/command/build_arguments.h"

#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "builder/memory_plan.h"
#include "builder/mesh/open_mesh.h"
#include "viewer/command/interrupt.h"
#include "viewer/scene/option_values.h"

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
                return length && !length->isRelative
                           ? std::string()
                           : "must be a length in world units like 0.25, not \"" + text + "\"";
            },
            ""};
}

CLI::Validator memoryCheck() {
    return {[](std::string& text) {
                return parseMemory(text, 2 * defaultMemoryBytes())
                           ? std::string()
                           : "must be like 512M, 4G or 50%, not \"" + text + "\"";
            },
            ""};
}

}  // namespace

void addBuildSettings(CLI::App& app, BuildSettings& settings) {
    app.add_option("--cell", settings.cell, "Edge of the finest cells, world units [chosen from the mesh]")
        ->type_name("LENGTH")
        ->check(absoluteLengthCheck());
    app.add_option(
           "--error", settings.error,
           fmt::format("Tolerated distance to the mesh: world units, or a part of the bounding box's diagonal like "
                       "0.01% [{:g} cells]",
                       kDefaultErrorCells))
        ->type_name("LENGTH")
        ->check(lengthCheck());
    app.add_option("--colour,--color", settings.colour, "Colour to keep: auto (all there is), vertex, texture or none")
        ->type_name("WHICH")
        ->capture_default_str()
        ->check(CLI::IsMember({"auto", "vertex", "texture", "none"}));
    app.add_option("--threads", settings.threads, "Threads that build [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    app.add_option("--format", settings.format,
                   fmt::format("Format of meshes whose content does not tell it: {}", fmt::join(meshFormats(), ", ")))
        ->type_name("NAME")
        ->check(CLI::IsMember(std::vector<std::string>(meshFormats().begin(), meshFormats().end()), CLI::ignore_case));
    app.add_option("--memory", settings.memory,
                   "Cap on the memory that the build allocates: 512M, 4G, 50% [half of the machine's]")
        ->type_name("BYTES")
        ->check(memoryCheck());
    app.add_option("--temp", settings.temp, "Folder for temporary files [that of the output]")
        ->type_name("DIR")
        ->check(CLI::ExistingDirectory);
}

ProgressDetails detailsOf(const BuildProgress& at) { return {.triangles = at.triangles, .tempBytes = at.tempBytes}; }

std::function<bool(const BuildProgress&)> shownProgress(ProgressStyle style) {
    return [display = std::make_shared<ProgressDisplay>(style, stderr)](const BuildProgress& at) {
        display->update(at.stage, at.fraction, detailsOf(at));
        return !interrupted();
    };
}

Result<OpenedScene> openSceneShown(const std::vector<std::string>& inputs, const BuildSettings& build,
                                   const SourceSettings& source, ProgressStyle style, const std::string& method) {
    const InterruptScope catching;
    return openScene(inputs, build, source, shownProgress(style), method);
}

}  // namespace vcp
