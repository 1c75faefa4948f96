#include <algorithm>
#include <cstdlib>

#include "builder/texture/jpeg_blocks.h"
#include "builder/texture/level_bands.h"
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

/// Reads the input as a picture, row of tiles by row of tiles. What is cut out of a picture that can be decoded can be
/// decoded, too. Returns its levels; none where it cannot be decoded.
std::vector<vcp::Image> levelsOf(const std::string& file, const vcp::ImageLimits& limits) {
    std::vector<vcp::Image> levels;
    const auto rows = vcp::ImageRows::open(vcp::randomBytesAt(file), limits);
    if (!rows) return levels;
    const glm::uvec2 size = (*rows)->size();
    if (uint64_t{size.x} * size.y * sizeof(vcp::Rgba8) > limits.bytes) return levels;
    const vcp::ImageLevel finest{size.x, size.y, 0, vcp::kLargeTileEdge};
    const auto take = [&](size_t level, uint32_t firstRow, std::span<const vcp::Rgba8> texels) -> vcp::Result<void> {
        levels.resize(std::max(levels.size(), level + 1));
        levels[level].texels.insert(levels[level].texels.end(), texels.begin(), texels.end());
        const vcp::JpegBlocks* const blocks = (*rows)->blocks();
        for (uint32_t x = 0; level == 0 && blocks && x < finest.tilesX(); ++x) {
            const glm::uvec2 place(x, firstRow / finest.tileEdge), edges = finest.sizeOf(place);
            std::vector<uint32_t> decoded(size_t{edges.x} * edges.y);
            const auto tile = blocks->tile(finest, place);
            if (!tile.empty() && !vcp::unpackJpeg(tile, edges, decoded)) std::abort();
        }
        return {};
    };
    if (!vcp::readLevels(**rows, take)) levels.clear();
    return levels;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    decodeTiles(data, size);
    const std::string file(reinterpret_cast<const char*>(data), size);
    const vcp::ImageLimits limits{.edge = 1024, .bytes = 1 << 20, .fileBytes = 1 << 20};
    const auto levels = levelsOf(file, limits);
    auto image = vcp::decodeImage(file, limits);
    // The picture is the same by rows and as a whole, and so is what can be read.
    if (image ? levels.empty() || levels[0].texels != image->texels : !levels.empty()) std::abort();
    if (!image) return 0;
    const vcp::Texture texture(*std::move(image), vcp::Wrap::Mirror, vcp::Wrap::Repeat);
    for (const float at : {-3e38f, -0.7f, 0.0f, 0.31f, 1.0f, 7e9f}) {
        const glm::vec2 corner[3] = {{at, 0}, {0, -at}, {1, at}};
        for (const auto& footprint : {vcp::TextureFootprint::round(at), vcp::TextureFootprint::ofCorner(corner)})
            static_cast<void>(texture.sample({at, -at}, footprint));
    }
    return 0;
}
