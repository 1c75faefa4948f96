// What a mask keeps of an edge of a triangle: a function of the edge alone, whichever triangle has it.
#pragma once

#include <algorithm>
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

/// Returns where the outline crosses a step, whose ends have these margins (AlphaMask), as a part of the way: not too
/// close to either end, so that points stay apart. Where both ends are on one side, though an edge of the triangle says
/// otherwise: the middle. `marginAt`: of a part of the way.
template <class MarginAt>
double crossingBetween(double first, double last, MarginAt marginAt) {
    if ((first >= 0) == (last >= 0)) return 0.5;
    double begin = 0, end = 1;
    for (int halvings = 0; halvings < 3; ++halvings) {
        const double middle = (begin + end) / 2, margin = marginAt(middle);
        const bool isLikeFirst = (margin >= 0) == (first >= 0);
        (isLikeFirst ? begin : end) = middle;
        (isLikeFirst ? first : last) = margin;
    }
    constexpr double kLeast = 1.0 / 64;
    return std::clamp(begin + (end - begin) * first / (first - last), kLeast, 1 - kLeast);
}

/// Returns the binary logarithm of how many steps a length of so many texels is cut into, so that none is longer.
int log2StepsOf(double texels);

}  // namespace vcp
