// A height map on the device, tile by tile: a pool as pages have (page_pool.h), with threads that read what pictures
// asked for (streaming/page_loader.h), and the marks by which they ask: a word an entry, in which shaders write the
// number of their picture when they read the tile (shaders/remesh_levels.glsl).
#pragma once

#include <chrono>
#include <memory>

#include "render/height_residency.h"
#include "render/page_pool.h"
#include "streaming/page_loader.h"

namespace vcp {

class HeightPool {
public:
    /// The pool's bytes for all tiles.
    [[nodiscard]] static uint64_t bytesOfAll(const meso::HeightLevels& heights);

    /// Takes at most `mostBytes` of the device's memory, and loads the coarse levels, or all of a small map. Errors:
    /// Device; Limit (too few bytes for the coarse levels).
    static Result<std::unique_ptr<HeightPool>> create(Device& device, std::shared_ptr<const meso::HeightLevels> heights,
                                                      uint64_t mostBytes = UINT64_MAX);
    /// Loads all tiles, and waits for them. Precondition: there is room. Errors: Device.
    Result<void> loadAll();

    /// Takes in tiles that have come, and asks for those that are missing. Returns whether any came. Not while commands
    /// are recorded. Errors: Device.
    Result<bool> update();
    /// Waits until a tile has come, or for some time.
    void wait(std::chrono::milliseconds timeout) { loader_->waitForPage(timeout); }

    /// Records the number of a picture into the marks, before what reads tiles. Returns it.
    uint32_t begin(VkCommandBuffer commands);
    /// Takes in what a picture of a view wrote into the marks. `version`: that of the tiles that it was drawn from.
    /// Returns how many tiles it read that are not there.
    uint32_t look(ViewNumber view, std::span<const uint32_t> marks, uint32_t picture, uint64_t version);
    void forgetView(ViewNumber view);

    /// What is known of the tiles that a view's last picture read.
    struct State {
        bool isOfNow = false;  ///< false: other tiles were there
        HeightResidency::Missing missing;
    };
    [[nodiscard]] State state(ViewNumber view) const;
    [[nodiscard]] bool hasAll() const { return residency_.hasAll(); }
    /// Whether tiles are being read.
    [[nodiscard]] bool isReading() const { return loader_->pending() > 0; }

    [[nodiscard]] const meso::HeightLevels& heights() const { return *tiles_.heights(); }
    [[nodiscard]] VkBufferView view() const { return pool_->view(0); }
    [[nodiscard]] const Buffer& marks() const { return marks_; }
    [[nodiscard]] uint64_t bytes() const { return pool_->bytes() + marks_.bytes(); }
    /// Bytes of the tiles that are there.
    [[nodiscard]] uint64_t residentBytes() const { return uint64_t{16} * meso::HeightTiles::kQuads * there(); }
    [[nodiscard]] uint32_t there() const { return residency_.there(); }
    /// Counts changes of what is there.
    [[nodiscard]] uint64_t version() const { return version_; }

private:
    HeightPool(std::shared_ptr<const meso::HeightLevels> heights, uint32_t slots);
    [[nodiscard]] uint32_t quadOf(uint32_t slot) const {
        return tiles_.tableQuads() + slot * meso::HeightTiles::kQuads;
    }
    Result<void> write(uint32_t quad, std::span<const std::byte> bytes);
    Result<void> writeTile(uint32_t tile, uint32_t slot);
    Result<void> writeTable();

    meso::HeightTiles tiles_;
    HeightResidency residency_;
    std::unique_ptr<PagePool> pool_;
    Buffer marks_;
    std::unique_ptr<PageLoader> loader_;
    uint32_t pictures_ = 0;
    uint64_t version_ = 1;
    std::map<ViewNumber, uint64_t> seen_;  // version of the tiles that a view's last picture was drawn from
};

}  // namespace vcp
