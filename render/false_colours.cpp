#include "render/false_colours.h"

#include "render/frame_setup.h"
#include "render/host/hit_light.h"
#include "render/shared/meso_view.h"

namespace vcp {

bool isFalseColour(ShadingMode mode) { return mode >= ShadingMode::Steps && mode <= ShadingMode::Error; }

bool showsWork(ShadingMode mode) { return mode >= ShadingMode::Steps && mode <= ShadingMode::Fetches; }

bool hasHitNumbers(ShadingMode mode) { return isFalseColour(mode) || mode == ShadingMode::Wireframe; }

glm::vec3 falseColour(double part) { return f32::heat(float(part)); }

double falseColourEnd(ShadingMode mode) { return double(mostShown(shadingMode(mode))); }

double reliefColourEnd() { return frame::kMesoHottest; }

}  // namespace vcp
