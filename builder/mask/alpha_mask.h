// An alpha mask: which points of an image are there, at any resolution, and quickly where all are or none.
//
// Alpha is bilinear between texels, as renderers have it. Coarser levels are means; they are for what is too long to be
// looked at texel by texel.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/stream/material.h"
#include "octree/io/result.h"

namespace vcp {

/// Rows of bytes, from the top.
struct ByteImage {
    uint32_t width, height;
    std::vector<uint8_t> values;
};

/// Any thread. Coordinates are texels of the finest level: (0, 0) is the upper left corner of the image.
class AlphaMask {
public:
    /// `alpha`: at least one texel. `cutoff`: of 255; what is less is cut out.
    AlphaMask(ByteImage alpha, double cutoff, Wrap wrapU, Wrap wrapV);

    [[nodiscard]] glm::dvec2 size() const { return {levels_[0].width, levels_[0].height}; }
    [[nodiscard]] uint64_t bytes() const;
    /// The coarsest level that still shows what there is: at least 8 texels along an edge, unless the image has fewer.
    [[nodiscard]] uint32_t coarsestLevel() const { return uint32_t(levels_.size() - 1); }

    /// Returns by how much alpha, of 255, is above the cutoff; from 0 on a point is there. `at`: finite.
    [[nodiscard]] double marginAt(glm::dvec2 at, uint32_t level = 0) const;

    /// What is in a box of points: at least what is; where a box is not whole it may say that both are.
    enum Content : uint8_t { kNothing = 0, kKept = 1, kCut = 2, kBoth = 3 };
    [[nodiscard]] Content contentOf(glm::dvec2 low, glm::dvec2 high) const;
    /// What is in all of it.
    [[nodiscard]] Content content() const { return Content(contents_.back().values[0]); }

private:
    std::vector<ByteImage> levels_;    // alpha; the finest comes first
    std::vector<ByteImage> contents_;  // Content of blocks of 8 x 8 texels, then of 2 x 2 of these, up to one
    double cutoff_;
    Wrap wrapU_, wrapV_;
};

/// Whether a material's mask may cut anything, by the chunks of its image's file: most images have no alpha.
bool mayCut(const Material& material);

/// Reads the mask of a material whose rule has an image, row by row; one of more than 4096 x 4096 texels at a coarser
/// level. `mostBytes`: that the image may hold meanwhile (ImageRows). Errors: as those of ImageRows and openImage(),
/// and Limit; with the file's name.
Result<AlphaMask> loadMask(const Material& material, uint64_t mostBytes);

}  // namespace vcp
