// buildOctree: triangle meshes in, one .vcp file out.
//
// Nothing but bins that fit memory is ever held of the mesh. The stages, each in files of their own:
//   ingest      meshes -> a soup of triangles in the world (mesh/, vertex_join.h, ingest.h)
//   deal        which pages hold the mesh, and the soup on their lattice (lattice_soup.h), dealt into bins (deal.h)
//   step        a level's bins -> the next coarser level's bins (level/); the first step finds normals
//   pages       a bin -> its certified pages (page/, level_pages.h)
//   write       pages, directory, hashes (dataset_assembly.h, octree/vcp_writer.h)
// What passes between them lies on temporary files (spill/), in memory while
// there is room. A journal (checkpoint.h) says how far things are: after an interruption the build goes on
// from there.
// The output is the same bytes for any number of threads, any memory that each image fits, any order of the triangles
// and however often the build was interrupted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/stream/side_file.h"
#include "octree/io/result.h"

namespace vcp {

class MeshSample;

/// Auto: all colours there are. Texture: materials and their images, not the vertices' colours.
enum class ColourChoice { Auto, Vertex, Texture, None };

/// What the levels above the finest are made of. Slabs: a plane with a thickness for each cell (slab/slab_tree.h),
/// where the finest level is the mesh. Mesh: soft and hard leaves over triangles whose vertices are clustered (level/);
/// always where there is an `error`.
enum class CoarseLeaves { Slabs, Mesh };

/// Which normals vertices of the finest level have. Mesh: the file's own, where it has them and they differ from the
/// computed ones (settleNormals, lattice/lattice_mesh.h). Computed: means over the triangles around, whatever the file
/// has.
enum class VertexNormals { Mesh, Computed };

struct BuildProgress {
    std::string stage = {};  ///< "reading", "images", "sorting", "level 5 of 6", "writing", "done"
    double fraction = 0;     ///< fraction of the whole build, 0 to 1, never decreasing; 1: done
    double begun = 0;        ///< the fraction that was done when this run began; 0 unless it was resumed
    uint64_t triangles = 0;  ///< read so far
    uint64_t tempBytes = 0;  ///< on the temporary disk now
    double seconds = 0;
};

/// How the images that a file keeps are coded. A JPEG's quality goes from 1 to 100; 0: without loss.
struct ImageQuality {
    /// The finest level's; nothing: it is as the source has it, which is a JPEG's own blocks, and else without loss.
    std::optional<int> finest;
    /// That of the levels above, which are means of light; nothing: a source's JPEG says it, 80 to 95, and else 95.
    std::optional<int> coarser;

    bool operator==(const ImageQuality&) const = default;
};

struct BuildOptions {
    std::vector<std::filesystem::path>
        inputs;          ///< inputs: files, folders of them, "-" for standard input; joined into one dataset
    std::string format;  ///< format of inputs whose content does not tell it (meshFormats())
    std::filesystem::path output;
    bool overwrite = false;  ///< also replaces an output that is no dataset (octree/io/output_file.h); never an input
    double cell = 0;  ///< finest cell edge, world units, where triangles are not crowded; 0: chosen from the mesh
    /// Where the root page begins, world units; none: a cell before the mesh's bounds. With it and a given cell, what
    /// of a mesh stays as it is when another part changes is built to the same pages.
    std::optional<glm::dvec3> origin = {};
    double error = 0;               ///< tolerated distance to the mesh, world units; 0: the finest level is the mesh
    bool errorIsRelative = false;   ///< `error` is a fraction of the bounding box's diagonal
    unsigned threads = 0;           ///< 0: one a processor
    uint64_t memoryBytes = 0;       ///< cap on what the build allocates; 0: defaultMemoryBytes()
    std::filesystem::path temp;     ///< folder for temporary files; empty: beside the output
    bool resume = false;            ///< go on where an interrupted build of the same output was
    double checkpointSeconds = 15;  ///< least time between checkpoints, which make what is done durable
    ColourChoice colour = ColourChoice::Auto;
    CoarseLeaves coarseLeaves = CoarseLeaves::Slabs;
    /// Keeps the images of the materials that colour comes from, and where triangles of the finest level are in them;
    /// colours at vertices stay. Nothing: where the finest level is the mesh.
    std::optional<bool> keepImages;
    ImageQuality imageQuality;
    bool channels = true;  ///< with the images: what materials have beside their colour (MaterialChannels)
    VertexNormals vertexNormals = VertexNormals::Mesh;
    bool allowOutside = false;  ///< files that a mesh names are opened also outside its folder
    bool masks = true;          ///< what the alpha of materials leaves out is no surface (MaskRule); false: it is
    /// Is given what is read, for a picture meanwhile (mesh_sample.h); nothing where work is resumed. May be empty.
    std::shared_ptr<MeshSample> sample;
    /// Called from one thread at a time, about ten times a second and whenever a stage begins. Returning false cancels;
    /// then it is not called again. May be empty.
    std::function<bool(const BuildProgress&)> progress;
};

/// Whether a build keeps images, where the mesh has some.
inline bool keepsImages(const BuildOptions& options) { return options.keepImages.value_or(options.error == 0); }

struct BuildFigures {
    uint64_t triangles = 0;            ///< triangles read, and parts of those that masks cut
    uint64_t degenerateTriangles = 0;  ///< those among them without area
    uint64_t vertices = 0;
    double seconds = 0;
    uint64_t peakRssBytes = 0;
    uint64_t tempBytes = 0;
    uint64_t fileBytes = 0;
    uint32_t levels = 0;
    uint64_t subvolumes = 0;
    uint64_t leaves = 0;           ///< soft and hard leaves of the pages without children
    uint64_t hardLeaves = 0;       ///< hard leaves of the pages without children
    double cell = 0;               ///< cell edge of the last level, world units
    double errorTarget = 0;        ///< world units
    double certifiedErrorMax = 0;  ///< largest certified error of the pages without children, world units
};

struct BuildReport : BuildFigures {
    bool isResumed = false;             ///< seconds are those since then
    uint64_t cutTriangles = 0;          ///< triangles of the inputs that masks cut, or cut out
    std::vector<std::string> warnings;  ///< one line for each thing that was left out of the inputs
    std::vector<SideFile> sideFiles;    ///< files that the inputs name, each once
};

/// Returns the folder where a build keeps its temporary files.
std::filesystem::path tempFolderOf(const BuildOptions& options);

/// Builds. Blocks; uses options.threads threads. On error or cancellation nothing is left of the output, and nothing of
/// the temporary files, unless they hold work that resume can use: then the message says so. Errors: what the readers
/// report; InvalidInput (no triangle with area, nothing finite); Limit (cell too small for the mesh's extent, too many
/// pages, too little memory); Io (output not writable, disk full); Usage (the build to resume had other inputs or
/// options); Cancelled.
Result<BuildReport> buildOctree(const BuildOptions& options);

}  // namespace vcp
