// The parts of a picture, over its whole width, in which its further samples are drawn: each takes a device a short
// time only, so that what a person does meanwhile is seen at once. Pure.
#pragma once

#include <cstdint>

#include "render/frame_request.h"

namespace vcp {

/// What a software device casts in about a tenth of a second.
constexpr uint64_t kPartRays = 1 << 18;
/// What a slow graphics card does.
constexpr uint64_t kCardPartRays = 1 << 22;

struct PicturePart {
    FrameRequest request;        ///< what is drawn: the part, with rows around it that occlusion is averaged over
    uint32_t row = 0, rows = 0;  ///< the part: rows of the picture
    uint32_t skippedRows = 0;    ///< rows of `request` above the part
    bool isLast = true;
};

/// Returns part `number` of a picture. All parts of a picture are drawn in one size: the last one may reach beyond it.
/// `raysPerPixel`: what a pixel costs, at least 1; the more, the smaller are the parts. `mostRays`: of a part, where
/// its least size allows. Precondition: the part exists.
PicturePart picturePart(const FrameRequest& request, uint32_t number, uint32_t raysPerPixel,
                        uint64_t mostRays = kPartRays);

}  // namespace vcp
