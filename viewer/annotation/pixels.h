// Pixels of pictures under lines and text: which ones a line touches, how much, and colours over them.
#pragma once

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/picture.h"

namespace vcp {

/// A straight line between two points of a picture, in pixels from its upper left corner; pixel centres are at + 0.5.
struct Segment {
    glm::dvec2 from, to;
};

/// Cuts a segment to what is within `margin` pixels of a picture. Returns false where nothing is.
bool cutToPicture(Segment& segment, glm::dvec2 size, double margin);

double distanceTo(const Segment& segment, glm::dvec2 point);

/// Puts a colour (0 to 1, as in pictures) over a pixel, whose own is not multiplied with its alpha.
void blend(Picture& picture, glm::ivec2 pixel, glm::vec3 colour, float opacity);

/// Calls visit(pixel, part) for the pixels of a picture that a line with round ends covers, `part` of each, above 0 to
/// 1. Its work follows the line's length and width, wherever it lies.
template <class Visit>
void visitLine(Segment segment, double width, glm::ivec2 size, const Visit& visit) {
    const double half = width / 2, reach = half + 1;
    if (!cutToPicture(segment, size, reach)) return;
    const glm::dvec2 along = segment.to - segment.from;
    const int major = std::abs(along.x) >= std::abs(along.y) ? 0 : 1, minor = 1 - major;
    const double slope = along[major] != 0 ? along[minor] / along[major] : 0;
    const double low = std::min(segment.from[major], segment.to[major]);
    const double high = std::max(segment.from[major], segment.to[major]);
    const auto first = [](double from) { return int(std::max(0.0, std::floor(from))); };
    const auto last = [&](double to, int axis) { return int(std::min(double(size[axis]) - 1, std::floor(to))); };
    for (int i = first(low - reach); i <= last(high + reach, major); ++i) {
        const double middle = segment.from[minor] + slope * (std::clamp(i + 0.5, low, high) - segment.from[major]);
        const double side = reach * std::sqrt(1 + slope * slope);
        for (int j = first(middle - side); j <= last(middle + side, minor); ++j) {
            const glm::ivec2 pixel = major == 0 ? glm::ivec2(i, j) : glm::ivec2(j, i);
            const double part = half + 0.5 - distanceTo(segment, glm::dvec2(pixel) + 0.5);
            if (part > 0) visit(pixel, float(std::min(part, 1.0)));
        }
    }
}

}  // namespace vcp
