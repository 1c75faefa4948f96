// The images of a .vcp file: what stands in its section of images (FileHeader::images), behind the pages.
//
//   24 bytes an image        ImageRow
//   16 bytes a material      MaterialRow; triangles name them by their number plus 1
//   40 bytes a material      ChannelRow, where some material has channels; else there are none
//   24 bytes a tile          TileRow: image by image, coarse levels first, Morton order (x lowest) within a level
//   ...                      the tiles, in the order of their table, without gaps
//
// The header has the hash of the tables. No column or row of an image is stored twice: filters read beyond a
// tile's edge in the tile beside it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "octree/image/image_levels.h"
#include "octree/image/images_place.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"

namespace vcp {

/// How an image is coded.
inline constexpr uint32_t kLosslessTiles = 1;  ///< tiles of kImageTileEdge (tile_codec.h)
inline constexpr uint32_t kMixedTiles = 2;     ///< tiles of kLargeTileEdge, each without loss or a JPEG (jpeg_tile.h)

struct ImageRow {
    uint32_t width = 0, height = 0;  ///< 1 to kMaxImageEdge
    uint32_t levels = 0;             ///< as levelsOf() makes them
    uint32_t coding = kLosslessTiles;
    uint64_t firstTile = 0;  ///< of the coarsest level
};
static_assert(sizeof(ImageRow) == 24);

/// Returns the levels of an image, the finest first. Precondition: the row was checked, or made.
inline std::vector<ImageLevel> levelsOf(const ImageRow& image) {
    return imageLevels(image.width, image.height, image.firstTile,
                       image.coding == kMixedTiles ? kLargeTileEdge : kImageTileEdge);
}

/// How coordinates beyond an image's edge are read.
enum class ImageWrap : uint8_t { Repeat, Clamp, Mirror };

struct MaterialRow {
    uint32_t image = 0;            ///< number of the image
    uint32_t factor = 0xffffffff;  ///< RGBA8, multiplies the image's stored colours
    ImageWrap wrapU = ImageWrap::Repeat, wrapV = ImageWrap::Repeat;
    uint8_t reserved[6] = {};
};
static_assert(sizeof(MaterialRow) == 16);

/// What factors of channels are at most.
inline constexpr float kMostNormalScale = 1000, kMostEmission = 1e6f;

/// What a material has beside its colour (glTF 2.0, 3.9): further images over the same coordinates, with the same wrap
/// modes, and factors. Images are named by their number plus 1; 0: there is none. All zero where it has nothing.
struct ChannelRow {
    uint32_t isGiven = 0;  ///< 1: the material has channels
    uint32_t normals = 0;  ///< image of normals in the image's own axes, from -1 to 1: right, up, away from the surface
    uint32_t surface = 0;  ///< image with the roughness as green and the metalness as blue
    uint32_t emission = 0;               ///< image of light, encoded as colours are
    float normalScale = 0;               ///< multiplies right and up
    float roughness = 0, metalness = 0;  ///< 0 to 1: multiply the image's
    float emissionFactor[3] = {};        ///< at least 0: multiplies the image's light
};
static_assert(sizeof(ChannelRow) == 40);

struct TileRow {
    uint64_t offset = 0;  ///< in the file
    uint64_t hash = 0;    ///< XXH3-64 of the stored bytes
    uint32_t storedBytes = 0;
    uint32_t reserved = 0;
};
static_assert(sizeof(TileRow) == 24);

struct ImageTables {
    std::vector<ImageRow> images;
    std::vector<MaterialRow> materials;
    std::vector<ChannelRow> channels;  ///< one for each material, or none
    std::vector<TileRow> tiles;

    [[nodiscard]] uint64_t bytes() const {
        return images.size() * sizeof(ImageRow) + materials.size() * sizeof(MaterialRow) +
               channels.size() * sizeof(ChannelRow) + tiles.size() * sizeof(TileRow);
    }
    /// Returns the tables as they are stored.
    [[nodiscard]] std::vector<std::byte> stored() const;
};

/// Calls visit(its number) for each image that a material shows: that of its colour, then those of its channels.
/// Precondition: the tables were checked.
template <class Visit>
void forEachImage(const ImageTables& tables, uint32_t material, const Visit& visit) {
    visit(tables.materials[material].image);
    if (tables.channels.empty()) return;
    const ChannelRow& row = tables.channels[material];
    for (const uint32_t number : {row.normals, row.surface, row.emission})
        if (number != 0) visit(number - 1);
}

/// Returns what is wrong with the place of a section in a file, whose pages end before `end`, in one line; empty where
/// nothing is. `begin`: the end of the directory.
std::string wrongPlace(const ImagesPlace& place, uint64_t begin, uint64_t end);

/// Reads and checks the tables of a section whose place was checked. They may be hostile: no more is allocated than
/// the section has bytes. Errors: InvalidInput (with file and byte), Io.
Result<ImageTables> readImageTables(const ByteReader& reader, const ImagesPlace& place);

/// Reads the stored bytes of all tiles of some levels of an image, which follow each other, in one read. They are valid
/// as long as `bytes`. Errors: Io.
struct StoredTiles {
    uint64_t first = 0;  ///< number of the first tile
    std::vector<std::byte> bytes;
};
Result<StoredTiles> readTiles(const ByteReader& reader, const ImageTables& tables, uint64_t first, uint64_t count);

/// Checks the hash of one of the tiles of `image` that were read, and decodes it. `file`: its name, for errors;
/// `number`: in the table; `size`: its texels along both axes; `texels`: room for them. Errors: InvalidInput. Any
/// thread.
Result<void> decodeTile(const std::string& file, const ImageTables& tables, const ImageRow& image,
                        const StoredTiles& tiles, uint64_t number, glm::uvec2 size, std::span<uint32_t> texels);

/// Reads and checks the section: its tables, and each tile. `progress` is called with the bytes up to where the file is
/// checked; false cancels. Errors: InvalidInput, Io, Cancelled.
Result<void> verifyImages(const ByteReader& reader, const ImagesPlace& place,
                          const std::function<bool(uint64_t)>& progress);

}  // namespace vcp
