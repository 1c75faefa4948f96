// Decodes pictures as mesh files bring them: PNG and JPEG, with limits. Hostile bytes are an error, never a crash.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "builder/stream/material.h"
#include "octree/io/result.h"

namespace vcp {

struct Image {
    uint32_t width = 0;
    uint32_t height = 0;
    std::vector<Rgba8> texels;  ///< row by row from the top
};

struct ImageLimits {
    uint32_t edge = 32768;                 ///< texels along an edge
    uint64_t bytes = uint64_t{512} << 20;  ///< bytes of the decoded texels
    uint64_t fileBytes = uint64_t{256} << 20;
};

/// Decodes PNG (any type, 16 bits cut to 8) or JPEG (grey, RGB; baseline and progressive). Sizes are checked before
/// texels are allocated, against the limits and against what as many bytes can hold. Errors: InvalidInput (damaged,
/// truncated), Unsupported (another format, CMYK), Limit (also a JPEG of more than 100 scans, and a progressive one of
/// more than 256 MiB); without file.
Result<Image> decodeImage(std::string_view file, const ImageLimits& limits = {});

/// Reads the file that `source` names, or returns its bytes. Errors: Io, Limit (too large); with the file's name.
Result<std::shared_ptr<const std::string>> imageFile(const ImageSource& source, const ImageLimits& limits = {});

/// Makes all texels opaque.
void ignoreAlpha(Image& image);

/// Whether an image may have texels that are not opaque, by the start of its file. False where it cannot be read.
bool mayBeTransparent(const ImageSource& source);

/// Reads and decodes it. Errors: as imageFile() and decodeImage(); with the file's name.
Result<Image> loadImage(const ImageSource& source, const ImageLimits& limits = {});
/// Decodes what imageFile() returned of `source`. Errors: as decodeImage(); with the file's name.
Result<Image> decodeImage(const ImageSource& source, const std::string& file, const ImageLimits& limits = {});

}  // namespace vcp
