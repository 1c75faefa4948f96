// How the base surfaces of a scene shade and light each other, as light from everywhere has it
// (mesostructure/base_transfer.h): the rays are the builder's own.
//
// What was traced is kept in a folder, named by a hash of all that it was traced from: the vertices of the bases, how
// high their mesostructure stands and what it gives back, and the rays. A file that is damaged is traced again.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "mesostructure/base_surface.h"
#include "mesostructure/base_transfer.h"
#include "mesostructure/shape.h"

namespace vcp {

/// A base surface among those that shade each other.
struct SceneBase {
    meso::BaseSurface surface;  ///< world
    double height = 0;          ///< of its mesostructure on the mean, over the base, world units
    double albedo = 0;          ///< of its mesostructure as a whole (meso::TileReflection)
    bool isAsked = false;       ///< its transfer is wanted
};
/// Returns a base and what its mesostructure does. `slab`: height of the slab, `offset`: of its bottom over the base;
/// world units. `albedo`: of the walls.
SceneBase sceneBase(meso::BaseSurface surface, const meso::Shape& shape, double slab, double offset, double albedo);

/// The extension of the files that are kept.
inline constexpr const char* kBaseLightExtension = ".light";

/// Traces the transfer of the bases that ask for it; null for others. `cache`: a folder that keeps it; empty: nothing
/// is kept, and what cannot be kept is traced again. `progress` may be empty; false cancels; nothing is called where
/// the folder has it. Errors: those of meso::traceBaseTransfer.
Result<std::vector<std::shared_ptr<const meso::BaseTransfer>>> traceBases(
    const std::vector<SceneBase>& bases, const std::filesystem::path& cache = {},
    const std::function<bool(double part)>& progress = {});

}  // namespace vcp
