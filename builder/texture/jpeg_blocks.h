// The blocks of a JPEG picture, cut into tiles that are JPEGs of their own, without decoding them to texels: no tile
// differs from the picture, but for the colours of its outermost texels, where the picture has fewer of them than of
// light.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/image/image_levels.h"

namespace vcp {

class JpegBlocks {
public:
    /// Reads the blocks of a picture, which take up to 6 bytes a texel. `file` is the whole file, which was decoded
    /// before. Returns nothing where it is no JPEG, or its blocks cannot be cut.
    static std::unique_ptr<JpegBlocks> read(const std::string& file);
    virtual ~JpegBlocks() = default;

    /// Returns the quality of which libjpeg's steps are as large as the picture's, of light and in the mean; 1 to 100.
    [[nodiscard]] virtual int quality() const = 0;
    /// Returns a tile of the picture's finest level; empty where it would show other colours, or there is no memory.
    /// Precondition: the level has the picture's size. Any thread.
    [[nodiscard]] virtual std::vector<std::byte> tile(const ImageLevel& level, glm::uvec2 tile) const = 0;
};

}  // namespace vcp
