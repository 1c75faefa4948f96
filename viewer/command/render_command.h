// What `vcp render` is asked for, and how it draws that: one picture, one of each method of mesostructure, or pictures
// in tiles and sequences.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/build.h"
#include "render/picture_renderer.h"
#include "viewer/camera/orbit_camera.h"
#include "viewer/command/commands.h"
#include "viewer/picture/picture_sequence.h"
#include "viewer/scene/render_settings.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

/// Pictures of more pixels are drawn in tiles: devices limit how many a buffer may hold.
constexpr uint64_t kMostPixelsAtOnce = 8 << 20;
/// The edge of a tile where none is given.
constexpr uint32_t kUsualTile = 2048;

/// What the pictures of a sequence show, each in its turn.
struct PictureCourse {
    std::vector<OrbitCamera> cameras;                    ///< at least one
    std::vector<std::vector<glm::dvec3>> surfacesMoved;  ///< one for each camera (FrameRequest), or none
};

struct RenderCommand {
    std::vector<std::string> inputs;
    std::string output;
    glm::ivec2 size{1920, 1200};
    std::string depth, normals;
    bool overwrite = false;
    int frames = 0;  // 0: not given
    bool settle = true;
    uint32_t tile = 0;  // 0: not given
    uint32_t samples = kUsualSamples;
    bool transparent = false;
    std::string measurement;  // a file; empty: none
    bool legend = false, scaleBar = false, annotations = true;
    int turntable = 0;
    std::string path;
    bool animate = false;
    int framesPerSecond = 30;
    std::vector<std::string> methods;  // empty: those of the scene
    std::optional<int> subdivide;
    bool validation = false;
    BuildOptions build;
    RenderSettings render;
    ReportOptions report;

    /// Figures are wanted with --json, and the first frame, which compiles, would not be one.
    [[nodiscard]] int framesToTime() const { return frames > 0 ? frames : report.json ? 5 : 0; }
    [[nodiscard]] bool isSequence() const { return turntable > 0 || !path.empty() || animate; }
    [[nodiscard]] bool isVideo() const { return isVideoPath(output); }
    /// Returns the name of a picture's file, for one of the command's outputs.
    [[nodiscard]] std::filesystem::path fileOf(const std::string& name, size_t picture) const {
        return isSequence() && !isVideoPath(name) ? numbered(name, picture) : std::filesystem::path(name);
    }
    [[nodiscard]] bool isTiled(const FrameRequest& request) const {
        return tile > 0 || isSequence() || uint64_t{request.width} * request.height > kMostPixelsAtOnce;
    }
};

using PaintRows = decltype(PictureSequenceOptions::paintOver);

/// Has what remeshed surfaces measure for a view shown where it takes long, and end where a person interrupts it.
void reportMeasuring(std::span<MesoSurface> surfaces, ProgressStyle style);

/// Errors: Device, where Vulkan's validation layers said something.
Result<void> checkValidation(const PictureRenderer& renderer);

/// Draws one picture, or one a method, side by side, and writes it. Prints a line about it, or returns its figures, for
/// --json. `paintOver` may be empty. Errors: those of drawing and writing; Cancelled.
Result<Json> drawOne(PictureRenderer& renderer, const FrameRequest& request, const OrbitCamera& camera,
                     const PaintRows& paintOver, const RenderCommand& command, const SceneFile& scene,
                     const OutputRules& rules);

/// Makes pictures in tiles and sequences, with progress; when it is cancelled, finished pictures stay. Reports as
/// drawOne does.
Result<Json> makeTiled(PictureRenderer& renderer, const FrameRequest& request, const PictureCourse& course,
                       const PaintRows& paintOver, const RenderCommand& command, const OutputRules& rules);

}  // namespace vcp
