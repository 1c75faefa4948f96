#include "render/false_colours.h"

#include "render/host/hit_light.h"
#include "render/shared/frame.h"
#include "render/shared/meso_view.h"

namespace vcp {

bool isFalseColour(ShadingMode mode) { return mode >= ShadingMode::Steps && mode <= ShadingMode::Error; }

bool showsWork(ShadingMode mode) { return mode >= ShadingMode::Steps && mode <= ShadingMode::Fetches; }

bool hasHitNumbers(ShadingMode mode) { return isFalseColour(mode) || mode == ShadingMode::Wireframe; }

glm::vec3 falseColour(double part) { return f32::heat(float(part)); }

double falseColourEnd(ShadingMode mode) {
    switch (mode) {
        case ShadingMode::Steps:
            return frame::kMostShownSteps;
        case ShadingMode::Cells:
            return frame::kMostShownCells;
        case ShadingMode::Fetches:
            return frame::kMostShownFetches;
        default:
            return 1;
    }
}

double reliefColourEnd() { return frame::kMesoHottest; }

}  // namespace vcp
