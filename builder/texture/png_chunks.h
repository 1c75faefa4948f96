// Reads what the chunks of a PNG say, before libpng inflates or allocates by them.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include "builder/stream/random_bytes.h"
#include "octree/io/result.h"

namespace vcp {

struct PngChunks {
    uint32_t width = 0;
    uint32_t height = 0;
    uint8_t bitsOfTexel = 0;
    bool isInterlaced = false;
    uint64_t texelBytes = 0;  ///< compressed bytes of all IDAT chunks
};

/// Checks a file that begins like a PNG, and may be hostile. Errors, without file: InvalidInput (no header, another
/// number of bits, or compressed texels that cannot become as many as the header says: deflate makes 1032 bytes of
/// one), Io.
Result<PngChunks> checkPng(RandomBytes& file);

/// Whether a file is a PNG whose texels may be transparent, by its chunks before them. False where it cannot be read.
bool mayHaveAlpha(RandomBytes& file);

/// The bytes of a PNG from its beginning, with only those chunks that say something about texels, each once. Text is
/// left out: libpng would inflate up to 8 MB of it from 8 KB, a thousand times. Chunks that are not understood stay for
/// libpng to refuse. One thread at a time.
class PngBytes {
public:
    /// `file` stays as long as this is used.
    explicit PngBytes(RandomBytes& file) : file_(file) {}

    /// Reads the next bytes; returns how many there were, fewer than `count` at the end. Errors: Io.
    Result<size_t> read(char* to, size_t count);

private:
    /// Finds the next bytes to hand on; finds none at the end. Errors: Io.
    Result<void> findPart();

    RandomBytes& file_;
    uint64_t at_ = 0, end_ = 0;  ///< the part of the file that is handed on
    bool hasBegun_ = false;
    bool isRaw_ = false;         ///< no more chunks follow; what is there is handed on
    std::set<std::string> had_;  ///< chunks that may come once
    std::string buffer_;         ///< bytes of the file from bufferAt_ on
    uint64_t bufferAt_ = 0;
};

}  // namespace vcp
