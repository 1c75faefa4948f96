// Levels of images that an instance has of another's, and how an instance tells another which levels its bands read. As
// with pages (page_copies.h), nothing is checked again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "octree/image/image_set.h"
#include "render/pages/residency.h"
#include "viewer/web/wasm/page_copies.h"

namespace vcp {

/// A level of an image as it is named to another instance.
struct LevelRecord {
    uint32_t image = 0;
    uint32_t level = 0;    ///< 0 is the finest
    uint32_t bytes = 0;    ///< of its texels
    uint32_t address = 0;  ///< of these, in the instance whose image it is
};
static_assert(sizeof(LevelRecord) == 16);

/// Returns which of the levels that are shown rays read on some pages of a cut: image by image, coarse levels first.
std::vector<LevelRecord> levelsNeeded(const Residency& residency, const SelectionView& view,
                                      std::span<const CutRecord> pages);

class ImageCopies {
public:
    ImageCopies() = default;
    /// `tables`: images and materials; their tiles are not needed.
    explicit ImageCopies(ImageTables tables) : tables_(std::move(tables)) {}

    /// Returns where to put the texels of a level.
    std::byte* room(uint32_t image, uint32_t level);
    void drop(uint32_t image, uint32_t level) { levels_.erase({image, level}); }
    /// Returns a set of levels that are there, named as levelsNeeded() does. Errors: Usage, where one is not.
    [[nodiscard]] Result<std::shared_ptr<const ImageSet>> setOf(std::span<const LevelRecord> records) const;

private:
    ImageTables tables_;
    std::map<std::pair<uint32_t, uint32_t>, ImageSet::Level> levels_;  // by image and level
};

}  // namespace vcp
