// The arguments --paper-...: rules of Demir and Westermann's octree and of the march through it, for `vcp build`,
// `vcp render` and `view`, and `vcp bench rays`.
#pragma once

#include "builder/paper/paper_octree.h"
#include "viewer/command/commands.h"

namespace vcp {

/// Of the structure: what a file is built with.
void addPaperStructureOptions(CLI::App& app, PaperOptions& options);
/// The interpolation that merging is judged by: that of the march where both are of one command.
void addPaperSchemeOption(CLI::App& app, PaperScheme& scheme);
/// Of the march: what may change from picture to picture.
void addPaperMarchOptions(CLI::App& app, PaperMarch& march);

}  // namespace vcp
