// What WebGL draws a frame with, and what its rays say: a texture mirrors the pool, a unit of 16 KiB a row, so that
// shaders find pages by the table that they have elsewhere.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec4.hpp>

#include "render/frame_request.h"
#include "render/pages/residency.h"

namespace vcp {

/// Rows of the texture that are to be copied from the module's memory.
struct MirroredRows {
    uint32_t first = 0, count = 0;
    uint32_t address = 0;
    uint32_t reserved = 0;
};
static_assert(sizeof(MirroredRows) == 16);

/// Knows what the texture holds.
class PoolMirror {
public:
    /// Returns what must be copied before the cut is drawn, and counts it as copied.
    std::vector<MirroredRows> rowsToCopy(Residency& residency);
    /// How many rows the texture must have.
    [[nodiscard]] size_t rows() const { return pages_.size(); }
    /// The texture holds nothing.
    void forget() { pages_.clear(); }

private:
    std::vector<uint64_t> pages_;  // of each row, the page plus 1
};

/// The constants of the pipelines that draw a request, by the ids that shaders have them under.
struct GpuConstants {
    uint32_t colour = 0;    ///< 3
    uint32_t sections = 0;  ///< 7 of trace.comp
    uint32_t light = 0;     ///< 7 of shade.comp
};
GpuConstants gpuConstants(const FrameRequest& request, const Residency& residency);

/// Returns what the rays of a grid over the picture met. `hits`: of each, depth in finest cells (bits of a float;
/// negative on the cap of a section), two words more, and the number of the page's record in the table plus 1, or 0.
RayFeedback feedbackOf(std::span<const glm::uvec4> hits, std::span<const frame::TableRecord> table,
                       const Dataset& dataset, const FrameRequest& request);

/// Returns the pages that rays of a picture hit. `marks`: of each record of the table, not 0 where a ray of the camera
/// did. Pages in which rays begin count as well; those that rays of light hit are not known, so all do.
PagesHit pagesMarked(std::span<const uint32_t> marks, std::span<const frame::TableRecord> table, const Dataset& dataset,
                     const FrameRequest& request);

}  // namespace vcp
