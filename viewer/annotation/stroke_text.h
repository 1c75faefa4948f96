// Text in pictures: letters of strokes, drawn smoothly at any size.
#pragma once

#include <string_view>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/picture.h"

namespace vcp {

/// How wide text is at a height of its capitals, in pixels. All letters are of one width.
double textWidth(std::string_view text, double height);

/// Draws text. `at`: the lower left corner of its first letter, in pixels from the picture's upper left corner, y
/// downwards; `height`: of its capitals. Letters: a to z, digits, and + - . , % ( ) / : what else comes is left blank.
void drawText(Picture& picture, std::string_view text, glm::dvec2 at, double height, glm::dvec3 srgb);

/// Draws a straight line, `width` pixels wide.
void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width, glm::dvec3 srgb);

/// Fills a rectangle of whole pixels; what lies outside of the picture is left out.
void fillRectangle(Picture& picture, glm::ivec2 low, glm::ivec2 high, glm::dvec3 srgb, float opacity = 1);

}  // namespace vcp
