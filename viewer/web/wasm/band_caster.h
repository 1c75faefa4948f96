// Casts a picture in bands of rows, so that several instances share one: each casts its bands from pages of its own,
// in its pool or copied from another's. What a band shows depends on the picture alone, not on who casts it.
//
// Memory is taken for one band at a time; what stays of a band is 4 bytes a pixel, or 16 from the second sample on.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/frame_request.h"
#include "render/host_layer.h"

namespace vcp {

/// What a sample of a picture is cast with, beside the pages.
struct BandFrame {
    FrameRequest request;                    ///< of the whole picture, and of this sample
    double errorPixels = 0;                  ///< of the cut (UpdateResult)
    bool asksRays = false;                   ///< rays are to say which pages they hit
    bool listens = false;                    ///< and some of them, where
    std::shared_ptr<const ImageSet> images;  ///< to draw from; null: none
};

/// What rays said, in any number of bands.
struct BandsSaid {
    PagesHit hit;
    RayFeedback feedback;

    void add(const BandsSaid& other);
};

class BandCaster {
public:
    /// Rows of a band: the last one of a picture may have fewer. With ambient occlusion, which is averaged over the
    /// rows around, bands overlap, and are higher to make that cheap.
    static constexpr uint32_t kRows = 32, kRowsWithOcclusion = 96;
    [[nodiscard]] static uint32_t rowsOf(const FrameRequest& request);
    [[nodiscard]] static uint32_t bandsOf(const FrameRequest& request);

    /// Begins a sample. `dataset`: its header and its first entry are read; it and the pages must outlive the sample.
    /// Sample 0 begins a picture; later ones are added to the bands that this instance has cast. Errors: Usage.
    Result<void> begin(const Dataset& dataset, bool withColour, const BandFrame& frame, std::vector<CutPage> cut);
    /// Casts a band. Preconditions: begin(); of samples after the first, this instance has cast the band before.
    void cast(uint32_t band);

    /// The colours of the band cast last, RGBA8, the mean of its samples: valid until the next call.
    std::span<const uint32_t> colours();
    /// Distances along its rays in the sample cast last, world units; infinite where nothing is hit.
    [[nodiscard]] std::span<const float> depth() const { return depth_; }
    /// What the rays of the sample's bands said so far.
    [[nodiscard]] BandsSaid said() const;

    /// Forgets the picture, which takes memory.
    void forget() { kept_.clear(); }

private:
    /// What is kept of a band: colours of its only sample, or light of several.
    struct Kept {
        std::vector<uint32_t> colours;
        SampledLight light;
    };
    struct Rows {
        uint32_t first, count;
    };
    [[nodiscard]] Rows rowsOf(uint32_t band) const;
    void keep(std::span<const uint32_t> colours, Kept& kept) const;

    const Dataset* dataset_ = nullptr;
    bool withColour_ = false;
    BandFrame frame_;
    std::optional<CutScene> scene_;
    std::optional<PictureMarks> marks_;
    RayFeedback feedback_;
    std::vector<Kept> kept_;  // of each band
    uint32_t last_ = 0;       // band cast last
    std::vector<float> depth_;
    std::vector<uint32_t> mean_;
};

/// Returns the distance along the ray at a pixel of a picture, as a band's; infinite where nothing is hit.
float depthAt(const Dataset& dataset, const FrameRequest& request, std::vector<CutPage> cut, bool withColour,
              uint32_t x, uint32_t y);

}  // namespace vcp
