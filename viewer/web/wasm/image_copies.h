// Tiles of images that an instance has of another's, and how an instance tells another which tiles its bands read. As
// with pages (page_copies.h), nothing is checked again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "octree/image/image_set.h"
#include "render/pages/residency.h"
#include "viewer/web/wasm/page_copies.h"

namespace vcp {

/// A tile of an image as it is named to another instance.
struct TileRecord {
    uint32_t number = 0;   ///< image by image, the finest level first, row by row
    uint32_t bytes = 0;    ///< of its texels
    uint32_t address = 0;  ///< of these, in the instance whose image it is
    uint32_t reserved = 0;
};
static_assert(sizeof(TileRecord) == 16);

/// Returns which of the tiles that are shown rays read on some pages of a cut.
std::vector<TileRecord> tilesNeeded(const Residency& residency, const SelectionView& view,
                                    std::span<const CutRecord> pages);

class ImageCopies {
public:
    ImageCopies() = default;
    /// `tables`: images and materials; their tiles are not needed.
    explicit ImageCopies(const ImageTables& tables);

    /// Returns where to put the texels of a tile.
    std::byte* room(uint32_t number);
    void drop(uint32_t number) { tiles_.erase(number); }
    /// Returns a set of tiles that are there, named as tilesNeeded() does. Errors: Usage, where one is not.
    [[nodiscard]] Result<std::shared_ptr<const ImageSet>> setOf(std::span<const TileRecord> records) const;

private:
    /// A level, and the number of its first tile.
    struct Level {
        uint32_t first, image, level;
    };
    [[nodiscard]] const Level& levelOf(uint32_t number) const;

    ImageSet without_;  // any tile
    std::vector<Level> levels_;
    std::unordered_map<uint32_t, ImageSet::Tile> tiles_;  // by number
};

}  // namespace vcp
