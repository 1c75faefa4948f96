// Ray-casts a dataset with Vulkan: device, page pool, passes, pictures.
//
// The life of a frame, from outside:
//
//   auto renderer = Renderer::create(options);         // device, fixed pool of options.budgetBytes
//   renderer->open(dataset, source);                   // starts the loader threads
//   each time round:
//     update = renderer->update(request);              // never waits: takes in pages that have arrived,
//                                                      // chooses the cut, sends the loader its wishes
//     if (update.changed || request differs from the last one drawn)
//         renderer->render(request);                   // draws the cut of the last update
//     renderer->present(width, height);                // window only
//   renderer->readPicture();                           // what render() drew
//
// A picture without a window is settle(request), render(request), readPicture(). The same request and the
// same cut give the same bytes. One thread at a time may call a Renderer; several Renderers may exist.
//
// Several views of one dataset, such as the widgets of one program, share device, pool, budgets and loader:
// renderer->addView() is a Renderer with camera, pictures and window of its own. What all of them want is read once; a
// budget too small for all relaxes all together. Each is updated and drawn by itself; update() of one may change what
// another draws next, which that one's update() then says. One thread at a time may call any of them.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/dataset_reader.h"
#include "octree/result.h"
#include "render/frame_request.h"
#include "render/frame_result.h"
#include "render/picture.h"
#include "render/renderer_options.h"
#include "render/similarity.h"
#include "render/window_drawing.h"
#include "streaming/page_source.h"

namespace vcp {

/// A dataset and where it lies in the world.
struct PlacedDataset {
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;  ///< of this one alone
    Similarity placement;
    uint32_t loaderThreads = 2;  ///< that keep its source busy
};

struct MesoSurface;  // render/passes/meso_surface.h

class Renderer {
public:
    /// Errors: Device (no such device, no memory for the pool), Usage (options contradict each other).
    static Result<std::unique_ptr<Renderer>> create(const RendererOptions& options);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Another view, which shares all but the picture and the window; it may outlive this one. `surface` asks for a
    /// window: the options of create() must have had one too, or windowExtensions, or the host's device what it takes.
    /// Errors: Device.
    Result<std::unique_ptr<Renderer>> addView(const std::optional<SurfaceSource>& surface = {});

    [[nodiscard]] const DeviceInfo& device() const;
    [[nodiscard]] PageAccess access() const;

    /// Shows a dataset, in all views, in place of the one before. Its pages come from `source` in loader threads.
    Result<void> open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source);
    /// Shows several, each drawn by itself and the nearest surface seen; shadows and occlusion are within each. Budgets
    /// are shared out (budgetShares). `surfaces`: as setSurfaces. Errors: those of open of one and of setSurfaces; then
    /// nothing is shown.
    Result<void> open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces = {});
    /// Stops the loader and forgets all pages.
    void close();

    /// Surfaces with mesostructure, in all views, in place of those before: drawn over the datasets that are open, the
    /// nearer is seen at each pixel. They take light, shadows, normals, unlit colours and steps (their iterations, 0 to
    /// 100) from the request; what strays less than the request's errorPixels from its mean height is shown by its
    /// light from far; they and the datasets cast no shadow on each other, and no section plane cuts them. Kept, to be
    /// uploaded again to a device that is made anew. Without any, nothing is made for them. On an error there are none.
    /// Errors: Device, Limit.
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces);

    /// Other budgets than the options', from now on: what has no room goes at once, what is kept is not read again
    /// where `ramBytes` has room to carry it over. Waits for the copies. To be followed by update(). Errors: Usage;
    /// Limit, where the coarsest page has no room: the budgets stay as they were; Device: the dataset is closed.
    Result<void> setBudgets(uint64_t budgetBytes, uint64_t ramBytes);

    /// `gone` is called before a lost device is given up: what was made with windowDrawing() is destroyed then, and
    /// windowDrawing() asked again. Called by update() and render().
    void onDeviceLoss(std::function<void()> gone);

    /// See the top of this file. Where the device runs out of memory, here or in render(), the pool is halved; where
    /// the device was lost, all is made anew, once a call, and read again. Errors: Device. Problems of single pages are
    /// in the result.
    Result<UpdateResult> update(const FrameRequest& request);
    /// update() until settled, waiting for the loader between. Stops early with Cancelled where `cancel`
    /// returns true (asked several times a second).
    Result<UpdateResult> settle(const FrameRequest& request, const std::function<bool()>& cancel = {});

    /// Waits until the loader has read a page, has nothing to do, or the time is over: between updates, where a
    /// host has nothing else to do. Other calls never wait for reads.
    void waitForPage(std::chrono::milliseconds timeout);

    /// Draws the cut of the last update and waits for the GPU. Without a dataset: background.
    Result<FrameStats> render(const FrameRequest& request);

    /// Of the last render(). Errors: Usage, where nothing was drawn yet; Device.
    Result<Picture> readPicture();
    /// World units along the unit ray; infinity where no hit, not a number where the ray gave up.
    Result<std::vector<float>> readDepth();
    Result<std::vector<glm::vec3>> readNormals();  ///< unit, towards the viewer; 0 where no hit
    /// The number behind the false colour of each pixel: steps, cells or fetches of its ray. Precondition: the last
    /// render() was shaded so.
    Result<std::vector<uint32_t>> readWork();
    /// Iterations of each pixel's ray in mesostructure, in all pieces that it passed; all 0 without surfaces.
    Result<std::vector<uint32_t>> readIterations();
    /// One pixel of the last render(); nothing where the ray hit nothing or the pixel is outside.
    Result<std::optional<PixelHit>> pick(uint32_t x, uint32_t y);

    /// Copies the last picture into the host's image, scaled to it, sRGB-encoded; what was in the image is lost. Waits
    /// for the GPU. Errors: Usage, where nothing was drawn yet or the queue has no graphics; Device.
    Result<void> copyPicture(const ImageTarget& target);
    /// All pages in the pool; takes time for each.
    [[nodiscard]] std::vector<PageBox> residentPages() const;
    /// Whether frames keep what their feedback pass met for feedbackPicture(), from now on. Off, it costs nothing.
    void keepFeedback(bool keep);
    /// Nothing, where no frame missed pages since keepFeedback(true).
    [[nodiscard]] const std::optional<FeedbackPicture>& feedbackPicture() const;

    /// Shows the last picture in the window, scaled to it; makes the swapchain anew where the size of the
    /// window changed. `width` and `height`: of the framebuffer; 0 (minimized) shows nothing.
    /// `drawOver` (may be empty) draws over it. Precondition: options.surface. Errors: Device.
    Result<void> present(uint32_t width, uint32_t height, const DrawOver& drawOver = {});
    /// The same as long as the renderer. Precondition: options.surface. Errors: Device.
    Result<WindowDrawing> windowDrawing();

    /// Validation messages (warnings and errors) since create(); always empty without options.validation.
    [[nodiscard]] std::vector<std::string> validationMessages() const;

private:
    struct Shared;
    struct State;
    explicit Renderer(std::unique_ptr<State> state);
    Result<void> openDatasets(std::vector<PlacedDataset> datasets);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
