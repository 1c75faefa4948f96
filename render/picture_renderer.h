// What draws pictures of datasets without a window: a Vulkan device (Renderer, renderer.h) or the processor alone
// (HostRenderer, host_renderer.h). Whoever only wants pictures knows no more than this.
//
// A picture is drawSettled(request), readPicture(), with refine() between them where edges are to be smooth. The same
// request and the same cut give the same bytes.
// One thread at a time may call a renderer.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/dataset_reader.h"
#include "octree/io/result.h"
#include "render/frame_request.h"
#include "render/frame_result.h"
#include "render/picture.h"
#include "render/renderer_options.h"
#include "render/similarity.h"
#include "streaming/page_source.h"

namespace vcp {

/// A dataset and where it lies in the world.
struct PlacedDataset {
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;  ///< source of this dataset only
    Similarity placement;
    uint32_t loaderThreads = 2;  ///< threads that keep its source busy
};

/// A picture of which nothing is missing.
struct SettledFrame {
    UpdateResult update;  ///< with all problems since it began to settle
    FrameStats stats;
};

struct MesoSurface;  // render/meso_surface.h

class PictureRenderer {
public:
    virtual ~PictureRenderer() = default;

    [[nodiscard]] virtual const DeviceInfo& device() const = 0;

    /// Shows datasets, and surfaces with mesostructure, in place of those before. Errors: Device, Limit; Unsupported,
    /// where this renderer cannot draw them. After an error nothing is shown.
    virtual Result<void> open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces) = 0;
    /// Shows other surfaces beside the same datasets. Errors: as of open().
    virtual Result<void> setSurfaces(std::span<const MesoSurface> surfaces) = 0;

    /// Takes in pages that have arrived, chooses the cut, and sends the loader its wishes; never waits for reads.
    /// Errors: Usage, where the request makes no picture; Unsupported; Device.
    virtual Result<UpdateResult> update(const FrameRequest& request) = 0;
    /// Waits until a page was read, there is nothing to read, or the time is over.
    virtual void waitForPage(std::chrono::milliseconds timeout) = 0;
    /// Calls update() until settled; in between waits for the loader, and draws where rays are to say what they hit.
    /// Stops early with Cancelled where `cancel` returns true (it is called several times a second).
    Result<UpdateResult> settle(const FrameRequest& request, const std::function<bool()>& cancel = {});
    /// Does the same, and draws what was settled on, unless that was drawn to find out. Errors: as of render().
    Result<SettledFrame> drawSettled(const FrameRequest& request, const std::function<bool()>& cancel = {});

    /// Draws the cut of the last update and waits for it; without a dataset, the background. `cancel` may be called by
    /// several threads: where it returns true, the processor stops with Cancelled; a device draws its frame to the end.
    virtual Result<FrameStats> render(const FrameRequest& request, const std::function<bool()>& cancel = {}) = 0;

    /// Adds one more sample (pixel_samples.h) to the last picture, which then shows the mean light of its samples;
    /// depth, normals, iterations and statistics stay those of render(). Returns how many samples the picture has; 0
    /// where it cannot go on, because pages or the device have changed since, or nothing was drawn: render() begins
    /// anew. `cancel` as in render(); after Cancelled it may be called again. Errors: Usage, where the picture has all
    /// its samples (samplesOf), or its request names a sample itself; Limit, where the picture is too large; Device.
    virtual Result<uint32_t> refine(const std::function<bool()>& cancel = {}) = 0;
    /// Calls refine() until the last picture, of `request`, has samplesOf(request, samples); where that begins anew,
    /// settles and renders before. `progress`, where there is one, is told how many there are. Errors: those of
    /// settle(), render() and refine().
    Result<void> refineTo(uint32_t samples, const FrameRequest& request, const std::function<bool()>& cancel = {},
                          const std::function<void(uint32_t samples)>& progress = {});

    /// Returns the last picture. Errors: Usage, where nothing was drawn yet; Device.
    virtual Result<Picture> readPicture() = 0;
    /// Distances in world units along the unit ray; infinity where nothing is hit, not a number where the ray gave up.
    virtual Result<std::vector<float>> readDepth() = 0;
    virtual Result<std::vector<glm::vec3>> readNormals() = 0;  ///< unit, towards the viewer; 0 where no hit
    /// Returns the number behind the false colour of each pixel: steps, cells or fetches of its ray through all
    /// datasets. Errors: Usage, where the last picture does not show work.
    virtual Result<std::vector<uint32_t>> readWork() = 0;
    /// Returns each pixel's iterations in mesostructure, over all pieces that its ray passed; all 0 without surfaces.
    virtual Result<std::vector<uint32_t>> readIterations() = 0;

    /// Returns validation messages (warnings and errors) so far; always empty without options.validation.
    [[nodiscard]] virtual std::vector<std::string> validationMessages() const = 0;
};

/// What readWork() reports where the last picture does not show work.
inline const Error kNoWorkShown{.code = ErrorCode::Usage, .message = "the last picture does not show work"};

/// Makes the renderer that the options name: the host's for kHostName, and where nothing is named and there is no
/// Vulkan device; else one of Vulkan. Errors: as of Renderer::create and HostRenderer::create.
Result<std::unique_ptr<PictureRenderer>> createPictureRenderer(const RendererOptions& options);

}  // namespace vcp
