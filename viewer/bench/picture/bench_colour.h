// vcp bench colour: the surface's colours that are drawn, without light, against those of the textured mesh itself, 64
// samples a pixel, beside what they cost (docs/measuring.md). Cameras: `whole`, `half` and `close` of bench_cameras.h,
// and `dive`, its steps from `whole` to a cell of 200 pixels.
//
// Methods: `certified`, the renderer, with the pixel error as its knob; `vertex`, the mesh with a colour at each
// vertex; `texture`, the textured mesh with as many samples a pixel as `certified` has: the least that any picture of
// so many samples differs by.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/measure/quantile.h"
#include "octree/io/result.h"
#include "render/frame_request.h"

namespace vcp {

struct BenchColourOptions {
    /// Meshes, or .vcp files beside which the mesh of the same name lies; none: colour_models.h.
    std::vector<std::filesystem::path> models;
    std::vector<std::string> methods = {"certified", "vertex", "texture"};
    std::vector<std::string> cameras = {"whole", "half", "close"};
    std::vector<double> errorPixels = {0.5};                 ///< values of the knobs of `certified`
    std::vector<double> colourErrors = {kUsualColourError};  ///< with each of these
    int pictureSamples = 4;  ///< pictures have so many rays a pixel squared, and so has the mesh of the rivals
    glm::ivec2 size{960, 600};
    int diveSteps = 64;
    int views = 1;        ///< directions each camera looks from, spread over the sphere; a row counts them all
    int samples = 8;      ///< the mesh's picture has samples x samples rays a pixel
    int repetitions = 3;  ///< frames whose median processor time is reported
    unsigned threads = 0;
    std::string device;         ///< device of `certified`, as for --device; empty: the best
    std::filesystem::path out;  ///< .vcp files are kept here and used again; empty: a temporary folder
    double cell = 0;            ///< as for vcp build
    bool images = true;         ///< as for vcp build
    bool pictures = false;      ///< also writes the pictures into `out`
    /// Called from one thread at a time with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

/// What changes from one step of a dive to the next, as colour_difference.h has it, over the pixels within silhouettes,
/// all views together.
struct DiveChange {
    /// From the step's picture with what the steps before it had in memory to the one with all that it wants.
    double popMean = 0;
    Quantiles pop;
    double changeMean = 0;      ///< from the picture of the step before to this one
    double meshChangeMean = 0;  ///< the mesh's
};

/// One row of the table: field names are those of the JSON (docs/measuring.md).
struct BenchColourRow {
    std::string model, camera, method, knob, device;
    uint64_t pixels = 0;
    uint64_t comparedPixels = 0;  ///< pixels within the silhouettes of both pictures
    double cellPixels = 0;        ///< how wide a finest cell is in the middle of the first view
    double differenceMean = 0;    ///< colour_difference.h, over the pixels compared, all views together
    Quantiles difference;
    double flipMean = 0;                          ///< over the pixels compared
    double cpuMs = 0;                             ///< processor time of a frame, all threads, without loading
    uint64_t geometryBytes = 0;                   ///< stored in the .vcp; of the rivals, the mesh's file
    uint64_t colourBytes = 0;                     ///< stored in the .vcp; colours of vertices; or the files of images
    uint64_t bytesRead = 0;                       ///< stored bytes read until settled, from nothing
    uint64_t residentBytes = 0;                   ///< pages in the pool, or Embree's tree and buffers
    uint32_t coarsestLevel = 0, finestLevel = 0;  ///< levels of the pages that are drawn
    std::optional<DiveChange> dive;               ///< of `certified`; nothing at a dive's first step
};

struct BenchColourReport {
    std::vector<BenchColourRow> rows;
    std::vector<std::string> warnings;  ///< images that could not be read
};

/// The cameras and methods by name.
const std::vector<std::string>& colourCameraNames();
const std::vector<std::string>& colourMethodNames();

/// Runs the benchmark. Blocks. Errors: Usage (unknown method or camera, a model without colour, no Embree in this
/// build), what loadMesh, buildOctree and Renderer report, Cancelled.
Result<BenchColourReport> benchColour(const BenchColourOptions& options);

/// The report as one JSON object {"rows": [...], "warnings": [...]}, as CSV with a header line, and as Markdown.
std::string benchColourJson(const BenchColourReport& report);
std::string benchColourCsv(const BenchColourReport& report);
std::string benchColourMarkdown(const BenchColourReport& report);
/// Returns plots as SVG by file name without extension: for each model the mean difference against the stored bytes,
/// and against the processor time; a point is a camera.
std::vector<std::pair<std::string, std::string>> benchColourPlots(const BenchColourReport& report);

}  // namespace vcp
