// PNG pictures, some rows at a time (image.h).
#pragma once

#include "builder/texture/image.h"

namespace vcp {

/// Reads a file that begins like a PNG. Errors: as ImageRows::open(), but for its limits.
Result<std::unique_ptr<ImageRows>> openPng(std::unique_ptr<RandomBytes> file);

}  // namespace vcp
