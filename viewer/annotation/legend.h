// What the colours of a false-colour picture mean: a bar of colours with numbers. A description; annotations.h draws
// it. Its colours come from the function that colours the pixels (render/false_colours.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "render/frame_request.h"

namespace vcp {

struct LegendTick {
    double part = 0;  ///< where on the bar, 0 to 1
    std::string text;
};

struct Legend {
    std::string name, unit;         ///< "Error", "pixels"; the unit may be empty
    double end = 1;                 ///< number at the bar's right end; where there are bands, the last band's
    uint32_t bands = 0;             ///< so many numbers, from 0 on, with one colour each; 0: colours go smoothly
    std::vector<LegendTick> ticks;  ///< from left to right
    /// Colours of the bar, sRGB, evenly from its left to its right end, at least two; empty: those of falseColour.
    std::vector<glm::vec3> colours = {};

    [[nodiscard]] std::string title() const { return unit.empty() ? name : name + ", " + unit; }
    /// Returns the colour of a number, as pictures in false colours have it.
    [[nodiscard]] glm::vec3 colourOf(double number) const;
    /// Returns the colour at a part of the bar, 0 to 1.
    [[nodiscard]] glm::vec3 colourAt(double part) const;
};

/// What a picture shows.
struct LegendSubject {
    std::vector<uint32_t> levels;  ///< how many each dataset has; 0: it is of the method `paper`
    bool hasRelief = false;        ///< surfaces with mesostructure
};

/// Returns what a picture's colours mean; nothing where the mode has no false colours, or none on what is shown.
std::vector<Legend> legendsOf(ShadingMode mode, const LegendSubject& subject);

}  // namespace vcp
