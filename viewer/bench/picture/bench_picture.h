// vcp bench picture: what is drawn against a picture of the mesh itself, 64 samples a pixel, beside what it costs
// (docs/measuring.md). Cameras: `whole`, `half` and `close` of bench_cameras.h, and `dive`: steps from `whole` to where
// a finest cell is kDiveCellPixels wide (bench_cameras.h); its steps are rows of their own, dive-1 to dive-N.
//
// Methods: `certified`, the renderer, with the pixel error as its knob; `embree`, one ray a pixel through the mesh: the
// least that a picture of one sample a pixel differs by.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/measure/quantile.h"
#include "octree/io/result.h"

namespace vcp {

struct BenchPictureOptions {
    /// Meshes, or .vcp files beside which the mesh of the same name lies; none: viewer/bench/rays/analytic_models.h.
    std::vector<std::filesystem::path> models;
    std::vector<std::string> methods = {"certified", "embree"};
    std::vector<std::string> cameras = {"whole", "half", "close", "dive"};
    std::vector<double> errorPixels = {0.5};  ///< values of the knob of `certified`
    uint32_t pictureSamples = 1;              ///< of a pixel of `certified`: its cost is that of all of them
    glm::ivec2 size{960, 600};
    int diveSteps = 5;
    int views = 1;        ///< directions each camera looks from, spread over the sphere; a row counts them all
    int samples = 8;      ///< the mesh's picture has samples x samples rays a pixel
    int repetitions = 3;  ///< frames whose median processor time is reported
    unsigned threads = 0;
    std::string device;         ///< device of `certified`, as for --device; empty: the best
    std::filesystem::path out;  ///< .vcp files are kept here and used again; empty: a temporary folder
    double cell = 0;            ///< as for vcp build
    bool pictures = false;      ///< also writes the pictures into `out`; isolated pixels are marked in red
    /// Called from one thread at a time with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

/// One row of the table: field names are those of the JSON (docs/measuring.md).
struct BenchPictureRow {
    std::string model, camera, method, knob, device;
    uint64_t pixels = 0, hitPixels = 0;
    double cellPixels = 0;  ///< how wide a finest cell is at the point looked at
    double rmse = 0;        ///< of light, 0 to 1
    double flipMean = 0, flipP99 = 0;
    uint64_t isolatedPixels = 0;
    uint64_t isolatedInMesh = 0;    ///< of the mesh's own picture
    uint64_t silhouettePixels = 0;  ///< covered in one picture and not in the other
    Quantiles silhouetteDistance;   ///< pixels
    Quantiles normalDegrees;        ///< against the mesh's shading normals, averaged over the pixel
    double cpuMs = 0;               ///< processor time of a frame, all threads, without loading
    uint64_t bytesRead = 0;         ///< stored bytes read until settled, from nothing; in a dive, from its beginning
    uint64_t residentBytes = 0;     ///< pages in the pool, or Embree's tree and buffers
    uint32_t coarsestLevel = 0, finestLevel = 0;  ///< levels of the pages that are drawn
};

struct BenchPictureReport {
    std::vector<BenchPictureRow> rows;
};

/// The cameras and methods by name.
const std::vector<std::string>& pictureCameraNames();
const std::vector<std::string>& pictureMethodNames();

/// Runs the benchmark. Blocks. Errors: Usage (unknown method or camera, no Embree in this build), what loadMesh,
/// buildOctree and Renderer report, Cancelled.
Result<BenchPictureReport> benchPicture(const BenchPictureOptions& options);

/// The report as one JSON object {"rows": [...]}, as CSV with a header line, and as Markdown.
std::string benchPictureJson(const BenchPictureReport& report);
std::string benchPictureCsv(const BenchPictureReport& report);
std::string benchPictureMarkdown(const BenchPictureReport& report);
/// Returns plots as SVG by file name without extension: for each model FLIP and light error against processor time and
/// resident bytes; a point is a camera.
std::vector<std::pair<std::string, std::string>> benchPicturePlots(const BenchPictureReport& report);

}  // namespace vcp
