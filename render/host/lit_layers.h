// Several layers in one picture that shade each other: rays of light go through all of them.
#pragma once

#include <span>

#include "render/host/host_picture.h"

namespace vcp {

/// Draws layers over the background in `picture`: at each pixel the nearest surface, in the light that all of them
/// leave. Each ray of light is cast through one layer after the other, in that layer's own space, with its placement
/// and its cut; where pages are marked, every ray goes through every layer, so that what is marked in one does not
/// depend on the others. Precondition: frame.hasShadows or frame.occlusionRays, the same in all layers; nothing but the
/// background is in the picture. Errors: Cancelled, between tiles.
Result<void> drawLitLayers(std::span<const HostLayer> layers, const HostCastOptions& options, HostPicture& picture);

}  // namespace vcp
