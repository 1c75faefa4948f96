// Computes from a request what shaders and selection need: in double, rounded once. Pure.
#pragma once

#include <span>
#include <vector>

#include "render/frame_request.h"
#include "render/frame_result.h"
#include "render/shared/frame.h"
#include "render/similarity.h"
#include "streaming/page_selection.h"

namespace vcp {

/// Returns a vector as shaders get it: rounded, with a fourth component of 0.
inline glm::vec4 toVec4(glm::dvec3 v) { return {glm::vec3(v), 0}; }

/// `request` is as seen from the dataset (requestIn); `placement` gives what shows the world's axes or units. `dataset`
/// may be null: a picture of the background. `stripes`: see stripedIndex in tiles.glsl. `colour`: whether hits have
/// colours. `errorPixels`: error of what is drawn (UpdateResult).
frame::FrameConstants frameConstants(const FrameRequest& request, const Dataset* dataset, uint32_t stripes, bool colour,
                                     double errorPixels, const Similarity& placement = {});

/// Unit directions towards the light and towards the middle of the sky, in the axes of the request's camera.
struct LightDirections {
    glm::dvec3 light, sky;
};
/// Returns the unit direction towards a light, in the request's axes.
glm::dvec3 towardsLight(const DirectedLight& light, const CameraBasis& basis);

LightDirections lightDirections(const FrameRequest& request, const CameraBasis& basis);

/// Whether rays of light are traced: where shading asks for them and shows light.
bool hasLight(const Shading& shading);
/// Whether shadows are asked for, and a light is there that casts any: an environment does not.
bool castsShadows(const Shading& shading);

/// Returns how what planes cut open of a dataset is filled. Caps::Closed is for those that have open parts, and say so.
Caps capsOf(const FrameRequest& request, const Dataset& dataset);

/// Whether section planes cut, and what of what they cut open is filled: all of it, or closed parts (trace.comp).
enum class SectionKind : uint32_t { None, Open, Capped, ClosedCapped };
/// `caps`: capsOf(), of a dataset.
SectionKind sectionKind(const FrameRequest& request, Caps caps);

/// Returns the mode as shaders get it (FrameConstants::shadingMode).
uint32_t shadingMode(ShadingMode mode);

/// Words that a pixel's hit takes: depth, normal, and where wanted colour, and light or the value of a false colour.
uint32_t hitPlanes(const FrameRequest& request, bool colour);

/// Returns the tile that a request draws; the whole picture where it names none.
PictureTile wholePicture(const FrameRequest& request);

/// Returns where the upper left corner of the part that a request draws is seen, in pixels of the whole: where the
/// tile begins, moved by the request's sample.
glm::dvec2 upperLeft(const FrameRequest& request);

/// Returns planes as rays are clipped by them, with unit normals.
std::vector<SectionCut> sectionCuts(std::span<const SectionPlane> planes);

/// Returns the rays of the part of a picture that a request draws, with its section planes.
PictureRays pictureRays(const FrameRequest& request);

/// Returns what a pixel shows: a hit in depth `depth` (world units from the ray's origin), with a unit normal.
PixelHit pixelHit(const FrameRequest& request, PicturePixel pixel, double depth, glm::vec3 normal);

/// Returns the picture's background, one RGBA8 word a row.
std::vector<uint32_t> backgroundRows(const FrameRequest& request);

SelectionView selectionView(const FrameRequest& request);

/// Checks that sizes, angles and axes make a picture. Errors: Usage.
Result<void> checkRequest(const FrameRequest& request);

}  // namespace vcp
