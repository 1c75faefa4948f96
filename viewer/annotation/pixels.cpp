#include "viewer/annotation/pixels.h"

#include <utility>

namespace vcp {

// By Liang and Barsky 1984.
bool cutToPicture(Segment& segment, glm::dvec2 size, double margin) {
    const glm::dvec2 along = segment.to - segment.from;
    double enter = 0, leave = 1;
    for (int axis = 0; axis < 2; ++axis) {
        double near = (-margin - segment.from[axis]) / along[axis];
        double far = (size[axis] + margin - segment.from[axis]) / along[axis];
        if (along[axis] == 0) {
            if (segment.from[axis] < -margin || segment.from[axis] > size[axis] + margin) return false;
            continue;
        }
        if (near > far) std::swap(near, far);
        enter = std::max(enter, near);
        leave = std::min(leave, far);
    }
    if (!(enter <= leave)) return false;
    segment = {segment.from + along * enter, segment.from + along * leave};
    return true;
}

double distanceTo(const Segment& segment, glm::dvec2 point) {
    const glm::dvec2 along = segment.to - segment.from;
    const double squared = glm::dot(along, along);
    const double t = squared > 0 ? std::clamp(glm::dot(point - segment.from, along) / squared, 0.0, 1.0) : 0;
    return glm::length(point - segment.from - along * t);
}

void blend(Picture& picture, glm::ivec2 pixel, glm::vec3 colour, float opacity) {
    uint8_t* rgba = &picture.rgba[4 * (size_t(pixel.y) * picture.width + size_t(pixel.x))];
    const float below = float(rgba[3]) / 255 * (1 - opacity), all = opacity + below;
    if (all <= 0) return;
    for (int channel = 0; channel < 3; ++channel) {
        const float mixed = (255 * colour[channel] * opacity + float(rgba[channel]) * below) / all;
        rgba[channel] = uint8_t(std::clamp(mixed + 0.5f, 0.0f, 255.0f));
    }
    rgba[3] = uint8_t(std::clamp(255 * all + 0.5f, 0.0f, 255.0f));
}

}  // namespace vcp
