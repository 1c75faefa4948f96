// The levels of an image, each half as large as the one before it, made while its rows come from the top: whatever its
// height, a row of tiles of each level is in memory.
//
// Texels are averaged by areas (any size, not only powers of two): colours as light, weighted by alpha, so that
// transparent texels lend no colour; numbers, as of normals and roughness, as they are. So the mean of normals is
// shorter than they are where they differ, which says by how much.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "builder/texture/image.h"

namespace vcp {

/// What the texels of an image stand for.
enum class TexelKind : uint8_t { Colours, Numbers };

/// Averages rows of an image into rows of the level above it. `fine`: rows of an image of `fineSize` texels from row
/// `firstFine` on, all that are needed; `coarse`: room for whole rows of the coarser one, from row `firstCoarse` on.
/// Uses the calling arena's threads.
void halveRows(std::span<const Rgba8> fine, uint32_t firstFine, glm::uvec2 fineSize, std::span<Rgba8> coarse,
               uint32_t firstCoarse, TexelKind kind = TexelKind::Colours);

/// Returns the size of the level above an image of this size.
glm::uvec2 halvedSize(glm::uvec2 size);

/// Takes a row of tiles of a level (0: the image's own): kLargeTileEdge rows of texels from `firstRow` on, or what is
/// left at the image's end.
using TakeBand = std::function<Result<void>(size_t level, uint32_t firstRow, std::span<const Rgba8> texels)>;

/// Reads an image from the top, and hands on its levels down to a single texel; each level's rows come in their order.
/// Uses the calling arena's threads, and takes no other work of theirs meanwhile. Errors: as ImageRows::read(), and
/// those of `take`.
Result<void> readLevels(ImageRows& image, const TakeBand& take, TexelKind kind = TexelKind::Colours);

/// Returns the bytes that readLevels() takes for an image of this size, besides ImageRows::heldBytes().
uint64_t levelBandBytes(glm::uvec2 size);

}  // namespace vcp
