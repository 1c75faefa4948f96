// What a build will need, before it begins: counts and bounds are read from the input, the file's bytes and the time
// are those of a sample of it that is built (build_sample.h), temporary bytes and memory are estimated from builds of
// scans (docs/building.md).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>

#include "builder/build.h"
#include "builder/ingest.h"

namespace vcp {

struct BuildEstimate {
    SoupMeasures measures;  ///< area counts only triangles whose vertices fit memory
    bool isAreaComplete = true;
    GridFrame frame;
    uint64_t memoryBytes = 0;  ///< most bytes that the build will take
    uint64_t memoryCap = 0;    ///< most bytes that it may take
    uint64_t tempBytes = 0;    ///< most bytes on the temporary disk at one time; 0: it will write nothing there
    uint64_t fileBytes = 0;
    double seconds = 0;  ///< on this machine as it is now
    std::optional<std::string> warning;
    uint64_t freeTempBytes = 0, freeOutputBytes = 0;  ///< free bytes on the disks they would go to
};

/// Returns the most bytes on the temporary disk, and the bytes of the file, for so many triangles. `imageBytes`: what
/// images take in the file. `soupBytes`: what the triangles took as they were read; 0: they were not read.
/// `memoryBytes`: what temporary files may hold in memory; what fits goes to the disk only if a checkpoint may be made.
uint64_t expectedTempBytes(uint64_t triangles, uint64_t soupBytes, uint64_t imageBytes, uint64_t memoryBytes,
                           bool mayCheckpoint = false);
uint64_t expectedFileBytes(uint64_t triangles);

/// Returns the free bytes where `path`, or the folder it will be in, lies; the largest number when that is unknown.
uint64_t freeBytesAt(const std::filesystem::path& path);

/// Bytes that will be written where `path`, or the folder it will be in, lies.
struct SpaceNeed {
    std::filesystem::path path;
    uint64_t bytes;
    std::string folder;  ///< the folder by its purpose, for the error: "temporary folder"
};

/// Checks that there is room for all of this at once; needs on the same disk are added up. Errors: Limit.
Result<void> checkFreeSpace(std::span<const SpaceNeed> needs);
/// Checks that there is room for a build's temporary files and for `outputBytes` of its output, which the error names.
Result<void> checkBuildSpace(const SpaceNeed& temp, const std::filesystem::path& output, uint64_t outputBytes);

/// Reads the inputs, and builds a sample among the system's temporary files. Errors: as buildOctree's.
Result<BuildEstimate> estimateBuild(const BuildOptions& options);

}  // namespace vcp
