// Camera paths of `vcp stress`, and its faults as text. Pure.
//
//   orbit     once around, all of the dataset in the picture
//   dive      from there down to the surface, 32 finest cells above it, and ever slower
//   fly       straight through the dataset, turning a little
//   teleport  somewhere else every 10 frames: around and inside, looking anywhere
//   jitter    half as far as orbit, shaking by a few percent each frame
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "render/camera.h"
#include "streaming/faulty_reader.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

struct StressPathOptions {
    std::string name = "orbit";
    Box bounds;
    glm::dvec3 target{0};  ///< the point of the surface that dive goes to
    double cell = 1;       ///< edge of the finest cell
    glm::ivec2 size{640, 400};
    int frames = 120;  ///< at least 1
    uint64_t seed = 1;
};

const std::vector<std::string>& stressPathNames();

/// Returns a camera for each frame; nothing for an unknown name.
std::optional<std::vector<Camera>> stressPath(const StressPathOptions& options);

/// Parses "error=0.1,corrupt=0.01,stall=500ms,stalls=0.05,latency=50ms,spread=20ms,bandwidth=2.5M": rates from 0 to 1;
/// times with ms or s; stalls is the rate of stalls, 0.02 unless given; bandwidth in bytes a second. Returns nothing
/// when the text is malformed.
std::optional<Faults> parseFaults(std::string_view text);

}  // namespace vcp
