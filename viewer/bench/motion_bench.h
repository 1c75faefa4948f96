// Measures frames in motion: a Viewer is driven as a window drives it, while the camera turns once about what is shown
// and comes as near as a third of the distance; by the wall clock, without a window and without showing the pictures.
//
// The measurement follows the machine: each frame shows the time that has passed, so a slow machine draws fewer. All
// that the first view wants is read before, and what comes into view is read meanwhile.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "viewer/scene/scene_opening.h"
#include "viewer/viewer.h"

namespace vcp {

struct MotionOptions {
    ViewerOptions viewer;
    glm::ivec2 size{1280, 720};
    double seconds = 10;
    std::function<bool()> cancel;  ///< true ends it; may be empty
};

struct MotionReport {
    double seconds = 0;                   ///< time that the motion took
    std::vector<double> frameMs;          ///< from one frame to the next, in order
    std::map<int, uint64_t> byReduction;  ///< frames drawn at 1, 1/2, ... of width and height
    double stillMs = 0;                   ///< a frame at full size before
    std::optional<double>
        fullSizeAfterMs;  ///< from the end of the motion until a frame at full size was drawn; nothing: it never was
    std::string device;
    glm::ivec2 size{0};

    [[nodiscard]] double framesPerSecond() const { return seconds > 0 ? double(frameMs.size()) / seconds : 0; }
    /// Returns the smallest time that `part` of the frames did not exceed; 0 without frames.
    [[nodiscard]] double quantileMs(double part) const;
};

/// Runs the measurement, from the scene's own camera where it has one, else from the front. Errors: those of Viewer;
/// Cancelled.
Result<MotionReport> measureMotion(const OpenedScene& scene, const MotionOptions& options);

std::string motionJson(const MotionReport& report);
std::string motionText(const MotionReport& report);

}  // namespace vcp
