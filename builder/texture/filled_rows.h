// The rows of an image whose transparent parts are cut out of the mesh: they get the colours of what is about them.
//
// An outline is simplified, so that triangles reach some texels beyond what is there, where images have any colour,
// most often black or white. Colours are those of blocks of texels: of what a block has that is not transparent, or of
// the least larger block that has any.
#pragma once

#include <functional>
#include <memory>

#include "builder/texture/image.h"

namespace vcp {

/// Returns rows that are opaque. `open`: opens the image; it is read twice, the first time when its first row is asked
/// for. Holds up to 3 MiB more than `image`. Errors of read(): as those of the image, and of `open`.
std::unique_ptr<ImageRows> filledRows(std::unique_ptr<ImageRows> image,
                                      std::function<Result<std::unique_ptr<ImageRows>>()> open);

}  // namespace vcp
