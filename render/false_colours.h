// What the colours of false-colour pictures stand for, by the functions and constants that colour their pixels.
#pragma once

#include <glm/vec3.hpp>

#include "render/frame_request.h"

namespace vcp {

/// Whether the mode shows numbers, as colours from blue through green to red.
bool isFalseColour(ShadingMode mode);

/// Whether pixels show the work of their rays.
bool showsWork(ShadingMode mode);

/// Whether the mode shows a number of each hit: as a false colour, or as a line.
bool hasHitNumbers(ShadingMode mode);

/// Returns the colour that stands for a part of the number at the colours' end, as pictures have it, 0 to 1: 0 is blue,
/// 1 and more are red.
glm::vec3 falseColour(double part);

/// Returns the number at the colours' end: a count for Steps, Cells and Fetches, pixels for Error. Precondition: a mode
/// of false colours, but not Level, whose end is the finest level of each dataset.
double falseColourEnd(ShadingMode mode);

/// Returns the end for surfaces with mesostructure, on which Steps shows a march's iterations.
double reliefColourEnd();

}  // namespace vcp
