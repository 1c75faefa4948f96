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
// A picture that stays gets smooth edges, sample by sample, with refine() or refineAhead().
//
// A window draws with renderAhead() in place of render(): then the CPU goes on while up to kFramesAhead frames are in
// flight. What such a frame counted, what its rays asked for and what is under the cursor come back with its own
// commands, and are taken in by the first update() or renderAhead() after its end: lastDone() is a frame or two behind
// the last picture. All else that reads a picture waits for it.
//
// A picture without a window is settle(request), render(request), readPicture(). The same request and the
// same cut give the same bytes. One thread at a time may call a Renderer; several Renderers may exist.
//
// Several views of one dataset, such as the widgets of one program, share device, pool, budgets and loader:
// renderer->addView() is a Renderer with camera, pictures and window of its own. What any of them wants is read once; a
// budget too small for all relaxes all together. Each is updated and drawn by itself; update() of one may change what
// another draws next, which update() of that one then reports. One thread at a time may call any of them.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/picture_renderer.h"
#include "render/window_drawing.h"

namespace vcp {

/// The most frames of a view that are in flight at once.
constexpr size_t kFramesAhead = 2;

class Renderer final : public PictureRenderer {
public:
    /// Makes all anew. Errors: Device (no such device, no memory for the pool), Usage (options contradict each other).
    static Result<std::unique_ptr<Renderer>> create(const RendererOptions& options);
    ~Renderer() override;
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Makes another view, which shares all but the picture and the window; it may outlive this one. `surface` asks for
    /// a window: then the options of create() must have had one too, or windowExtensions, or the host's device must
    /// meet what windows need. Errors: Device.
    Result<std::unique_ptr<Renderer>> addView(const std::optional<SurfaceSource>& surface = {});

    [[nodiscard]] const DeviceInfo& device() const override;
    [[nodiscard]] PageAccess access() const;

    /// Shows a dataset, in all views, in place of the one before. Its pages come from `source` in loader threads.
    Result<void> open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source);
    /// Shows several datasets, each drawn by itself, and the nearest surface is seen; they shade each other. They share
    /// the budgets, which go to what is seen, whichever dataset it is of. `surfaces`: as in setSurfaces. Errors: those
    /// of open for one dataset and of setSurfaces; then nothing is shown.
    Result<void> open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces = {}) override;
    /// Stops the loader and forgets all pages.
    void close();

    /// Shows surfaces with mesostructure, in all views, in place of those before. They are drawn over the open
    /// datasets; the nearer surface is seen at each pixel. They take light, shadows, normals, unlit colours and steps
    /// (their iterations, 0 to 100) from the request; a surface that strays less than the request's errorPixels from
    /// its mean height is shown by its light from far. Section planes cut them; they and the datasets shade each
    /// other. Their bytes are taken from the pool's budget. The renderer keeps them to upload to a
    /// device that is made anew. Without any, nothing is made for them. After an error there are none. Errors: Device,
    /// Limit.
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces) override;
    /// Returns them, until others are set.
    [[nodiscard]] std::span<const MesoSurface> surfaces() const;

    /// Sets other budgets than the options', from now on: pages without room go at once, and kept pages are not read
    /// again where `ramBytes` has room to carry them over. Waits for the copies. update() must follow. Errors: Usage;
    /// Limit, where the coarsest page has no room: the budgets stay as they were; Device: the dataset is closed.
    Result<void> setBudgets(uint64_t budgetBytes, uint64_t ramBytes);

    /// `gone` is called by update() and render() before a lost device is given up. What was made with windowDrawing()
    /// must be destroyed then, and windowDrawing() called again.
    void onDeviceLoss(std::function<void()> gone);

    /// Takes in pages and chooses the cut; see the top of this file. Where the device runs out of memory, here or in
    /// render(), the pool is halved; where the device was lost, all is made anew, at most once a call, and read again.
    /// Errors: Device. The result lists problems of single pages.
    Result<UpdateResult> update(const FrameRequest& request) override;
    /// Waits until the loader has read a page, has nothing to do, or the time is over. A host calls it between updates
    /// when it has nothing else to do. Other calls never wait for reads.
    void waitForPage(std::chrono::milliseconds timeout) override;

    /// Does ahead what takes long in drawing remeshed surfaces: chooses their cells for a picture. `shareOut`: as in
    /// meso::RemeshOptions; where it cancels, nothing is lost, and the next call for the same picture goes on there.
    /// Errors: Cancelled.
    Result<void> chooseCells(
        const FrameRequest& request,
        const std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill)>& shareOut);

    /// Draws the cut of the last update and waits for the GPU. Without a dataset it draws the background.
    Result<FrameStats> render(const FrameRequest& request, const std::function<bool()>& cancel = {}) override;

    /// Draws as render() does, but returns when the frame is handed to the GPU. Waits only where kFramesAhead frames
    /// are in flight, for the older one. `cursor`: a pixel of the picture whose hit comes back with the frame. Errors:
    /// those of render(), also of frames before.
    Result<void> renderAhead(const FrameRequest& request, const std::optional<PicturePixel>& cursor = {});
    /// On a software device, renderAhead() only begins a frame that would take it longer than about a second: it is
    /// drawn step by step, of less than a tenth of a second each, between which the device can present. Whether there
    /// is one, and how much of it is drawn, 0 to 1.
    [[nodiscard]] bool isUnfinished() const;
    [[nodiscard]] double finishedPart() const;
    /// Hands the next step to the device, unless one is in flight. Returns whether that was the last one: until then
    /// the picture before is the last picture. Where pages have come or gone meanwhile, the frame is forgotten, as by
    /// the next render() or renderAhead(). Errors: those of renderAhead().
    Result<bool> continueFrame();
    /// Adds a part of the next sample (picture_parts.h) to the last picture, and returns when it is handed to the GPU.
    /// Waits only where a part is in flight, for that. Returns how many whole samples the picture then has, and 0 as
    /// refine() does. Errors: those of refine().
    Result<uint32_t> refineAhead();
    /// Whether another frame should wait: on a software device as long as one is in flight, because it has the
    /// processors and the next one would only be older when it is shown; elsewhere while kFramesAhead are.
    [[nodiscard]] bool isBusy();
    /// Whether a frame of renderAhead() has not been taken in yet.
    [[nodiscard]] bool isDrawing() const;
    /// Waits until not isBusy(). A window calls it before it looks for input, so that a frame shows the newest.
    Result<void> waitForFrame();
    /// Returns the newest frame of this view that has ended and was taken in; nothing before the first, and after
    /// open() and close().
    [[nodiscard]] const std::optional<DoneFrame>& lastDone() const;

    Result<uint32_t> refine(const std::function<bool()>& cancel = {}) override;

    /// Lets `paint` paint over each picture of this view as it leaves the renderer (readPicture, copyPicture, present),
    /// from now on; empty: nothing does. The picture then goes through the CPU, which waits for the device.
    void paintOver(PaintOver paint);
    Result<Picture> readPicture() override;
    Result<std::vector<float>> readDepth() override;
    Result<std::vector<glm::vec3>> readNormals() override;
    Result<std::vector<uint32_t>> readWork() override;
    Result<std::vector<uint32_t>> readIterations() override;
    /// Returns what one pixel of the last render() shows; nothing where the ray hit nothing or the pixel is outside.
    Result<std::optional<PixelHit>> pick(uint32_t x, uint32_t y);
    /// Returns what the picture shows at a pixel of a window of that size. At the cursor of lastDone() that frame is
    /// meant, and nothing is waited for; elsewhere the last one, which is waited for.
    Result<std::optional<PixelHit>> pickAt(glm::dvec2 pixel, glm::dvec2 size);

    /// Copies the last picture into the host's image, scaled to it, sRGB-encoded; what was in the image is lost. Waits
    /// for the GPU. Errors: Usage, where nothing was drawn yet or the queue has no graphics; Device.
    Result<void> copyPicture(const ImageTarget& target);
    /// Returns all pages in the pool; takes time for each.
    [[nodiscard]] std::vector<PageBox> residentPages() const;
    /// Says whether frames keep what their feedback pass met for feedbackPicture(); switched off, it costs nothing.
    void keepFeedback(bool keep);
    /// Returns the kept feedback; nothing where no frame missed pages since keepFeedback(true).
    [[nodiscard]] const std::optional<FeedbackPicture>& feedbackPicture() const;

    /// Shows the last picture in the window, scaled to it; makes the swapchain anew where the size of the
    /// window changed. `width` and `height`: of the framebuffer; 0 (minimized) shows nothing.
    /// `drawOver` (may be empty) draws over it. Does not wait for what renderAhead() drew. Precondition:
    /// options.surface. Errors: Device.
    Result<void> present(uint32_t width, uint32_t height, const DrawOver& drawOver = {});
    /// Returns the same as long as the renderer lives. Precondition: options.surface. Errors: Device.
    Result<WindowDrawing> windowDrawing();

    [[nodiscard]] std::vector<std::string> validationMessages() const override;

private:
    struct Shared;
    struct View;
    explicit Renderer(std::unique_ptr<View> view);
    std::unique_ptr<View> view_;
};

}  // namespace vcp
