#include "render/height_pool.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace vcp {

namespace {

using meso::HeightTiles;

constexpr uint64_t kTileBytes = uint64_t{16} * HeightTiles::kQuads;
// Maps of so many tiles are loaded whole where there is room: up to 1,024 x 1,024 texels.
constexpr uint32_t kMostLoadedWhole = 100;
// What a read may hold, and what an update takes in.
constexpr uint64_t kHeldBytes = uint64_t{64} << 20, kMostTaken = uint64_t{16} << 20;

/// The tiles of a map as pages.
class TileSource final : public PageSource {
public:
    explicit TileSource(std::shared_ptr<const meso::HeightLevels> heights) : tiles_(std::move(heights)) {}

    Result<PageBytes> read(Request request, bool) const override {
        PageBytes page;
        const auto quads = tiles_.texels(uint32_t(request.number));
        page.geometry.resize(quads.size());
        std::memcpy(page.geometry.data(), quads.data(), kTileBytes);
        return page;
    }
    [[nodiscard]] uint64_t bytesToRead(Request, bool) const override { return kTileBytes; }

private:
    HeightTiles tiles_;
};

uint64_t bytesFor(const HeightTiles& tiles, uint32_t slots) {
    const uint64_t bytes = 16 * (uint64_t{tiles.tableQuads()} + uint64_t{slots} * HeightTiles::kQuads);
    return unitsOf(bytes) * kPoolUnitBytes;
}

}  // namespace

uint64_t HeightPool::bytesOfAll(const meso::HeightLevels& heights) {
    const HeightTiles tiles(std::shared_ptr<const meso::HeightLevels>(std::shared_ptr<void>(), &heights));
    return bytesFor(tiles, tiles.count());
}

HeightPool::HeightPool(std::shared_ptr<const meso::HeightLevels> heights, uint32_t slots)
    : tiles_(std::move(heights)), residency_(tiles_, slots) {}

Result<std::unique_ptr<HeightPool>> HeightPool::create(Device& device,
                                                       std::shared_ptr<const meso::HeightLevels> heights,
                                                       uint64_t mostBytes) {
    const HeightTiles tiles(heights);
    const uint64_t most = std::min(mostBytes, poolChunkBytes(device.limits(), PageAccess::TexelBuffer));
    const uint32_t least = HeightResidency::leastSlots(tiles);
    if (bytesFor(tiles, least) > most)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("the heights of a remeshed surface take {} bytes at least, and {} are left "
                                            "for them: allow more",
                                            bytesFor(tiles, least), most)};
    // Whole units; `most` has room for the table and some tiles, as was seen.
    const uint64_t quads = most / kPoolUnitBytes * kPoolUnitBytes / 16 - tiles.tableQuads();
    const auto slots = uint32_t(std::min<uint64_t>(quads / HeightTiles::kQuads, tiles.count()));
    std::unique_ptr<HeightPool> made(new HeightPool(heights, slots));
    VCP_TRY_ASSIGN(made->pool_, PagePool::create(device, bytesFor(tiles, slots), PageAccess::TexelBuffer));
    VCP_TRY_ASSIGN(made->marks_,
                   device.createBuffer(uint64_t{4} * tiles.entry(tiles.count()),
                                       VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                           VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                       MemoryUse::Local));
    VCP_TRY(device.submitAndWait(
        [&](VkCommandBuffer commands) { vkCmdFillBuffer(commands, made->marks_.handle(), 0, VK_WHOLE_SIZE, 0); }));
    for (uint32_t tile = HeightResidency::firstKept(tiles); tile < tiles.count(); ++tile)
        VCP_TRY(made->writeTile(tile, made->residency_.slots()[tile]));
    VCP_TRY(made->writeTable());
    if (slots == tiles.count() && slots <= kMostLoadedWhole) VCP_TRY(made->loadAll());
    made->loader_ = std::make_unique<PageLoader>(std::make_shared<TileSource>(std::move(heights)),
                                                 LoaderOptions{.withColour = false, .heldBytes = kHeldBytes});
    return made;
}

Result<void> HeightPool::write(uint32_t quad, std::span<const std::byte> bytes) {
    return pool_->write({0, pool_->bytes() / kPoolUnitBytes}, uint64_t{16} * quad, bytes);
}

Result<void> HeightPool::writeTile(uint32_t tile, uint32_t slot) {
    const std::vector<glm::uvec4> texels = tiles_.texels(tile);
    return write(quadOf(slot), std::as_bytes(std::span(texels)));
}

Result<void> HeightPool::writeTable() {
    std::vector<uint32_t> quads = residency_.slots();
    for (uint32_t& each : quads)
        if (each != HeightResidency::kNone) each = quadOf(each);
    const std::vector<glm::uvec4> table = tiles_.table(quads);
    VCP_TRY(write(0, std::as_bytes(std::span(table))));
    return pool_->flush();
}

Result<void> HeightPool::loadAll() {
    std::vector<uint32_t> all(tiles_.count());
    for (uint32_t tile = 0; tile < all.size(); ++tile) all[tile] = tile;
    residency_.look(0, all);
    for (const uint32_t tile : all)
        if (const auto slot = residency_.take(tile)) VCP_TRY(writeTile(tile, *slot));
    residency_.forgetView(0);
    ++version_;
    return writeTable();
}

Result<bool> HeightPool::update() {
    bool isChanged = false;
    for (const Loaded& loaded : loader_->collect(kMostTaken)) {
        if (!loaded.bytes) return loaded.bytes.error();
        if (const auto slot = residency_.take(uint32_t(loaded.request.number))) {
            VCP_TRY(write(quadOf(*slot), loaded.bytes->geometryBytes()));
            isChanged = true;
        }
    }
    if (isChanged) {
        ++version_;
        VCP_TRY(writeTable());
        tiles_.heights()->letGo();
    }
    loader_->request(residency_.wishes(), kMostTaken);
    return isChanged;
}

uint32_t HeightPool::begin(VkCommandBuffer commands) {
    // 0 is what marks begin with.
    if (++pictures_ == 0) ++pictures_;
    vkCmdUpdateBuffer(commands, marks_.handle(), 0, sizeof pictures_, &pictures_);
    return pictures_;
}

uint32_t HeightPool::look(ViewNumber view, std::span<const uint32_t> marks, uint32_t picture, uint64_t version) {
    std::vector<uint32_t> read;
    for (uint32_t tile = 0; tile < tiles_.count(); ++tile)
        if (marks[tiles_.entry(tile)] == picture) read.push_back(tile);
    residency_.look(view, std::move(read));
    seen_[view] = version;
    const auto [toCome, withoutRoom] = residency_.missing(view);
    return toCome + withoutRoom;
}

void HeightPool::forgetView(ViewNumber view) {
    residency_.forgetView(view);
    seen_.erase(view);
}

HeightPool::State HeightPool::state(ViewNumber view) const {
    const auto seen = seen_.find(view);
    return {seen != seen_.end() && seen->second == version_, residency_.missing(view)};
}

}  // namespace vcp
