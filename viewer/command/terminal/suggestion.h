// "did you mean": the name that a mistyped one was meant to be.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vcp {

/// Returns how many letters must be put in, left out, replaced or swapped with their neighbour to make one text of the
/// other (Damerau 1964, no letter twice).
size_t editDistance(std::string_view a, std::string_view b);

/// Returns the name nearest to `typed`, or none where all are far: more than a third of its letters, and more than one,
/// are wrong. Of equals the first.
std::optional<std::string> nearestName(std::string_view typed, const std::vector<std::string>& names);

}  // namespace vcp
