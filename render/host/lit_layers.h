// Draws several datasets and surfaces with mesostructure that shade each other: the first hits of all, tile by tile,
// then their rays of light through each. Surfaces alone are drawn so too, over what is in the picture.
#pragma once

#include <span>

#include "render/host/host_picture.h"
#include "render/host/surface_caster.h"

namespace vcp {

struct LitScene {
    std::span<const HostLayer> layers;
    std::span<const HostSurface> surfaces;
    frame::FrameConstants frame;  ///< of the picture without a dataset: light, in the world's axes
    float occlusionReach = 0;     ///< world units
};

/// Draws all of a scene, the nearest at each pixel. Where it has layers, the picture is the background before.
/// Precondition: frame.shadingMode is no false colour where there are layers. Errors: Cancelled, between tiles.
Result<void> drawLitScene(const LitScene& scene, const HostCastOptions& options, HostPicture& picture);

}  // namespace vcp
