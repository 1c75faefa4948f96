#include "mesostructure/known_error.h"

#include <glm/geometric.hpp>

namespace vcp::meso {

std::optional<double> knownError(const MarchArrays& arrays) {
    const MarchConstants& c = arrays.constants;
    if (c.walk == f32::kMesoPyramid) return 0;
    if (c.walk != f32::kMesoGrid) return {};
    return c.surface == f32::kMesoHeights ? 0 : glm::length(glm::dvec3(arrays.record.cell));
}

}  // namespace vcp::meso
