// What of a mask's outline a picture of a whole mesh shows.
#pragma once

#include <cmath>
#include <span>

#include <glm/vec3.hpp>

namespace vcp {

/// Takes all vertices of a file, in any order.
class MaskDetail {
public:
    void add(std::span<const glm::dvec3> positions);
    /// Returns a thousandth of the diagonal of the box around them: less than a pixel, where the whole is in a picture
    /// of a thousand. 0 where that is no number.
    [[nodiscard]] double length() const;

private:
    glm::dvec3 low_{HUGE_VAL}, high_{-HUGE_VAL};
};

/// Returns the area of a triangle.
double triangleArea(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

}  // namespace vcp
