#include "render/picture_parts.h"

#include <algorithm>

#include "render/frame_setup.h"
#include "render/shared/frame.h"

namespace vcp {

namespace {

// The shade pass averages occlusion over 2 pixels around; parts and what is around them are of whole tiles.
constexpr uint32_t kAround = frame::kTileSize;
constexpr uint32_t kLeastRowsWithAround = 8 * kAround;

constexpr uint32_t roundedUp(uint32_t rows) {
    return (rows + frame::kTileSize - 1) / frame::kTileSize * frame::kTileSize;
}

}  // namespace

PicturePart picturePart(const FrameRequest& request, uint32_t number, uint32_t raysPerPixel, uint64_t mostRays) {
    const bool averages = hasLight(request.shading) && request.shading.occlusionRays > 0;
    const uint32_t around = averages ? kAround : 0, least = averages ? kLeastRowsWithAround : frame::kTileSize;
    const uint64_t raysPerRow = uint64_t{request.width} * raysPerPixel;
    const uint32_t most = std::max(least, uint32_t(std::min<uint64_t>(mostRays / raysPerRow, request.height)));
    if (most >= request.height) return {.request = request, .rows = request.height};
    const uint32_t parts = (request.height + most - 1) / most;
    const uint32_t rows = roundedUp((request.height + parts - 1) / parts);
    PicturePart part{.request = request, .row = number * rows};
    part.rows = std::min(rows, request.height - part.row);
    part.skippedRows = std::min(part.row, around);
    part.isLast = part.row + part.rows == request.height;
    const PictureTile whole = wholePicture(request);
    part.request.height = rows + 2 * around;
    part.request.tile = {whole.x, whole.y + part.row - part.skippedRows, whole.fullWidth, whole.fullHeight};
    return part;
}

}  // namespace vcp
