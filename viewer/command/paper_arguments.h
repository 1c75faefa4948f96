// The arguments --paper-...: rules of Demir and Westermann's octree and of the march through it, for `vcp build`,
// `vcp render` and `view`, and `vcp bench rays`.
#pragma once

#include "builder/paper/paper_octree.h"
#include "viewer/command/commands.h"

namespace vcp {

/// Adds the options of the structure that a file is built with.
void addPaperStructureOptions(CLI::App& app, PaperOptions& options);
/// Adds the interpolation that merging is judged by: where a command has both, that of the march.
void addPaperSchemeOption(CLI::App& app, PaperScheme& scheme);
/// `otherwise`: what there is without the option.
void addPaperSubvolumesOption(CLI::App& app, int& cells, const std::string& otherwise);
/// Adds the options of the march, which may change from picture to picture.
void addPaperMarchOptions(CLI::App& app, PaperMarch& march);

}  // namespace vcp
