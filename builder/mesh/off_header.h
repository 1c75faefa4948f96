// The start of an OFF file: keyword and counts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "builder/stream/byte_source.h"

namespace vcp {

struct OffHeader {
    bool binary = false;
    bool bigEndian = true;
    bool hasTexture = false;
    bool hasColour = false;
    bool hasNormal = false;
    uint64_t vertices = 0;
    uint64_t faces = 0;

    /// Numbers that stand before the colour of a vertex.
    [[nodiscard]] size_t numbersBeforeColour() const { return hasNormal ? 6 : 3; }
    /// 32-bit numbers of a vertex in a binary file.
    [[nodiscard]] size_t numbersOfVertex() const {
        return numbersBeforeColour() + (hasColour ? 4 : 0) + (hasTexture ? 2 : 0);
    }
};

/// Reads the header and leaves the source at the first vertex. Errors: InvalidInput (no keyword nor counts, counts that
/// the file cannot hold, none), Unsupported (other dimensions), Limit, Io.
Result<OffHeader> readOffHeader(ByteSource& source);

}  // namespace vcp
