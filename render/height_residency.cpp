#include "render/height_residency.h"

#include <algorithm>
#include <utility>

namespace vcp {

namespace {

// Coarse levels of so many tiles are always there: a first picture has them.
constexpr uint32_t kMostKept = 64;
// Room for the tiles about a place in a few levels, beside those: a near view has its finest heights.
constexpr uint32_t kLeastRoom = 16;

}  // namespace

uint32_t HeightResidency::firstKept(const meso::HeightTiles& tiles) {
    size_t level = tiles.levels() - 1;
    while (level > 0 && tiles.count() - tiles.first(level - 1) <= kMostKept) --level;
    return tiles.first(level);
}

uint32_t HeightResidency::leastSlots(const meso::HeightTiles& tiles) {
    return std::min(tiles.count() - firstKept(tiles) + kLeastRoom, tiles.count());
}

HeightResidency::HeightResidency(const meso::HeightTiles& tiles, uint32_t slots)
    : slots_(tiles.count(), kNone),
      read_(tiles.count(), 0),
      planned_(tiles.count(), false),
      room_(slots - (tiles.count() - firstKept(tiles))),
      firstKept_(firstKept(tiles)) {
    for (uint32_t slot = slots; slot-- > 0;) free_.push_back(slot);
    for (uint32_t tile = firstKept_; tile < tiles.count(); ++tile) slots_[tile] = free_.back(), free_.pop_back();
    there_ = tiles.count() - firstKept_;
}

void HeightResidency::look(ViewNumber view, std::vector<uint32_t> tiles) {
    ++looks_;
    std::erase_if(tiles, [&](uint32_t tile) { return tile >= firstKept_; });
    for (const uint32_t tile : tiles) read_[tile] = looks_;
    views_[view] = std::move(tiles);
    plan();
}

void HeightResidency::forgetView(ViewNumber view) {
    if (views_.erase(view) > 0) plan();
}

/// Plans what the views read; where there is no room for all, the coarser ones, which have the greater numbers.
void HeightResidency::plan() {
    planned_.assign(planned_.size(), false);
    for (const auto& [view, tiles] : views_)
        for (const uint32_t tile : tiles) planned_[tile] = true;
    uint32_t left = room_;
    for (uint32_t tile = firstKept_; tile-- > 0;)
        if (planned_[tile] && left > 0)
            --left;
        else
            planned_[tile] = false;
}

std::vector<Wish> HeightResidency::wishes() const {
    std::vector<Wish> wishes;
    for (uint32_t tile = firstKept_; tile-- > 0;)
        if (planned_[tile] && slots_[tile] == kNone) wishes.push_back({Request(tile), double(tile)});
    return wishes;
}

std::optional<uint32_t> HeightResidency::take(uint32_t tile) {
    if (!planned_[tile] || slots_[tile] != kNone) return std::nullopt;
    if (free_.empty()) {
        // As many are planned as there is room for, and this one is not there yet: another is, and has to go.
        std::optional<uint32_t> oldest;
        for (uint32_t other = 0; other < firstKept_; ++other)
            if (slots_[other] != kNone && !planned_[other] && (!oldest || read_[other] < read_[*oldest]))
                oldest = other;
        if (!oldest) return std::nullopt;
        free_.push_back(std::exchange(slots_[*oldest], kNone));
        --there_;
    }
    slots_[tile] = free_.back(), free_.pop_back();
    ++there_;
    return slots_[tile];
}

HeightResidency::Missing HeightResidency::missing(ViewNumber view) const {
    Missing missing;
    const auto found = views_.find(view);
    if (found == views_.end()) return missing;
    for (const uint32_t tile : found->second)
        if (slots_[tile] == kNone) ++(planned_[tile] ? missing.toCome : missing.withoutRoom);
    return missing;
}

}  // namespace vcp
