// How different two colours look: the distance in OKLab (Ottosson 2020, "A perceptual color space for image
// processing"), times 100. Differences below 2 are hard to see side by side.
#pragma once

#include <glm/vec3.hpp>

#include "builder/stream/material.h"

namespace vcp {

/// Converts linear light in the primaries of sRGB, 0 to 1, to OKLab: lightness 0 to 1, and two axes of hue.
glm::dvec3 okLabOf(glm::dvec3 light);
/// Converts a stored colour; its alpha does not count.
glm::dvec3 okLabOfStored(Rgba8 colour);

/// Returns 100 times the distance of two lights in OKLab: black and white differ by 100.
double colourDifference(glm::dvec3 light, glm::dvec3 other);

/// The colours of a surface as they look, in OKLab.
struct Tint {
    glm::vec3 mean{0};
    float spread = 0;  ///< mean of the squared distances from the mean; negative: nothing is known of the colours
    bool operator==(const Tint&) const = default;
};
inline constexpr Tint kUnknownTint{glm::vec3(0), -1};

/// A mean of tints by their weights: that of all surface that they are of.
class TintMean {
public:
    /// `tint`: known; `weight`: not negative.
    void add(const Tint& tint, double weight);
    void add(glm::dvec3 okLab, double weight);
    /// Returns kUnknownTint where nothing has a weight.
    [[nodiscard]] Tint mean() const;

private:
    double weight_ = 0, squares_ = 0;
    glm::dvec3 sum_{0};
};

/// Returns the root of the mean square of the differences between a stored colour and those of a surface, as
/// colourDifference has them; 0 where these are not known. Alpha does not count.
double rmsDifference(const Tint& tint, Rgba8 colour);

}  // namespace vcp
