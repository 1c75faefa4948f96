// A picture of any size in which each place can be recognised: cells with lines, their column and row in digits, and
// dots of single texels.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "octree/io/result.h"

namespace vcp::scan {

constexpr uint32_t kMinPictureEdge = 256, kMaxPictureEdge = 32768;

/// Returns red, green and blue of a texel.
std::array<uint8_t, 3> testTexel(uint32_t x, uint32_t y);

enum class PictureKind { Png, Jpeg };

/// Hands a picture of `edge` x `edge` texels to `write` in pieces, and returns its first error. A JPEG is of quality
/// 90, with halved colour. Memory is a few rows.
Result<void> writeTestPicture(uint32_t edge, PictureKind kind,
                              const std::function<Result<void>(std::span<const std::byte>)>& write);

}  // namespace vcp::scan
