#include "builder/mask/mask_detail.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

void MaskDetail::add(std::span<const glm::dvec3> positions) {
    for (const glm::dvec3& p : positions) {
        low_ = glm::min(low_, p);
        high_ = glm::max(high_, p);
    }
}

double triangleArea(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return glm::length(glm::cross(b - a, c - a)) / 2;
}

double MaskDetail::length() const {
    constexpr double kPart = 1e-3;
    const double length = kPart * glm::length(high_ - low_);
    return std::isfinite(length) ? length : 0;
}

}  // namespace vcp
