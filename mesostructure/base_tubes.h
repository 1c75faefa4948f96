// Base surfaces made of tubes: circles that are stretched along a curve, "vase", "bird", "dinosaur" and "tree". They
// are ours, with about as many triangles as the models of those names have in Wang et al. 2004, Fig. 7.
#pragma once

#include <optional>
#include <string_view>

#include "mesostructure/base_surface.h"

namespace vcp::meso {

/// Returns nothing where no surface of tubes has that name. `tiles`: tile edges half round the thickest tube; round
/// thinner ones there are fewer, whole numbers of them where `tiles` is whole.
std::optional<BaseSurface> makeTubes(std::string_view name, double tiles);

}  // namespace vcp::meso
