// vcp stress: a camera path through a dataset under budgets and faults, with every invariant of streaming checked
// (docs/streaming.md).
//
// Three passes: the first view until it has settled; the path, frame by frame, while pages load, until its last
// view has settled; the path again, each view settled before it is timed. The settled last picture must be that
// of a renderer of its own with the same budget and no faults. On request, orders of arrival are compared on that view,
// and several views fly along the path together.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "builder/measure/ray_classes.h"
#include "octree/io/result.h"
#include "render/view/renderer.h"
#include "streaming/faulty_reader.h"
#include "viewer/bench/stress/stress_orders.h"
#include "viewer/bench/stress/stress_views.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

struct StressOptions {
    std::string name;            ///< name of the dataset, for the report
    std::string path = "orbit";  ///< a name of stress_path.h, or a file of cameras
    Faults faults;
    uint64_t seed = 1;
    glm::ivec2 size{640, 400};
    int frames = 120;
    double errorPixels = 0.5;
    RendererOptions renderer;
    std::vector<LoadOrder> orders;  ///< compared on the path's last view; fewer than two: no comparison
    int views = 1;                  ///< more than one: so many share a pool
    double openSeconds = 0;         ///< what opening the dataset took: counted into the times below
    /// Called between frames; false cancels.
    std::function<bool(const std::string& what, double fraction)> progress;
};

/// One frame of the path.
struct StressSample {
    double seconds = 0;  ///< since the start
    double frameMs = 0;  ///< update and drawing
    double errorPixels = 0;
    uint64_t residentBytes = 0, pending = 0, loads = 0, evictions = 0;  ///< loads and evictions are those of this frame
    double missing = 0;  ///< share of the pages that the view wants and that are missing, 0 to 1
};

struct StressReport {
    std::string name, path, device, faults;
    uint64_t seed = 0;
    int frames = 0;
    double firstPictureSeconds = 0, detail90Seconds = 0, settledSeconds = 0;
    double pathSettledSeconds = 0;  ///< from the last frame of the path until its view had settled
    uint64_t bytesRead = 0;         ///< bytes of the file that were read until every view of the path had settled
    uint64_t bytesNeeded = 0;       ///< stored bytes of the pages in these settled views, each once
    uint64_t requests = 0;          ///< reads of the source
    uint64_t failures = 0, pagesGivenUp = 0;
    uint64_t budgetBytes = 0, residentBytesMax = 0, ramBytes = 0, heldBytesMax = 0;
    uint64_t loads = 0, evictions = 0;
    bool relaxed = false;
    double errorPixels = 0;  ///< error of the settled last view
    Quantiles frameMs, frameMsNoLoads;
    std::vector<StressSample> samples;
    std::vector<OrderCurve> orders;
    std::optional<StressViews> views;
    std::vector<std::string> violations;  ///< invariants that were broken; must be empty
};

/// Runs the stress test. Blocks. Errors: those of Renderer, of a camera file, Cancelled. Violations are no errors.
Result<StressReport> runStress(const OpenDataset& open, const StressOptions& options);

/// Return the fields of the JSON (docs/streaming.md), one page of Markdown, and plots over time by file name.
std::string stressJson(const StressReport& report);
std::string stressMarkdown(const StressReport& report);
std::vector<std::pair<std::string, std::string>> stressPlots(const StressReport& report);

}  // namespace vcp
