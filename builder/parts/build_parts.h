// A build in parts: many processes, on one machine or many, make what buildOctree makes, byte for byte.
//
// planParts writes a folder that all machines see. Then each stage runs its parts, in any order and at the same time,
// once all parts of the stage before are done:
//   read      P parts  each reads some of the inputs
//   count     1 part   chooses the pages and the bins, and codes images
//   deal      P parts  each deals its share of the triangles into bins
//   vertices  P parts  each finds the normals in its run of bins, and which parts of the mesh are closed
//   pages     P parts  each builds the pages of its bins, and above these all that have nothing of other parts
//   merge     1 part   builds the few pages that are left, and writes the file
// Levels take no stages of their own: above P runs of the Morton curve at most P - 1 pages a level belong to several.
//
// A part writes into a new folder beside the plan, which gets its name once it is complete and durable: so a part may
// be run twice, at once, or again after it was killed. Nothing is locked, no file is changed once it is complete.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "builder/build.h"
#include "octree/io/result.h"

namespace vcp {

/// A part of the stage `pages` opens a file of each part of the stage before it.
inline constexpr unsigned kMostParts = 512;

struct PartStage {
    std::string name;
    unsigned parts;  ///< numbered from 0
};

/// Returns the stages of a build in so many parts, in their order.
std::vector<PartStage> stagesOf(unsigned parts);

/// Writes the plan of a build of options.inputs in `parts` parts into a new folder: OUT.vcp.parts beside the output, or
/// in options.temp. Returns the folder. Reads all inputs once, for their hashes. Errors: Usage (standard input, an
/// error or leaves of the mesh are asked for, there is a plan already), Io, InvalidInput.
Result<std::filesystem::path> planParts(const BuildOptions& options, unsigned parts);

struct PartStep {
    std::filesystem::path folder;  ///< that of planParts
    std::string stage;
    unsigned number = 0;
    unsigned threads = 0;      ///< 0: one a processor
    uint64_t memoryBytes = 0;  ///< 0: as planned
    std::function<bool(const BuildProgress&)> progress = {};
};

struct PartReport {
    bool wasDone = false;                      ///< there was nothing to do
    std::optional<BuildFigures> dataset = {};  ///< after merge; time and memory are the merge's
    std::vector<std::string> warnings = {};    ///< of the inputs; after merge
};

/// Runs one part. Errors: Usage (no such stage or part, another version of the program planned it, a part of the stage
/// before is not done, an input was changed); InvalidInput (a part was lost or cut off, and is named); buildOctree's.
Result<PartReport> runPart(const PartStep& step);

}  // namespace vcp
