// The images of the materials while a build goes on: decoded once, cut into the tiles of their pyramids, coded, and
// kept on temporary files until the dataset is written.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "builder/build.h"
#include "builder/lattice_soup.h"
#include "builder/spill/page_spool.h"
#include "builder/stream/material.h"
#include "octree/image/image_tables.h"
#include "octree/io/result.h"

namespace vcp {

/// Codes the images of `materials`, each once however many have it, and appends their tiles to `spool`, then their
/// tables. `quality`: a tile whose bytes are fewer without loss, or that is not opaque, loses nothing. Images that
/// cannot be read are left out; whoever takes colours from them says so. `imageBytes`: memory for one image and its
/// levels. `progress` is given the part done; false cancels. Returns what the file has of each material. Uses the
/// calling arena's threads. Errors: Limit (an image needs more memory), Io, Cancelled.
Result<std::vector<PlacedMaterial>> storeImages(std::span<const Material> materials, const ImageQuality& quality,
                                                uint64_t imageBytes, PageSpool& spool,
                                                const std::function<bool(double)>& progress);

/// Returns the tables of the images in a spool, without the tiles' offsets; empty where there are none. The tiles are
/// its first entries. Errors: Io, InvalidInput (damaged).
Result<ImageTables> storedTables(const PageSpool& spool);

}  // namespace vcp
