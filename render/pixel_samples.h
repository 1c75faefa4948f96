// Where the samples of a pixel lie: one sequence for all pixels and all renderers. Pure.
//
// Sample 0 is the pixel's middle, so that a picture of one sample is one ray through each middle. The others follow a
// (0,2)-sequence: of the first 4, 16 or 64 samples, each box of 1/4, 1/16 or 1/64 of the pixel that is cut out by
// halving its sides holds one. So the mean comes nearer to the pixel's own with each sample, wherever it ends.
#pragma once

#include <cstdint>

#include <glm/vec2.hpp>

#include "octree/io/result.h"
#include "render/frame_request.h"

namespace vcp {

/// Returns where sample `sample` (below kMostSamples) goes through its pixel, from the middle: -0.5 to 0.5 pixels to
/// the right and downwards.
///
/// The points are those of Sobol' (1967) in two dimensions, scrambled as by Owen (1995) with the hash of Laine and
/// Karras in the constants of Burley (2020, "Practical Hash-based Owen Scrambling", listing 3), and then moved by an
/// exclusive or, which keeps the property above, so that the first one is the middle. The seed is the one of 1 to 119
/// with which 16 samples judge the part of a pixel beyond a straight edge best: to 0.032, root mean square over all
/// edges.
glm::dvec2 sampleOffset(uint32_t sample);

/// Returns how many samples a picture of the request has where so many are asked for: one where pixels show numbers and
/// no light, that is false colours, normals and counts of work; else as many, at least 1 and at most kMostSamples.
uint32_t samplesOf(const FrameRequest& request, uint32_t asked);

/// Checks that a picture of `samples` samples can have one more. Errors: Usage.
Result<void> checkRefinable(const FrameRequest& request, uint32_t samples);

}  // namespace vcp
