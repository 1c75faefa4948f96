// How a dataset is shown: the settings of `vcp render` and `vcp view`.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "octree/io/result.h"
#include "octree/page/paper_page.h"
#include "render/view/renderer.h"
#include "viewer/annotation/length_unit.h"
#include "viewer/camera/orbit_camera.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

/// A view by its name, a view from an angle, or a camera file.
using CameraChoice = std::variant<View, ViewAngles, std::filesystem::path>;

/// Parses "front", or azimuth, elevation and magnification, "30,35" or "30,35,2"; what is neither a name nor numbers is
/// a file. Returns nothing for numbers that are no view.
std::optional<CameraChoice> parseCamera(std::string_view text);

/// Returns whether a software device leaves its rays to the processor (RendererOptions::hostRays): where no device was
/// named. `device`: the name; empty: none.
[[nodiscard]] inline bool leavesRaysToHost(std::string_view device) { return device.empty(); }

struct RenderSettings {
    std::string device;
    uint64_t budgetBytes = RendererOptions().budgetBytes;
    uint64_t ramBytes = RendererOptions().ramBytes;
    double errorPixels = 0.5;
    double colourError = kUsualColourError;  ///< ΔE
    CameraChoice camera = View::Fit;
    std::optional<UpAxis> up;    ///< nothing: as the box about a scan says (upOf)
    UpAxis usualUp = UpAxis::Y;  ///< where that says nothing
    Shading shading;
    EnvironmentChoice environment;  ///< without a source: none was asked for
    bool hasLight = false;          ///< a light was asked for, which there is beside the environment
    std::vector<PlaneChoice> sections;
    Caps caps = Caps::None;
    PaperMarch march;
    std::optional<LengthUnit> unit;  ///< the world's, for lengths that are shown
    SourceAccess source;

    /// Checks that the settings go with the dataset's method. Errors: Usage.
    [[nodiscard]] Result<void> checkFor(const Dataset& dataset) const;

    /// Takes the light of the environment that was asked for. Errors: those of openEnvironment.
    [[nodiscard]] Result<void> takeEnvironment();

    /// Returns the renderer's options for a local file; a server needs more loader threads.
    [[nodiscard]] RendererOptions rendererOptions() const;
    [[nodiscard]] std::vector<SectionPlane> sectionPlanes(const Box& bounds) const;

    /// Whether no camera was asked for: then a scene's own is used.
    [[nodiscard]] bool isFit() const { return camera == CameraChoice(View::Fit); }
    /// Returns the axis that points up in scans. Scenes with mesostructure surfaces lie as they are placed.
    [[nodiscard]] UpAxis upFor(const Box& bounds) const { return up.value_or(upOf(bounds).value_or(usualUp)); }
    [[nodiscard]] UpAxis upFor(const OpenedScene& scene) const;
    /// Returns the camera of the view, or of the camera file. Errors: those of readCamera.
    [[nodiscard]] Result<OrbitCamera> cameraFor(const Box& bounds, UpAxis upward, glm::ivec2 size,
                                                const PictureMargins& covered = {}) const;
};

/// The names of shading modes, in the order of ShadingMode.
inline constexpr std::array<const char*, 10> kShadingNames = {"lit",   "clay",    "unlit", "normals", "steps",
                                                              "cells", "fetches", "level", "error",   "wireframe"};
static_assert(kShadingNames.size() == size_t(ShadingMode::Wireframe) + 1);
/// Returns the mode of such a name.
std::optional<ShadingMode> shadingNamed(std::string_view name);

}  // namespace vcp
