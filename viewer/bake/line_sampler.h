// Where lines meet the surface of a dataset, at its finest level: pages are read as runs of lines need them, and the
// lines of a run are cast in parallel, in double precision (octree/reference_caster.h).
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>

#include <glm/vec3.hpp>

#include "octree/dataset_reader.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"

namespace vcp {

/// The points start + t direction; the direction need not have unit length.
struct SampleLine {
    glm::dvec3 start{0}, direction{0, 0, 1};
};

/// What a line meets nearest to its start. Of two sheets as near to it as each other, that on the direction's side.
struct LineHit {
    static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    double at = std::numeric_limits<double>::quiet_NaN();  ///< t; not a number where there is nothing
    float other = kNone;                                   ///< t of the second nearest sheet
    glm::vec3 normal{kNone};                               ///< unit, towards the direction's side
    glm::vec3 light{kNone};                                ///< linear, where the dataset has colour
};

struct LineSamplerOptions {
    double low = -1, high = 1;  ///< t of the ends of all lines; low <= 0 <= high
    bool withColour = true;
    uint64_t memoryBytes = uint64_t{1} << 30;  ///< of the pages that are held
    /// Called from one thread with the fraction done; false cancels. May be empty.
    std::function<bool(double)> progress = {};
};

/// Samples lines; those of a run of thousands should lie together. `dataset`: its directory is known as a whole. Hits
/// closer to each other than a thousandth of a finest cell are one. Errors: those of readPage; Limit, where the memory
/// cannot hold the pages that a few lines pass; Cancelled.
Result<void> sampleLines(std::shared_ptr<const ByteReader> reader, const Dataset& dataset,
                         std::span<const SampleLine> lines, std::span<LineHit> hits, const LineSamplerOptions& options);

}  // namespace vcp
