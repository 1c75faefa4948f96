// What the chunks of a PNG say, before libpng inflates or allocates by them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "octree/result.h"

namespace vcp {

struct PngChunks {
    uint32_t width = 0;
    uint32_t height = 0;
    uint8_t bitsOfTexel = 0;
    uint64_t texelBytes = 0;  ///< compressed: all of IDAT
};

/// Of a file that begins like a PNG. It may be hostile. Errors, without file: InvalidInput (no header, another number
/// of bits, and where the compressed texels cannot become as many as the header says: deflate makes 1032 bytes of one).
Result<PngChunks> checkPng(std::string_view file);

/// The file with those chunks alone that say something about texels, and each of these once. What is left out is text,
/// of which libpng inflates up to 8 MB from 8 KB, a thousand times. What is not understood stays for libpng to refuse.
std::string withoutText(std::string_view file);

}  // namespace vcp
