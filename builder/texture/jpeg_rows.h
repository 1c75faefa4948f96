// JPEG pictures, some rows at a time (image.h).
#pragma once

#include "builder/texture/image.h"

namespace vcp {

/// Reads a file that begins like a JPEG. Errors: as ImageRows::open(), but for its limits of texels.
Result<std::unique_ptr<ImageRows>> openJpeg(std::unique_ptr<RandomBytes> file);

}  // namespace vcp
