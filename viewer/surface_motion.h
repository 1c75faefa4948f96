// The time of a scene whose surfaces with mesostructure go along paths.
#pragma once

#include <utility>
#include <vector>

#include "viewer/scene/meso_scene.h"

namespace vcp {

class SurfaceMotion {
public:
    SurfaceMotion() = default;
    /// Begins at time 0, and goes on by itself where anything moves.
    explicit SurfaceMotion(std::vector<SurfacePath> paths) : paths_(std::move(paths)), isPlaying_(isThere()) {}

    /// Whether anything moves.
    [[nodiscard]] bool isThere() const { return periodOf(paths_) > 0; }
    [[nodiscard]] bool isPlaying() const { return isPlaying_; }
    void play(bool goesOn) { isPlaying_ = goesOn && isThere(); }
    void advance(double seconds) { time_ += seconds; }
    /// Returns FrameRequest::surfacesMoved.
    [[nodiscard]] std::vector<glm::dvec3> surfacesMoved() const { return surfacesMovedAt(paths_, time_); }

private:
    std::vector<SurfacePath> paths_;
    bool isPlaying_ = false;
    double time_ = 0;  // seconds
};

}  // namespace vcp
