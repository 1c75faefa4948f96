// Triangles of what loops surround.
#pragma once

#include <span>

#include "builder/mask/mask_cutter.h"
#include "builder/mask/mask_outline.h"

namespace vcp {

/// Cuts what is on the left of loops more often than on their right into triangles, with the tessellator of GLU (which
/// needs no GL): loops may touch and cross. Points are the loops' own, and where they cross. Any thread.
MaskParts triangulate(std::span<const MaskLoop> loops);

}  // namespace vcp
