// What a picture is to show, and how.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/page/paper_page.h"
#include "render/camera.h"
#include "render/environment_light.h"
#include "render/host/section_cut.h"

namespace vcp {

enum class ShadingMode {
    Lit,      ///< vertex colours where there are any, else clay; light and hemisphere
    Clay,     ///< one colour, with light
    Unlit,    ///< vertex colours where there are any, else clay, as they are
    Normals,  ///< normal as colour
    // False colours, blue through green to red (Demir and Westermann 2015, Figures 8 and 9).
    Steps,    ///< node visits of the ray, 0 to 64 (compiles the counting variant on first use)
    Cells,    ///< leaves that the ray was intersected with, 0 to 16 (the same)
    Fetches,  ///< 16-byte reads of the ray, 0 to 128 (the same)
    Level,    ///< level of the page that was hit, coarsest to finest
    Error,    ///< certified error of the page that was hit, 0 to 1 pixel

    Wireframe,  ///< clay, with light, and the edges of triangles and leaves (render/shared/wireframe.h)
};

/// Cuts away what lies on the plane's far side: what has dot(normal, x) >= offset (world units) is kept.
struct SectionPlane {
    glm::dvec3 normal{1, 0, 0};  ///< any length but 0
    double offset = 0;

    bool operator==(const SectionPlane&) const = default;
};
/// A request has at most so many planes (kMaxSections in frame_layout.h).
constexpr size_t kMostSections = 6;
/// Rays of ambient occlusion a pixel and sample: at most, and where it is only switched on.
constexpr uint32_t kMostOcclusionRays = 64, kUsualOcclusionRays = 3;
/// Samples a pixel: at most, and of a picture where no number is asked for.
constexpr uint32_t kMostSamples = 64, kUsualSamples = 16;

/// A light so far away that its rays are parallel.
struct DirectedLight {
    bool followsCamera = true;
    glm::vec3 direction{-0.35f, 0.55f, 0.75f};  ///< towards it: in camera axes (right, up, back) where it follows the
                                                ///< camera, else in world axes
    float strength = 1;                         ///< times the usual one, at least 0

    bool operator==(const DirectedLight&) const = default;
};
/// A picture has at most so many (kMaxLights in frame_layout.h).
constexpr size_t kMostLights = 4;
/// A light is at most so strong.
constexpr float kStrongestLight = 10;

struct Shading {
    ShadingMode mode = ShadingMode::Lit;
    /// The first light, as DirectedLight has it.
    bool lightFollowsCamera = DirectedLight().followsCamera;
    glm::vec3 lightDirection = DirectedLight().direction;
    float lightStrength = DirectedLight().strength;
    std::vector<DirectedLight> moreLights;  ///< beside it: at most kMostLights - 1
    /// Light from everywhere; absent: a pale sky above dark ground.
    std::optional<EnvironmentLight> environment;
    bool lightsBeside = false;  ///< the lights are on beside the environment, too
    bool channels = true;       ///< where materials have normals, roughness, metalness or emission, Lit shows them
    glm::vec3 clay{0.80f, 0.76f, 0.70f};  ///< linear
    glm::vec3 cap{0.62f, 0.23f, 0.16f};   ///< linear; colour of cut solids
    bool shadows = false;                 ///< hard shadows: a further ray a pixel and light
    uint32_t occlusionRays =
        0;  ///< ambient occlusion: so many further rays a pixel, at most kMostOcclusionRays; 0: off
    double occlusionRadius = 0;                    ///< how far they look, world units; 0: a tenth of the box's diagonal
    glm::vec3 backgroundTop{0.10f, 0.12f, 0.15f};  ///< linear
    glm::vec3 backgroundBottom{0.25f, 0.27f, 0.30f};
    bool transparent = false;  ///< background is black with alpha 0
    float opacity = 1;         ///< part of a pixel's samples in which a dataset is there, 0 to 1 (hit_light.h)

    bool operator==(const Shading&) const = default;
};

/// Whether the lights are on: an environment stands for them.
inline bool areLightsOn(const Shading& shading) { return !shading.environment || shading.lightsBeside; }

/// Returns all lights, and sets them: at least one, at most kMostLights.
inline std::vector<DirectedLight> lightsOf(const Shading& shading) {
    std::vector<DirectedLight> lights{{shading.lightFollowsCamera, shading.lightDirection, shading.lightStrength}};
    lights.insert(lights.end(), shading.moreLights.begin(), shading.moreLights.end());
    return lights;
}
inline void setLights(Shading& shading, const std::vector<DirectedLight>& lights) {
    shading.lightFollowsCamera = lights.front().followsCamera;
    shading.lightDirection = lights.front().direction;
    shading.lightStrength = lights.front().strength;
    shading.moreLights.assign(lights.begin() + 1, lights.end());
}

/// Where a picture lies in a larger one: its upper left pixel, and the size of the whole.
struct PictureTile {
    uint32_t x = 0, y = 0;
    uint32_t fullWidth = 1, fullHeight = 1;  ///< 1 to 2^20 each

    bool operator==(const PictureTile&) const = default;
};

inline constexpr double kUsualColourError = 6;

/// Returns the colour error that a picture may have: any where it shows no colours.
inline double colourErrorIn(ShadingMode mode, double asked) {
    const bool isColourless =
        mode == ShadingMode::Clay || mode == ShadingMode::Normals || mode == ShadingMode::Wireframe;
    return isColourless ? std::numeric_limits<double>::infinity() : asked;
}

/// How one dataset is shown.
struct DatasetLook {
    uint32_t dataset = 0;             ///< its number
    std::optional<glm::vec3> colour;  ///< linear; in place of its own colours and of clay, where there is light
    float opacity = 1;                ///< 0 to 1; its shadows stay

    bool operator==(const DatasetLook&) const = default;
};

/// All that a picture depends on, beside the pages. Datasets of the method `paper` (octree/page/paper_page.h) are drawn
/// by their own march, from their own pages. They have no beam pass, no shadows, no ambient occlusion and no caps:
/// where a request asks for these, they are left out.
struct FrameRequest {
    Camera camera;                        ///< camera of the whole picture, where this one is a tile
    uint32_t width = 1280, height = 720;  ///< 1 to 16384 each
    std::optional<PictureTile> tile;      ///< absent: the picture is the whole
    uint32_t sample = 0;                  ///< where in its pixel each ray goes (pixel_samples.h): 0: the middle
    double errorPixels = 0.5;             ///< a page is refined where its certified error projects to more
    /// ΔE (colourErrorOf): a page whose slabs are farther off is refined where these project to more than errorPixels.
    double colourError = kUsualColourError;
    Shading shading;
    std::vector<SectionPlane> sections;     ///< at most kMostSections
    Caps sectionCaps = Caps::None;          ///< without sections there are none
    bool beam = true;                       ///< beam pass; the picture is the same without it, only slower
    PaperMarch march;                       ///< march through datasets of the method `paper`
    std::vector<DatasetLook> looks;         ///< of datasets that are shown otherwise than as they are
    std::vector<uint32_t> hidden;           ///< numbers of datasets that are neither drawn nor loaded, in any order
    std::vector<glm::dvec3> surfacesMoved;  ///< by which surfaces with mesostructure are not where they lie, world
                                            ///< units, one each; there may be fewer

    bool operator==(const FrameRequest&) const = default;
};

/// Returns the request for a dataset as it is to look.
inline FrameRequest requestOfLook(const FrameRequest& request, size_t dataset) {
    FrameRequest own = request;
    for (const DatasetLook& look : request.looks) {
        if (look.dataset != dataset) continue;
        own.shading.opacity = look.opacity;
        if (!look.colour) continue;
        own.shading.clay = *look.colour;
        if (own.shading.mode == ShadingMode::Lit) own.shading.mode = ShadingMode::Clay;
    }
    return own;
}

/// Whether the request leaves a dataset out.
inline bool isHidden(const FrameRequest& request, size_t dataset) {
    return std::find(request.hidden.begin(), request.hidden.end(), dataset) != request.hidden.end();
}

/// Returns by how much the picture shows a surface moved.
inline glm::dvec3 movedBy(const FrameRequest& request, size_t surface) {
    return surface < request.surfacesMoved.size() ? request.surfacesMoved[surface] : glm::dvec3(0);
}

}  // namespace vcp
