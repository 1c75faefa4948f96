// What a mask keeps of an edge of a triangle: a function of the edge alone, whichever triangle has it.
#pragma once

#include <optional>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/mask/alpha_mask.h"

namespace vcp {

struct EdgeCuts {
    bool startsKept = true;
    /// Where kept turns into cut or back, as the second end's weight (Weights), ascending, between 0 and Weights::kOne.
    std::vector<int32_t> cuts;
    /// An edge in 2^log2Steps equal steps has at most one of the cuts in each; at most kMostLog2Steps.
    int log2Steps = 0;

    static constexpr int kMostLog2Steps = 14;

    /// Whether there is something at a place, which belongs to what lies before it.
    [[nodiscard]] bool isKept(int32_t at) const;
    /// Whether all between two places is kept, or all cut.
    [[nodiscard]] bool isAll(bool kept, int32_t from, int32_t to) const;
};

/// Finds the cuts between two points. `from`, `to`: texels (AlphaMask), finite. Nothing where they are too many even at
/// the mask's coarsest level, or too far apart for it.
std::optional<EdgeCuts> cutsBetween(const AlphaMask& mask, glm::dvec2 from, glm::dvec2 to);

/// Returns where a value that goes from `first` to `second` passes 0, as a part of the way; not too close to either
/// end, so that points stay apart. Where both are on one side, whatever else says that they are not counts: the middle.
double crossingBetween(double first, double second);

/// Steps that a length of so many texels is cut into, so that none is longer than two thirds of one.
int log2StepsOf(double texels);

}  // namespace vcp
