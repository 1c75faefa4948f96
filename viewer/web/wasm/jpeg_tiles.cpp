#include "viewer/web/wasm/jpeg_tiles.h"

#include <algorithm>
#include <utility>

#include "octree/image/jpeg_tile.h"
#include "octree/io/content_hash.h"

namespace vcp {

namespace {

constexpr uint64_t kMostBytes = 8u << 20;  // of texels that are awaited, or were not read yet

uint64_t texelsOf(glm::uvec2 size) { return uint64_t{size.x} * size.y; }

/// Whether the bytes begin as a JPEG of one of our tiles does: of that size, not progressive, and without segments that
/// turn it or give it colours of another kind.
bool isPlain(std::span<const std::byte> jpeg, glm::uvec2 size) {
    const auto wide = [&](size_t at) { return uint32_t(jpeg[at]) << 8 | uint32_t(jpeg[at + 1]); };
    bool hasFrame = false;
    for (size_t at = 2; at + 4 <= jpeg.size(); at += 2 + wide(at + 2)) {
        const uint32_t marker = wide(at);
        const bool isTables = marker == 0xffc4 || marker == 0xffdb || marker == 0xffdd;
        const bool isFrame = marker == 0xffc0 || marker == 0xffc1, isNote = marker == 0xffe0 || marker == 0xfffe;
        if (marker == 0xffda) return hasFrame;
        if (!isFrame && !isTables && !isNote) return false;
        if (!isFrame) continue;
        constexpr size_t kFrameBytes = 10;
        if (hasFrame || at + kFrameBytes > jpeg.size()) return false;
        const auto channels = uint32_t(jpeg[at + 9]);
        if (wide(at + 5) != size.y || wide(at + 7) != size.x || (channels != 1 && channels != 3)) return false;
        hasFrame = true;
    }
    return false;
}

}  // namespace

JpegTiles& jpegTiles() {
    static JpegTiles tiles;
    return tiles;
}

/// Returns whether there is room for so many bytes, after tiles went that nobody waits for.
bool JpegTiles::makeRoom(uint64_t bytes) {
    for (const auto& [hash, tile] : tiles_) bytes += tile.bytes;
    for (auto tile = tiles_.begin(); bytes > kMostBytes && tile != tiles_.end();) {
        const bool isStale = tile->second.state == State::Decoded && tile->second.walk < walk_;
        if (isStale) bytes -= tile->second.bytes;
        tile = isStale ? tiles_.erase(tile) : std::next(tile);
    }
    return bytes <= kMostBytes;
}

JpegTiles::State JpegTiles::state(uint64_t hash, std::span<const std::byte> jpeg, glm::uvec2 size) {
    const auto known = tiles_.find(hash);
    if (known != tiles_.end()) {
        known->second.walk = walk_;
        return known->second.state;
    }
    if (!isPlain(jpeg, size)) {
        tiles_[hash] = {.state = State::Failed};
        return State::Failed;
    }
    const uint64_t bytes = texelsOf(size) * sizeof(uint32_t);
    if (!makeRoom(bytes)) return State::Awaited;
    tiles_[hash] = {.id = ++lastId_, .bytes = bytes, .walk = walk_};
    wanted_.push_back({lastId_, size, {jpeg.begin(), jpeg.end()}});
    return State::Awaited;
}

std::vector<JpegTiles::Wanted> JpegTiles::takeWanted() { return std::exchange(wanted_, {}); }

void JpegTiles::put(uint32_t id, std::span<const uint32_t> texels) {
    const auto isIt = [id](const auto& each) { return each.second.state == State::Awaited && each.second.id == id; };
    const auto found = std::find_if(tiles_.begin(), tiles_.end(), isIt);
    if (found == tiles_.end()) return;
    Tile& tile = found->second;
    const bool isRight = texels.size_bytes() == tile.bytes;
    tile.state = isRight ? State::Decoded : State::Failed;
    if (isRight)
        tile.texels.assign(texels.begin(), texels.end());
    else
        tile.bytes = 0;
}

std::span<const uint32_t> JpegTiles::find(uint64_t hash, glm::uvec2 size) const {
    const auto tile = tiles_.find(hash);
    if (tile == tiles_.end() || tile->second.texels.size() != texelsOf(size)) return {};
    return tile->second.texels;
}

Result<void> unpackJpeg(std::span<const std::byte> packed, glm::uvec2 size, std::span<uint32_t> texels) {
    const auto decoded = jpegTiles().find(hashBytes(packed), size);
    if (decoded.empty())
        return Error{.code = ErrorCode::InvalidInput, .message = "is a JPEG that the browser does not decode"};
    std::copy(decoded.begin(), decoded.end(), texels.begin());
    return {};
}

}  // namespace vcp
