#include "octree/image/tile_codec.h"

#include <algorithm>

#include <zstd.h>

namespace vcp {

namespace {

// Higher levels win less than a hundredth: what is left after foretelling hardly repeats.
constexpr int kTileLevel = 5;

constexpr size_t kChannels = 4;

uint8_t channelOf(uint32_t texel, size_t channel) { return uint8_t(texel >> 8 * channel); }

/// Returns what the channels of a texel are coded as: green, red less green, blue less green, alpha.
uint32_t lessGreen(uint32_t texel) {
    const uint32_t green = texel >> 8 & 255u;
    return (texel & 0xff00ff00u) | ((texel - green) & 255u) | (((texel >> 16) - green) & 255u) << 16;
}
uint32_t plusGreen(uint32_t coded) {
    const uint32_t green = coded >> 8 & 255u;
    return (coded & 0xff00ff00u) | ((coded + green) & 255u) | (((coded >> 16) + green) & 255u) << 16;
}

/// Foretells a value from those left, above, and left above: the left or upper one at an edge, else on their plane.
uint8_t foretold(uint8_t left, uint8_t above, uint8_t corner) {
    const uint8_t least = std::min(left, above), most = std::max(left, above);
    if (corner >= most) return least;
    if (corner <= least) return most;
    return uint8_t(left + above - corner);
}

/// Foretells a channel of texel (x, y) of a tile, of which the texels before it are known.
uint8_t foretold(std::span<const uint32_t> texels, uint32_t width, uint32_t x, uint32_t y, size_t channel) {
    const size_t at = size_t{y} * width + x;
    if (y == 0) return x == 0 ? uint8_t{0} : channelOf(texels[at - 1], channel);
    if (x == 0) return channelOf(texels[at - width], channel);
    return foretold(channelOf(texels[at - 1], channel), channelOf(texels[at - width], channel),
                    channelOf(texels[at - width - 1], channel));
}

}  // namespace

std::vector<std::byte> packTile(std::span<const uint32_t> texels, glm::uvec2 size) {
    const size_t count = size_t{size.x} * size.y;
    std::vector<uint32_t> coded(count);
    std::transform(texels.begin(), texels.begin() + std::ptrdiff_t(count), coded.begin(), lessGreen);
    std::vector<uint8_t> planes;
    planes.reserve(kChannels * count);
    for (size_t channel = 0; channel < kChannels; ++channel)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                planes.push_back(uint8_t(channelOf(coded[size_t{y} * size.x + x], channel) -
                                         foretold(coded, size.x, x, y, channel)));
    std::vector<std::byte> packed(ZSTD_compressBound(planes.size()));
    const size_t bytes = ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), kTileLevel);
    packed.resize(ZSTD_isError(bytes) ? 0 : bytes);  // cannot fail with room for compressBound
    return packed;
}

Result<void> unpackTile(std::span<const std::byte> packed, glm::uvec2 size, std::span<uint32_t> texels) {
    const size_t count = size_t{size.x} * size.y;
    std::vector<uint8_t> planes(kChannels * count);
    if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != planes.size() ||
        ZSTD_decompress(planes.data(), planes.size(), packed.data(), packed.size()) != planes.size())
        return Error{.code = ErrorCode::InvalidInput, .message = "does not decode to its texels"};
    std::fill_n(texels.begin(), count, 0u);
    for (size_t channel = 0; channel < kChannels; ++channel) {
        const uint8_t* more = planes.data() + channel * count;
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                texels[size_t{y} * size.x + x] |= uint32_t{uint8_t(foretold(texels, size.x, x, y, channel) + *more++)}
                                                  << 8 * channel;
    }
    std::transform(texels.begin(), texels.begin() + std::ptrdiff_t(count), texels.begin(), plusGreen);
    return {};
}

}  // namespace vcp
