// Surfaces with mesostructure as renderers are given them (PictureRenderer::setSurfaces).
#pragma once

#include <memory>

#include <glm/vec3.hpp>

#include "mesostructure/appearance.h"
#include "mesostructure/base_transfer.h"
#include "mesostructure/march_arrays.h"
#include "mesostructure/remesh/certified_cells.h"
#include "mesostructure/shell.h"
#include "mesostructure/transfer_volume.h"
#include "render/meso_texture.h"

namespace vcp {

using RemeshShareOut = decltype(meso::RemeshOptions::shareOut);

/// A displaced surface and how fine it is remeshed.
struct RemeshedSurface {
    std::shared_ptr<const meso::RemeshSurface> surface;
    meso::RemeshOptions options;
    /// The surface's cells, where an error is certified; null: all have one size. They remember what views measured,
    /// so one renderer at a time draws with them.
    std::shared_ptr<meso::CertifiedCells> cells = {};
};

/// One asset on one base surface: marched, with arrays and a shell, or remeshed. What is remeshed and has both as well
/// is what rays of light march: without them it casts no shadows.
struct MesoSurface {
    std::shared_ptr<const meso::MarchArrays> arrays;  ///< surfaces may share them
    meso::Shell shell;
    RemeshedSurface
        remeshed;            ///< its surface is null where this one is marched; neither far nor transfer count with it
    glm::vec3 colour{0.8f};  ///< encoded, as the screen has it
    bool withBase = true;    ///< the base is drawn where rays come through to it
    double lift = 0;         ///< world units by which shadow rays start above a hit
    /// A texture over the tile, at the hit's place in it, may be shared; its colours are linear and replace `colour`.
    std::shared_ptr<const MesoTexture> colours;
    /// A texture of unit vectors that bend the mesostructure's shading normals: x and y are along the tile, z points
    /// out of the mesostructure.
    std::shared_ptr<const MesoTexture> normals;
    /// What its walls do to light from everywhere; null: such light falls on it as if it were open.
    std::shared_ptr<const meso::TransferVolume> transfer;
    /// What the base, and others, do to such light before; of the shell's positions. Null: nothing. Counts with
    /// `transfer` only.
    std::shared_ptr<const meso::BaseTransfer> baseTransfer;
    std::shared_ptr<const meso::Appearance> far;  ///< what it looks like from far; null: it is marched from everywhere
};

/// Returns a good lift: some texels or a part of a cell. `tileEdge` in world units.
double shadowLift(const meso::MarchArrays& arrays, double tileEdge);

}  // namespace vcp
