// What a person names to be shown: a scene, datasets, or meshes, which are built into the cache first.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "builder/build.h"
#include "octree/io/result.h"

namespace vcp {

/// One scene file (.json); .vcp files and addresses, and meshes beside them, each of which is a dataset of its own; or
/// meshes alone, which are joined to one dataset.
enum class InputKind { Scene, Datasets, Meshes };
/// Returns the kind of the inputs. Errors: Usage (a scene is not alone).
Result<InputKind> kindOf(const std::vector<std::string>& inputs);

/// Returns the .vcp to show for `inputs`: the input itself when it is one, else the mesh built into the default cache.
/// The inputs and the output in `build` are ignored. Any thread. Errors: those of MeshCache. Precondition: one .vcp or
/// address, or meshes.
Result<std::filesystem::path> datasetFor(const std::vector<std::string>& inputs, BuildOptions build);

/// Returns the files that meshes named in datasetFor: material files, images, buffers. None for other inputs.
std::vector<std::filesystem::path> sideFilesOf(const std::vector<std::string>& inputs, BuildOptions build);

/// Returns how an input is called: the last part of its path or address; of a manifest, its folder's.
std::string shownName(const std::string& input);

}  // namespace vcp
