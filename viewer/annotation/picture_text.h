// Text, lines and rectangles in pictures, drawn smoothly at any size. Text is in the window's typeface.
#pragma once

#include <string_view>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/picture.h"

namespace vcp {

/// How wide a line of text is at a height of its capitals, in pixels.
double textWidth(std::string_view text, double height);

/// Draws a line of text. `text`: UTF-8, Latin letters, digits and the signs of units; what else comes is an empty box.
/// `at`: where its first letter stands on the line, in pixels from the picture's upper left corner, y downwards;
/// `height`: of its capitals. Any thread.
void drawText(Picture& picture, std::string_view text, glm::dvec2 at, double height, glm::dvec3 srgb);

/// Draws a straight line, `width` pixels wide.
void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width, glm::dvec3 srgb);

/// Fills a rectangle of whole pixels; what lies outside of the picture is left out.
void fillRectangle(Picture& picture, glm::ivec2 low, glm::ivec2 high, glm::dvec3 srgb, float opacity = 1);

}  // namespace vcp
