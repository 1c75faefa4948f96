#include <cstdlib>

#include "builder/texture/jpeg_blocks.h"
#include "builder/texture/texture.h"
#include "octree/image/jpeg_tile.h"
#include "octree/image/tile_codec.h"

namespace {

/// Reads the input as a stored tile, whose size is what its first bytes say.
void decodeTiles(const uint8_t* data, size_t size) {
    if (size < 2) return;
    const glm::uvec2 edges(1 + data[0], 1 + data[1]);
    std::vector<uint32_t> texels(size_t{edges.x} * edges.y);
    const auto packed = std::as_bytes(std::span(data, size)).subspan(2);
    static_cast<void>(vcp::unpackTile(packed, edges, texels));
    static_cast<void>(vcp::unpackJpeg(packed, edges, texels));
}

/// What is cut out of a picture that can be decoded can be decoded, too.
void cutTiles(const std::string& file, glm::uvec2 size) {
    const auto blocks = vcp::JpegBlocks::read(file);
    if (!blocks) return;
    const vcp::ImageLevel level{size.x, size.y, 0, vcp::kLargeTileEdge};
    for (const glm::uvec2 place : vcp::tileOrder(level)) {
        const glm::uvec2 edges = level.sizeOf(place);
        std::vector<uint32_t> texels(size_t{edges.x} * edges.y);
        const auto tile = blocks->tile(level, place);
        if (!tile.empty() && !vcp::unpackJpeg(tile, edges, texels)) std::abort();
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    decodeTiles(data, size);
    const std::string file(reinterpret_cast<const char*>(data), size);
    auto image = vcp::decodeImage(file, {.edge = 1024, .bytes = 1 << 20, .fileBytes = 1 << 20});
    if (!image) return 0;
    cutTiles(file, {image->width, image->height});
    const vcp::Texture texture(*std::move(image), vcp::Wrap::Mirror, vcp::Wrap::Repeat);
    for (const float at : {-3e38f, -0.7f, 0.0f, 0.31f, 1.0f, 7e9f}) {
        const glm::vec2 corner[3] = {{at, 0}, {0, -at}, {1, at}};
        for (const auto& footprint : {vcp::TextureFootprint::round(at), vcp::TextureFootprint::ofCorner(corner)})
            static_cast<void>(texture.sample({at, -at}, footprint));
    }
    return 0;
}
