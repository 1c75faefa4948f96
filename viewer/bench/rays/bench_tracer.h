// What the ray benchmark asks of a method: trace a picture, say how long it took and what each ray hit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/measure/mesh_bvh.h"
#include "builder/measure/ray_classes.h"
#include "octree/reference_caster.h"
#include "render/camera.h"
#include "streaming/page_source.h"
#include "viewer/bench/report/work_histogram.h"

namespace vcp {

/// One camera's picture by one method. Pixel (x, y) is ray y * width + x, through the pixel's centre.
struct TracedPicture {
    std::vector<std::optional<SurfaceHit>> hits;
    double seconds = 0;  ///< median of the repetitions
    RaysWork work;       ///< empty where the method does not count
};

class RayTracer {
public:
    virtual ~RayTracer() = default;
    [[nodiscard]] virtual std::string device() const = 0;
    [[nodiscard]] virtual std::string knob() const { return ""; }
    [[nodiscard]] virtual uint64_t bytes() const = 0;
    /// Traces `repetitions` times after a warm-up.
    virtual Result<TracedPicture> trace(const Camera& camera, glm::ivec2 size, int repetitions) = 0;
};

/// The reference ray-caster over the finest level, on `threads` threads, once, whatever the repetitions.
Result<std::unique_ptr<RayTracer>> makeReferenceTracer(const PageCache& cache, unsigned threads);

/// The renderer at `errorPixels`. The file is opened again. Errors: Device, what opening a dataset reports.
Result<std::unique_ptr<RayTracer>> makeCertifiedTracer(const std::filesystem::path& file, const std::string& device,
                                                       double errorPixels = 0.5);

/// The host's caster (render/host/host_caster.h) over the pages that the renderer would draw at `errorPixels`, with
/// normals. The file is opened again. Errors: what opening a dataset and reading pages report.
Result<std::unique_ptr<RayTracer>> makeHostTracer(const std::filesystem::path& file, unsigned threads,
                                                  double errorPixels = 0.5);

/// The renderer over a dataset of the method `paper` (viewer/bench/peers/paper_dataset.h). Errors: Device.
Result<std::unique_ptr<RayTracer>> makePaperGpuTracer(std::shared_ptr<const Dataset> dataset,
                                                      std::shared_ptr<const PageSource> source,
                                                      const std::string& device, const PaperMarch& march);

/// Embree over the mesh, relative to its box's middle, in floats. Errors: Usage where this build has no Embree.
Result<std::unique_ptr<RayTracer>> makeEmbreeTracer(const IndexedMesh& mesh, bool packets, unsigned threads);

/// Returns the seconds that Embree takes to build its tree. Errors: as above.
Result<double> timeEmbreeBuild(const IndexedMesh& mesh, unsigned threads);

}  // namespace vcp
