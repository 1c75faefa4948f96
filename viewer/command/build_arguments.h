// The arguments that say how a mesh is built, and what is shown while it is.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "builder/build.h"
#include "viewer/command/commands.h"
#include "viewer/command/terminal/progress_display.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

/// Adds what a person may say of a build, beside its inputs and output, to a group of help_text.h.
void addBuildSettings(CLI::App& app, BuildOptions& options, const char* group);

/// Add one of them, or the meshes and the .vcp file, for commands that have not all.
void addBuildInputs(CLI::App& app, std::vector<std::string>& inputs, const std::string& description);
void addBuildOutput(CLI::App& app, std::string& output);
/// Adds --origin, where the grid begins; after --cell.
void addOrigin(CLI::App& app, BuildOptions& options);
void addColourChoice(CLI::App& app, BuildOptions& options);
void addImages(CLI::App& app, BuildOptions& options);
void addVertexNormals(CLI::App& app, BuildOptions& options);
void addMasks(CLI::App& app, bool& masks);
void addAllowOutside(CLI::App& app, bool& allowOutside);
void addFormat(CLI::App& app, BuildOptions& options);
void addTempFolder(CLI::App& app, BuildOptions& options, const std::string& description);

/// Returns the fields of a build's figures (--json).
Json toJson(const BuildFigures& figures);

/// Returns what a display shows of a build.
ProgressDetails detailsOf(const BuildProgress& at);

/// Shows a build's progress on stderr for as long as the function lives; the function returns false once Ctrl-C came.
std::function<bool(const BuildProgress&)> shownProgress(ProgressStyle style);

/// Does openScene with its progress on stderr, cancelled by Ctrl-C.
Result<OpenedScene> openSceneShown(const std::vector<std::string>& inputs, BuildOptions build,
                                   const SourceAccess& source, ProgressStyle style, const SurfaceChoices& instead);

}  // namespace vcp
