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

/// Foretells a value from those left, above, and left above: the middle one of the first two and of what lies on the
/// plane through all three, so that the left or the upper one counts at an edge. Without a branch.
int foretold(int left, int above, int corner) {
    return std::max(std::min(left, above), std::min(std::max(left, above), left + above - corner));
}

/// Calls visit(at, foretold) for each value of a plane, row by row; what comes before it is known by then.
template <class Visit>
void forEachForetold(const uint8_t* plane, glm::uvec2 size, Visit&& visit) {
    for (uint32_t x = 0; x < size.x; ++x) visit(x, x == 0 ? 0 : int{plane[x - 1]});
    for (uint32_t y = 1; y < size.y; ++y) {
        const size_t row = size_t{y} * size.x;
        const uint8_t* const above = plane + (row - size.x);
        visit(row, int{above[0]});
        for (uint32_t x = 1; x < size.x; ++x) visit(row + x, foretold(plane[row + x - 1], above[x], above[x - 1]));
    }
}

}  // namespace

std::vector<std::byte> packTile(std::span<const uint32_t> texels, glm::uvec2 size) {
    const size_t count = size_t{size.x} * size.y;
    std::vector<uint8_t> plane(count), planes(kChannels * count);
    for (size_t channel = 0; channel < kChannels; ++channel) {
        for (size_t i = 0; i < count; ++i) plane[i] = channelOf(lessGreen(texels[i]), channel);
        uint8_t* const rest = planes.data() + channel * count;
        forEachForetold(plane.data(), size, [&](size_t at, int value) { rest[at] = uint8_t(plane[at] - value); });
    }
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
    for (size_t channel = 0; channel < kChannels; ++channel) {
        uint8_t* const plane = planes.data() + channel * count;
        forEachForetold(plane, size, [&](size_t at, int value) { plane[at] = uint8_t(plane[at] + value); });
    }
    const uint8_t* const plane = planes.data();
    for (size_t i = 0; i < count; ++i)
        texels[i] = plusGreen(plane[i] | uint32_t{plane[count + i]} << 8 | uint32_t{plane[2 * count + i]} << 16 |
                              uint32_t{plane[3 * count + i]} << 24);
    return {};
}

}  // namespace vcp
