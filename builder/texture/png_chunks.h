// Reads what the chunks of a PNG say, before libpng inflates or allocates by them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "octree/io/result.h"

namespace vcp {

struct PngChunks {
    uint32_t width = 0;
    uint32_t height = 0;
    uint8_t bitsOfTexel = 0;
    uint64_t texelBytes = 0;  ///< compressed bytes of all IDAT chunks
};

/// Checks a file that begins like a PNG, and may be hostile. Errors, without file: InvalidInput (no header, another
/// number of bits, or compressed texels that cannot become as many as the header says: deflate makes 1032 bytes of
/// one).
Result<PngChunks> checkPng(std::string_view file);

/// Whether the start of a file is that of a PNG whose texels may be transparent, as far as it says.
bool mayHaveAlpha(std::string_view start);

/// Returns the file with only those chunks that say something about texels, each once. Text is left out: libpng would
/// inflate up to 8 MB of it from 8 KB, a thousand times. Chunks that are not understood stay for libpng to refuse.
std::string withoutText(std::string_view file);

}  // namespace vcp
