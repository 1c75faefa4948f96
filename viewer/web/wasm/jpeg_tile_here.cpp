// Tiles that are JPEGs (octree/image/jpeg_tile.h) where there is no libjpeg: none is decoded, and triangles show the
// colours of their vertices.
#include "octree/image/jpeg_tile.h"

namespace vcp {

Result<void> unpackJpeg(std::span<const std::byte>, glm::uvec2, std::span<uint32_t>) {
    return Error{.code = ErrorCode::Unsupported, .message = "is a JPEG, which is not decoded here"};
}

}  // namespace vcp
