// The images of the materials while a build goes on: read once, cut into the tiles of their pyramids, coded, and kept
// on temporary files until the dataset is written.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "builder/build.h"
#include "builder/lattice_soup.h"
#include "builder/spill/page_spool.h"
#include "builder/stream/material.h"
#include "octree/image/image_tables.h"
#include "octree/io/result.h"

namespace vcp {

/// Codes the images of `materials`, and of their channels, each once however many have it, as options.imageQuality
/// says, and appends their tiles to `spool`, then their tables. A tile that is not opaque, or has fewer bytes without
/// loss, loses nothing. Each image is read from the top; its tiles wait in a temporary file of `space` until it was
/// read to its end. Images that cannot be read are left out: of channels that becomes a warning; whoever takes colours
/// from the others says so. `imageBytes`: memory for one image's rows, and for the whole of what cannot be read by
/// rows; one that needs more becomes a warning, and is left out, too, unless images are asked for. `progress` is given
/// the part done, row by row of tiles; false cancels. Returns what the file has of each material. Uses the calling
/// arena's threads. Errors: Limit (an image needs more memory), Io, Cancelled.
Result<std::vector<PlacedMaterial>> storeImages(std::span<const Material> materials, const BuildOptions& options,
                                                uint64_t imageBytes, TempSpace& space, PageSpool& spool,
                                                std::vector<std::string>& warnings,
                                                const std::function<bool(double)>& progress);

/// Returns about how many bytes images of such materials take in a file, by the sizes of theirs; without reading them.
uint64_t expectedImageBytes(std::span<const Material> materials);
/// Returns about how much memory it takes to read images of such materials, one after the other, and to keep textures
/// of them, of which all together have at most `textureBytes`; of each, the header is read.
uint64_t expectedImageMemory(std::span<const Material> materials, uint64_t textureBytes);
/// Returns about how long it takes to code images of so many expected bytes.
double expectedImageSeconds(uint64_t bytes);

/// Returns the tables of the images in a spool, without the tiles' offsets; empty where there are none. The tiles are
/// its first entries. Errors: Io, InvalidInput (damaged).
Result<ImageTables> storedTables(const PageSpool& spool);

}  // namespace vcp
