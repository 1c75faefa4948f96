// What a frame came to.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <glm/vec3.hpp>

#include "render/frame_request.h"
#include "render/pages/update_result.h"

namespace vcp {

struct FrameStats {
    uint64_t rays = 0;        ///< pixels
    uint64_t tracedRays = 0;  ///< pixels of tiles that the beam pass could not prove empty
    uint64_t hitPixels = 0;   ///< pixels where any dataset or surface is hit
    double msBeam = 0, msTrace = 0, msLight = 0, msShade = 0,
           msFeedback = 0;  ///< GPU timestamps; 0 where the device has none
    /// From submission to completion, wall clock. Of renderAhead(): GPU time of all passes, where the device has a
    /// clock.
    double msFrame = 0;
    uint64_t poolBytes = 0;    ///< bytes allocated for the pool
    uint64_t colourBytes = 0;  ///< bytes of colour in the pool
    uint32_t pagesInCut = 0;
    uint32_t pipelines = 0;  ///< pipelines made since create()
    double msSurfaces = 0;   ///< GPU time of surfaces with mesostructure
    uint64_t unresolvedRays =
        0;  ///< rays, of shadows too, that used up their iterations in mesostructure or went through too many pieces
    uint64_t farHits = 0;       ///< hits of pixels in surfaces, shown as seen from far and not marched
    uint64_t surfaceBytes = 0;  ///< bytes of mesostructure on the device, beside the pool: assets and shells
    /// Pixels within which remeshed surfaces are certified to be, but for so many patches (meso::RemeshCounts); 0:
    /// nothing is certified.
    double remeshedPixels = 0;
    uint64_t uncertifiedPatches = 0;
    uint64_t heightBytes = 0;     ///< of surfaceBytes: heights of remeshed surfaces that are there, tile by tile
    uint32_t missingHeights = 0;  ///< tiles of heights that the frame read coarser ones for; then nothing is certified
    /// This frame's submissions, with those that present it before it has ended, and how often the CPU waited for one.
    uint64_t submissions = 0, hostWaits = 0;
    bool onHost = false;          ///< the processor cast the rays itself, and no shader ran (RendererOptions::hostRays)
    uint64_t feedbackPasses = 0;  ///< frames since create() that asked rays what to read: none where nothing is missing
};

struct PicturePixel {
    uint32_t x = 0, y = 0;
    bool operator==(const PicturePixel&) const = default;
};

/// A page in the pool, for a picture of what is there.
struct PageBox {
    glm::dvec3 corner;                ///< world position
    std::array<glm::dvec3, 3> edges;  ///< world vectors from the corner
    uint32_t level = 0;               ///< 0: the coarsest
    bool isDrawn = false;             ///< the page is in the cut of this view
    uint64_t number = 0;              ///< in the directory of its dataset
};

/// What the rays of the last frame that missed pages met, 24 x 16 over the picture, row by row from the upper left.
struct FeedbackPicture {
    static constexpr uint32_t kWidth = 24, kHeight = 16;
    /// The certified error, in pixels at the hit, of the page that was hit; with several datasets, the largest. Below
    /// 0: nothing was hit. Where it is above the request's errorPixels, the ray asked for finer pages.
    std::array<float, size_t{kWidth} * kHeight> errorPixels;
};

/// What one pixel shows.
struct PixelHit {
    double depth;            ///< distance from the ray's origin, world units
    glm::dvec3 position;     ///< world space
    glm::vec3 normal;        ///< unit, towards the viewer
    size_t dataset = 0;      ///< number of the dataset, in the order of open()
    bool onCap = false;      ///< the hit is on what a section plane cut open
    bool onSurface = false;  ///< the hit is on mesostructure; then `dataset` means nothing
};

/// A frame that has ended.
struct DoneFrame {
    uint64_t number = 0;  ///< number of the frame among those of its view, from 1
    FrameRequest request;
    FrameStats stats;
    std::optional<PicturePixel> cursor;  ///< the pixel that renderAhead() was given
    std::optional<PixelHit> hit;         ///< what is there; nothing without a cursor
};

}  // namespace vcp
