// Draws a dataset into a picture: rays, light and colours of a tile, then the next tile.
//
// Ambient occlusion is averaged over pixels of neighbouring tiles, so with it a second turn over the tiles gives the
// colours. Of several datasets, drawn one after the other, the nearest surface is seen at each pixel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "render/host/host_caster.h"
#include "render/host/page_marks.h"
#include "render/shared/frame.h"

namespace vcp {

/// The page that a pixel shows.
struct HostHit {
    static constexpr uint32_t kOnSurface = UINT32_MAX - 1;
    uint32_t dataset = UINT32_MAX;  ///< number of its layer; kOnSurface; UINT32_MAX where nothing is hit
    uint32_t page : 31 = 0;         ///< index in the layer's scene; of a cap, of what is behind it
    uint32_t onCap : 1 = 0;         ///< the hit is on the cap of a section
};

/// A picture in the making: width * height elements each, row by row from the upper left.
struct HostPicture {
    /// `background`: RGBA8, one a row.
    HostPicture(glm::ivec2 size, std::span<const uint32_t> background);

    glm::ivec2 size;
    std::vector<uint32_t> colours;   ///< RGBA8
    std::vector<float> depth;        ///< world units along the unit ray; infinite where nothing is hit
    std::vector<glm::vec3> normals;  ///< unit, world axes, towards the viewer; 0 where nothing is hit
    std::vector<HostHit> hits;
    std::vector<uint32_t> work;        ///< what a false colour shows of each pixel's ray; empty: none is counted
    std::vector<uint32_t> iterations;  ///< of rays in mesostructure; empty without surfaces
    uint64_t unresolvedRays = 0, farSurfaceHits = 0;  ///< in mesostructure (SurfaceWork)
};

/// The light of a picture's samples: of each pixel the sum of light times alpha, and of alpha.
class SampledLight {
public:
    explicit SampledLight(size_t pixels = 0) : sums_(pixels, glm::vec4(0)) {}
    /// Adds a sample's colours, RGBA8, or a part of them, which begins at pixel `first`. The last part makes the sample
    /// whole.
    void add(std::span<const uint32_t> colours, size_t first = 0);
    /// Returns the number of whole samples.
    [[nodiscard]] uint32_t samples() const { return samples_; }
    /// Returns the colours of the mean, as accumulate.comp finds them.
    [[nodiscard]] std::vector<uint32_t> mean() const;

private:
    std::vector<glm::vec4> sums_;
    uint32_t samples_ = 0;
};

/// A dataset as a picture shows it.
struct HostLayer {
    const HostScene& scene;
    PictureRays rays;               ///< in the dataset's own space
    frame::FrameConstants frame;    ///< as the shaders get it
    bool hasColour = false;         ///< hits have colours
    bool hasChannels = false;       ///< channels of materials are shown, where the scene's images have some
    Caps caps = Caps::None;         ///< fills what the section planes of the rays cut open
    double worldPerUnit = 1;        ///< world units per unit of the dataset's own
    uint32_t number = 0;            ///< of the dataset in the picture
    PictureMarks* marks = nullptr;  ///< where given, gets the pages that rays hit; one for each page of the scene
};

/// Draws a layer over what is in the picture. Where picture.work is as large as the picture, the work of the layer's
/// rays is added to it, and pixels show it. Precondition: it is just where frame.shadingMode is a count of work.
/// Errors: Cancelled, between tiles.
Result<void> drawLayer(const HostLayer& layer, const HostCastOptions& options, HostPicture& picture);

}  // namespace vcp
