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

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <vulkan/vulkan_core.h>
#include <glm/vec3.hpp>

#include "octree/dataset_reader.h"
#include "octree/paper_page.h"
#include "octree/result.h"
#include "render/camera.h"
#include "render/picture.h"
#include "render/similarity.h"
#include "streaming/load_order.h"
#include "streaming/page_source.h"

namespace vcp {

/// A Vulkan device as `vcp devices` shows it.
struct DeviceInfo {
    uint32_t index = 0;  ///< in the order of the Vulkan loader
    std::string name;
    std::string type;    ///< "discrete", "integrated", "virtual", "cpu", "other"
    std::string driver;  ///< name and version
    bool software = false;
    bool usable = false;  ///< Vulkan 1.2 with a compute queue
    bool chosen = false;  ///< what an empty or the given choice selects
};

/// Devices of this machine; `choice` as in RendererOptions::device marks the chosen one.
/// Errors: Device, where Vulkan cannot be loaded or there is no device, or where `choice` names none.
Result<std::vector<DeviceInfo>> listDevices(const std::string& choice = {});

/// How shaders read pages: Auto takes texel buffers on software devices, storage buffers elsewhere.
enum class PageAccess { Auto, TexelBuffer, StorageBuffer };

/// What a window gives: the instance extensions it needs and a function that makes the surface
/// (glfwGetRequiredInstanceExtensions, glfwCreateWindowSurface).
struct SurfaceSource {
    std::vector<std::string> instanceExtensions;
    std::function<VkResult(VkInstance, VkSurfaceKHR*)> createSurface;
};

/// A device that the host made and keeps. Vulkan 1.2; no feature is needed. Where views have windows: the extension
/// VK_KHR_swapchain, and a queue with graphics that can show pictures in them.
struct HostDevice {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;  ///< used by calls of the renderer, in the thread that calls, and at no other time
    uint32_t queueFamily = 0;        ///< computes
};

/// What goes wrong, or is lacking, on purpose: for tests.
struct DeviceFaults {
    bool separateMemory = false;        ///< the CPU does not see the device's memory, as on a discrete GPU
    bool separateCopies = false;        ///< copies are submitted beside other work, as to a queue of their own
    uint64_t memoryBytes = UINT64_MAX;  ///< more the device has not
    uint64_t lostAtSubmission = 0;      ///< the device is lost at this submission of work, once; 0: never
};

/// What draws over the picture in the window (a user interface) needs to make its pipelines.
struct WindowDrawing {
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;  ///< idle between calls of the renderer
    uint32_t queueFamily;
    VkRenderPass renderPass;  ///< one colour attachment, one sample, the picture in it
};
/// Records draws of an image of the window, inside of WindowDrawing::renderPass.
using DrawOver = std::function<void(VkCommandBuffer commands, VkExtent2D size)>;

struct RendererOptions {
    std::string device;                   ///< index, or part of the name in any case; empty: the best one
    uint64_t budgetBytes = 512ull << 20;  ///< of the page pool, never exceeded; at least 1 MiB
    bool colour = true;                   ///< false: colour pages are neither read nor allocated
    bool validation = false;              ///< validation layers, core and synchronization; see validationMessages
    PageAccess access = PageAccess::Auto;
    uint32_t loaderThreads = 0;  ///< shared out among the datasets, one each at least; 0: what their sources need
    uint64_t ramBytes =
        256ull << 20;  ///< of pages on their way to the pool, and of stored ones kept to be read again; never exceeded
    LoadOrder order = LoadOrder::Feedback;  ///< of pages; others are for comparison
    uint64_t uploadBytes = 16ull << 20;     ///< taken into the pool by one update (one page at least)
    DeviceFaults faults;
    std::optional<SurfaceSource> surface;  ///< absent: no surface extension is asked for
    /// Instance extensions for windows of views that are added later; the queue then has graphics.
    std::vector<std::string> windowExtensions;
    /// In place of a device of our own: `device`, `validation`, `surface` and `windowExtensions` are not looked at
    /// then. When it is lost it is not made anew: Errors from then on.
    std::optional<HostDevice> host;
};

enum class ShadingMode {
    Lit,      ///< vertex colours where there are any, else clay; light and hemisphere
    Clay,     ///< one colour, with light
    Unlit,    ///< vertex colours where there are any, else clay, as they are
    Normals,  ///< normal as colour
    // False colours, blue through green to red (Demir and Westermann 2015, Figures 8 and 9).
    Steps,    ///< node visits of the ray, 0 to 64 (compiles the counting variant on first use)
    Cells,    ///< leaves that the ray was intersected with, 0 to 16 (the same)
    Fetches,  ///< 16-byte reads of the ray, 0 to 128 (the same)
    Level,    ///< level of the page that was hit, coarsest to finest
    Error,    ///< certified error of the page that was hit, 0 to 1 pixel
};

/// Cuts away what lies on the plane's far side: kept is where dot(normal, x) >= offset, world units.
struct SectionPlane {
    glm::dvec3 normal{1, 0, 0};  ///< of any length but 0
    double offset = 0;

    bool operator==(const SectionPlane&) const = default;
};
/// At most so many planes at once (kMaxSections in frame_layout.h).
constexpr size_t kMostSections = 6;

struct Shading {
    ShadingMode mode = ShadingMode::Lit;
    bool lightFollowsCamera = true;
    glm::vec3 lightDirection{-0.35f, 0.55f, 0.75f};  ///< towards the light: in camera axes (right, up, back)
                                                     ///< where it follows the camera, else in world axes
    glm::vec3 clay{0.80f, 0.76f, 0.70f};             ///< linear
    glm::vec3 cap{0.62f, 0.23f, 0.16f};              ///< linear; of cut solids
    bool shadows = false;                            ///< hard shadows: a further ray a pixel
    uint32_t occlusionRays = 0;  ///< ambient occlusion: so many further rays a pixel, at most 64; 0: off
    double occlusionRadius = 0;  ///< how far they look, world units; 0: a tenth of the box's diagonal
    glm::vec3 backgroundTop{0.10f, 0.12f, 0.15f};  ///< linear
    glm::vec3 backgroundBottom{0.25f, 0.27f, 0.30f};
    bool transparent = false;  ///< background is black with alpha 0

    bool operator==(const Shading&) const = default;
};

/// Where a picture lies in a larger one: its upper left pixel, and the size of the whole.
struct PictureTile {
    uint32_t x = 0, y = 0;
    uint32_t fullWidth = 1, fullHeight = 1;  ///< 1 to 2^20 each

    bool operator==(const PictureTile&) const = default;
};

/// All that a picture depends on, beside the pages. Datasets of the method `paper` (octree/paper_page.h) are drawn by
/// their own march, from their one page; they have no beam pass, no shadows, no ambient occlusion and no caps: what a
/// request asks of these is left out.
struct FrameRequest {
    Camera camera;                        ///< of the whole, where the picture is a tile
    uint32_t width = 1280, height = 720;  ///< 1 to 16384 each
    std::optional<PictureTile> tile;      ///< absent: the picture is the whole
    double errorPixels = 0.5;             ///< a page is refined where its certified error projects to more
    Shading shading;
    std::vector<SectionPlane> sections;  ///< at most kMostSections
    bool sectionCaps = false;            ///< fills what the planes cut open; right for closed surfaces
    bool beam = true;                    ///< beam pass; the picture is the same without it, only later
    bool countSteps = false;             ///< fills FrameStats::steps and fetches (a slower variant)
    PaperMarch march;                    ///< of datasets of the method `paper`

    bool operator==(const FrameRequest&) const = default;
};

struct UpdateResult {
    bool changed = false;        ///< the cut differs from that of the update before
    bool settled = false;        ///< nothing that this view wants is missing, loading or queued
    bool drawable = false;       ///< at least the coarsest page is there
    double errorPixels = 0;      ///< largest projected certified error in the cut (inf without a page or certificate)
    uint64_t residentBytes = 0;  ///< geometry and colour pages in the pool
    uint64_t bytesRead = 0;      ///< decompressed page bytes the loader has delivered since open()
    bool relaxed = false;        ///< the budget is too small for the view's pixel error; errorPixels says what it has
    uint64_t heldBytesMax =
        0;  ///< most memory that pages took between source and pool, and stored ones kept, since open() or setBudgets()
    uint64_t loads = 0, evictions = 0;  ///< pages into and out of the pool since open()
    uint64_t reloads = 0;               ///< pages loaded twice in one still view: always 0
    uint32_t deviceLosses = 0;          ///< since create(): each time all was made anew and pages are read again
    uint64_t failures = 0;              ///< reads that failed and were, or will be, tried again
    uint32_t pagesResident = 0, pagesInCut = 0, pagesWanted = 0;
    uint32_t pagesMissing = 0;                    ///< wanted, not resident
    uint32_t pagesPending = 0;                    ///< wished for, being read, or waiting for an update
    uint32_t coarsestLevel = 0, finestLevel = 0;  ///< of the pages in the cut
    std::vector<Error> problems;                  ///< pages that cannot be read; each is reported once
};

struct FrameStats {
    uint64_t rays = 0;        ///< pixels
    uint64_t tracedRays = 0;  ///< pixels of tiles that the beam pass could not prove empty
    uint64_t hitPixels = 0;   ///< that any dataset or surface is hit in
    double msBeam = 0, msTrace = 0, msLight = 0, msShade = 0,
           msFeedback = 0;            ///< GPU timestamps; 0 where the device has none
    double msFrame = 0;               ///< from submission to completion, wall clock
    uint64_t steps = 0, fetches = 0;  ///< node visits and 16-byte reads of all rays; with countSteps only
    uint64_t poolBytes = 0;           ///< allocated for the pool
    uint64_t colourBytes = 0;         ///< of colour, in the pool
    uint32_t pagesInCut = 0;
    uint32_t pipelines = 0;  ///< made since create()
    double msSurfaces = 0;   ///< of surfaces with mesostructure; GPU timestamps
    uint64_t unresolvedRays =
        0;  ///< rays, of shadows too, that used up their iterations in mesostructure or went through too many pieces
    uint64_t farHits = 0;       ///< of pixels and surfaces, shown by what they are from far and not marched
    uint64_t surfaceBytes = 0;  ///< of mesostructure on the device, beside the pool: assets and shells
    uint64_t submissions = 0, hostWaits = 0;  ///< to the device by this frame, and how often the CPU waited for one
    uint64_t feedbackPasses = 0;  ///< frames since create() that asked rays what to read: none where nothing is missing
};

/// An image of the host's on the renderer's device: colour, not multisampled, a format of the kind UNORM, usage
/// TRANSFER_DST.
struct ImageTarget {
    VkImage image = VK_NULL_HANDLE;
    uint32_t width = 0, height = 0;
    VkImageLayout layoutAfter = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    VkSemaphore wait = VK_NULL_HANDLE;    ///< where given: the image is written after it is signalled
    VkSemaphore signal = VK_NULL_HANDLE;  ///< where given: signalled when the image is written
};

/// A dataset and where it lies in the world.
struct PlacedDataset {
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;  ///< of this one alone
    Similarity placement;
    uint32_t loaderThreads = 2;  ///< that keep its source busy
};

/// A page in the pool, for a picture of what is there.
struct PageBox {
    glm::dvec3 corner;                ///< world
    std::array<glm::dvec3, 3> edges;  ///< from the corner, world
    uint32_t level = 0;               ///< 0: the coarsest
    bool isDrawn = false;             ///< in the cut of this view
};

/// What the rays of the last frame that missed pages met, 24 x 16 over the picture, row by row from the upper left.
struct FeedbackPicture {
    static constexpr uint32_t kWidth = 24, kHeight = 16;
    /// Of the page that was hit, its certified error in pixels there, of several datasets' the largest; below 0:
    /// nothing was hit. Above the request's errorPixels the ray asked for finer pages.
    std::array<float, size_t{kWidth} * kHeight> errorPixels;
};

/// What one pixel shows.
struct PixelHit {
    double depth;            ///< distance from the ray's origin, world units
    glm::dvec3 position;     ///< world space
    glm::vec3 normal;        ///< unit, towards the viewer
    size_t dataset = 0;      ///< number of the dataset, in the order of open()
    bool onCap = false;      ///< on what a section plane cut open
    bool onSurface = false;  ///< on mesostructure; then `dataset` means nothing
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
