// From a request to what shaders and selection need: computed in double, rounded once. Pure.
#pragma once

#include "render/frame.h"
#include "render/renderer.h"
#include "streaming/page_selection.h"

namespace vcp {

/// `dataset` may be null: a picture of the background. `stripes`: see stripedIndex in tiles.glsl.
frame::FrameConstants frameConstants(const FrameRequest& request, const Dataset* dataset, uint32_t stripes);

/// The picture's background, one RGBA8 word a row.
std::vector<uint32_t> backgroundRows(const Shading& shading, uint32_t height);

SelectionView selectionView(const FrameRequest& request);

/// Errors: Usage, where a size, an angle or an axis makes no picture.
Result<void> checkRequest(const FrameRequest& request);

}  // namespace vcp
