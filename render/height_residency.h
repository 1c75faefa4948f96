// Which tiles of a height map (mesostructure/remesh/height_tiles.h) are on the device: the coarse levels always, and
// those that the last pictures of the views read, coarse ones first. What no view reads any more stays while there is
// room, and what was read last stays longest. Pure: no threads, no clock.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "mesostructure/remesh/height_tiles.h"
#include "streaming/request.h"
#include "streaming/residency_policy.h"

namespace vcp {

/// One thread. Tiles are numbered as in HeightTiles.
class HeightResidency {
public:
    static constexpr uint32_t kNone = meso::HeightTiles::kNone;

    /// `slots`: tiles that there is room for, at least leastSlots().
    HeightResidency(const meso::HeightTiles& tiles, uint32_t slots);

    /// The tiles that are always there have the last numbers: returns the first of them.
    [[nodiscard]] static uint32_t firstKept(const meso::HeightTiles& tiles);
    /// The room that a map needs at least.
    [[nodiscard]] static uint32_t leastSlots(const meso::HeightTiles& tiles);

    /// Says which tiles the last picture of a view read.
    void look(ViewNumber view, std::vector<uint32_t> tiles);
    void forgetView(ViewNumber view);
    /// Returns what is to be read, coarse levels first.
    [[nodiscard]] std::vector<Wish> wishes() const;
    /// Gives a slot to a tile that was read, where it is still wanted; whatever had it is no longer there.
    std::optional<uint32_t> take(uint32_t tile);

    /// The slot of each tile, or kNone.
    [[nodiscard]] const std::vector<uint32_t>& slots() const { return slots_; }
    [[nodiscard]] bool hasAll() const { return there_ == slots_.size(); }
    /// Tiles that are there.
    [[nodiscard]] uint32_t there() const { return there_; }
    /// Tiles that the last picture of a view read: those that are still to come, and those that there is no room for.
    struct Missing {
        uint32_t toCome = 0, withoutRoom = 0;
    };
    [[nodiscard]] Missing missing(ViewNumber view) const;

private:
    void plan();

    std::vector<uint32_t> slots_;  // of each tile
    std::vector<uint32_t> free_;   // slots
    std::vector<uint64_t> read_;   // of each tile: the number of the look that read it last
    std::vector<bool> planned_;    // of each tile: it is to be there
    std::map<ViewNumber, std::vector<uint32_t>> views_;
    uint32_t room_;  // for tiles that are not always there
    uint32_t firstKept_;
    uint32_t there_ = 0;
    uint64_t looks_ = 0;
};

}  // namespace vcp
