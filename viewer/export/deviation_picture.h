// A picture of a surface coloured by its distance from another, with a scale and a histogram.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "builder/measure/mesh_deviation.h"
#include "octree/io/result.h"
#include "render/camera.h"
#include "render/picture.h"

namespace vcp {

struct DeviationPictureOptions {
    Camera camera;
    uint32_t width = 1600, height = 1000;
    /// The distance at both ends of the colours, world units.
    double range = 1;
    double within = std::numeric_limits<double>::infinity();  ///< surface farther away is grey
    std::string unit;                                         ///< behind the numbers; empty: none
    unsigned threads = 0;
    std::function<bool(double)> progress = {};  ///< as in DeviationOptions
};

/// How many pixels the scale takes on the right of a picture so wide; the surface is drawn on what is left.
uint32_t scaleWidth(uint32_t width);

/// Draws a surface, four rays a pixel, each with the distance where it hits, and the scale beside it. Errors:
/// Cancelled.
Result<Picture> drawDeviation(const MeshBvh& surface, const DeviationTarget& target, const Deviation& deviation,
                              const DeviationPictureOptions& options);

}  // namespace vcp
