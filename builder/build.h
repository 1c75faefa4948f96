// buildOctree: triangle meshes in, one .vcp file out.
//
// The stages, each in a file of its own:
//   ingest      meshes -> vertices on the finest level's integer lattice (mesh_lattice.h)
//   levels      coarser meshes from finer ones, each with a bound on how far it strayed (coarsen.h)
//   bin         triangles -> the subvolumes of a level that they touch (bin_triangles.h)
//   page        the triangles of one subvolume -> one certified page (page_builder.h)
//   write       pages, directory, hashes (octree/vcp_writer.h)
// The output is the same bytes for any number of threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "octree/result.h"

namespace vcp {

enum class ColourChoice { Auto, Vertex, None };

struct BuildProgress {
    const char* stage = "";  ///< "reading", "level 5 of 6", "writing"
    double fraction = 0;     ///< of the whole build, 0 to 1, never decreasing
    uint64_t triangles = 0;  ///< read so far
    double seconds = 0;
};

struct BuildOptions {
    std::vector<std::filesystem::path> inputs;  ///< joined into one dataset
    std::filesystem::path output;
    double cell = 0;             ///< finest cell edge, world units; 0: chosen from the mesh
    double error = 0;            ///< tolerated distance to the mesh, world units; 0: kDefaultErrorCells cells
    bool errorIsRelative = false;  ///< `error` is a fraction of the bounding box's diagonal
    unsigned threads = 0;        ///< 0: one a processor
    ColourChoice colour = ColourChoice::Auto;
    /// Called from one thread at a time, about ten times a second; false cancels. May be empty.
    std::function<bool(const BuildProgress&)> progress;
};

/// Default tolerance of the finest level, in its cells.
inline constexpr double kDefaultErrorCells = 0.08;

struct BuildReport {
    uint64_t triangles = 0;            ///< read
    uint64_t degenerateTriangles = 0;  ///< of them, without area
    uint64_t vertices = 0;
    double seconds = 0;
    uint64_t peakRssBytes = 0;
    uint64_t tempBytes = 0;
    uint64_t fileBytes = 0;
    uint32_t levels = 0;
    uint64_t subvolumes = 0;
    uint64_t leaves = 0;      ///< of the finest level, soft and hard
    uint64_t hardLeaves = 0;  ///< of the finest level
    double cell = 0;          ///< finest cell edge, world units
    double errorTarget = 0;   ///< world units
    double certifiedErrorMax = 0;  ///< of the finest level, world units
};

/// Builds. Blocks; uses options.threads threads. On error or cancellation nothing is left of the output.
/// Errors: what the readers report; InvalidInput (no triangle with area, nothing finite); Limit (cell too
/// small for the mesh's extent, too many pages); Io (output not writable, disk full); Cancelled.
Result<BuildReport> buildOctree(const BuildOptions& options);

}  // namespace vcp
