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
// renderer->addView() is a Renderer with camera, pictures and window of its own. What any of them wants is read once; a
// budget too small for all relaxes all together. Each is updated and drawn by itself; update() of one may change what
// another draws next, which update() of that one then reports. One thread at a time may call any of them.
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

#include "octree/paper_page.h"
#include "octree/result.h"
#include "octree/vcp_file.h"
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
    bool chosen = false;  ///< the device that the given choice, or an empty one, selects
};

/// Lists the devices of this machine; `choice`, as in RendererOptions::device, marks the chosen one.
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

/// A device that the host made and keeps. It needs Vulkan 1.2 and no feature. Where views have windows, it also needs
/// the extension VK_KHR_swapchain, and a queue with graphics that can show pictures in them.
struct HostDevice {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;  ///< calls of the renderer use it, in the calling thread, and at no other time
    uint32_t queueFamily = 0;        ///< the queue's family, which can compute
};

/// What goes wrong, or is lacking, on purpose: for tests.
struct DeviceFaults {
    bool separateMemory = false;        ///< the CPU does not see the device's memory, as on a discrete GPU
    bool separateCopies = false;        ///< copies are submitted beside other work, as to a queue of their own
    uint64_t memoryBytes = UINT64_MAX;  ///< the device has no more memory than this
    uint64_t lostAtSubmission = 0;      ///< the device is lost at this submission of work, once; 0: never
};

/// What a user interface needs to make pipelines that draw over the picture in the window.
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
    uint64_t budgetBytes = 512ull << 20;  ///< bytes of the page pool, never exceeded; at least 1 MiB
    bool colour = true;                   ///< false: colour pages are neither read nor allocated
    bool validation = false;              ///< validation layers, core and synchronization; see validationMessages
    PageAccess access = PageAccess::Auto;
    uint32_t loaderThreads = 0;  ///< threads for all datasets, at least one each; 0: as many as their sources need
    uint64_t ramBytes =
        256ull << 20;  ///< most bytes of pages on their way to the pool, and of stored ones kept to be read again
    LoadOrder order = LoadOrder::Feedback;  ///< order in which pages are read; others than Feedback are for comparison
    uint64_t uploadBytes = 16ull << 20;     ///< bytes that one update takes into the pool (one page at least)
    DeviceFaults faults;
    std::optional<SurfaceSource> surface;  ///< absent: no surface extension is asked for
    /// Instance extensions for windows of views that are added later; the queue then has graphics.
    std::vector<std::string> windowExtensions;
    /// The host's device in place of one of our own: `device`, `validation`, `surface` and `windowExtensions` are then
    /// ignored. A lost device of the host's is not made anew: calls return errors from then on.
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

/// Cuts away what lies on the plane's far side: what has dot(normal, x) >= offset (world units) is kept.
struct SectionPlane {
    glm::dvec3 normal{1, 0, 0};  ///< any length but 0
    double offset = 0;

    bool operator==(const SectionPlane&) const = default;
};
/// A request has at most so many planes (kMaxSections in frame_layout.h).
constexpr size_t kMostSections = 6;

struct Shading {
    ShadingMode mode = ShadingMode::Lit;
    bool lightFollowsCamera = true;
    glm::vec3 lightDirection{-0.35f, 0.55f, 0.75f};  ///< towards the light: in camera axes (right, up, back)
                                                     ///< where it follows the camera, else in world axes
    glm::vec3 clay{0.80f, 0.76f, 0.70f};             ///< linear
    glm::vec3 cap{0.62f, 0.23f, 0.16f};              ///< linear; colour of cut solids
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
/// their own march, from their one page. They have no beam pass, no shadows, no ambient occlusion and no caps: where a
/// request asks for these, they are left out.
struct FrameRequest {
    Camera camera;                        ///< camera of the whole picture, where this one is a tile
    uint32_t width = 1280, height = 720;  ///< 1 to 16384 each
    std::optional<PictureTile> tile;      ///< absent: the picture is the whole
    double errorPixels = 0.5;             ///< a page is refined where its certified error projects to more
    Shading shading;
    std::vector<SectionPlane> sections;  ///< at most kMostSections
    bool sectionCaps = false;            ///< fills what the planes cut open; right for closed surfaces
    bool beam = true;                    ///< beam pass; the picture is the same without it, only slower
    bool countSteps = false;             ///< fills FrameStats::steps and fetches (a slower variant)
    PaperMarch march;                    ///< march through datasets of the method `paper`

    bool operator==(const FrameRequest&) const = default;
};

struct UpdateResult {
    bool changed = false;        ///< the cut differs from that of the update before
    bool settled = false;        ///< nothing that this view wants is missing, loading or queued
    bool drawable = false;       ///< at least the coarsest page is there
    double errorPixels = 0;      ///< largest projected certified error in the cut (inf without a page or certificate)
    uint64_t residentBytes = 0;  ///< geometry and colour pages in the pool
    uint64_t bytesRead = 0;      ///< decompressed page bytes the loader has delivered since open()
    bool relaxed = false;        ///< the budget is too small for the view's pixel error; errorPixels is what it reaches
    uint64_t heldBytesMax =
        0;  ///< most memory that pages took between source and pool, and stored ones kept, since open() or setBudgets()
    uint64_t loads = 0, evictions = 0;  ///< pages into and out of the pool since open()
    uint64_t reloads = 0;               ///< pages loaded twice in one still view: always 0
    uint32_t deviceLosses = 0;          ///< losses since create(): all was made anew and pages are read again
    uint64_t failures = 0;              ///< reads that failed and were, or will be, tried again
    uint32_t pagesResident = 0, pagesInCut = 0, pagesWanted = 0;
    uint32_t pagesMissing = 0;                    ///< pages wanted, but not resident
    uint32_t pagesPending = 0;                    ///< pages wished for, being read, or waiting for an update
    uint32_t coarsestLevel = 0, finestLevel = 0;  ///< levels of the pages in the cut
    std::vector<Error> problems;                  ///< pages that cannot be read; each is reported once
};

struct FrameStats {
    uint64_t rays = 0;        ///< pixels
    uint64_t tracedRays = 0;  ///< pixels of tiles that the beam pass could not prove empty
    uint64_t hitPixels = 0;   ///< pixels where any dataset or surface is hit
    double msBeam = 0, msTrace = 0, msLight = 0, msShade = 0,
           msFeedback = 0;            ///< GPU timestamps; 0 where the device has none
    double msFrame = 0;               ///< from submission to completion, wall clock
    uint64_t steps = 0, fetches = 0;  ///< node visits and 16-byte reads of all rays; with countSteps only
    uint64_t poolBytes = 0;           ///< bytes allocated for the pool
    uint64_t colourBytes = 0;         ///< bytes of colour in the pool
    uint32_t pagesInCut = 0;
    uint32_t pipelines = 0;  ///< pipelines made since create()
    double msSurfaces = 0;   ///< GPU time of surfaces with mesostructure
    uint64_t unresolvedRays =
        0;  ///< rays, shadow rays too, that used up their iterations in mesostructure or went through too many pieces
    uint64_t farHits = 0;       ///< hits of pixels in surfaces, shown as seen from far and not marched
    uint64_t surfaceBytes = 0;  ///< bytes of mesostructure on the device, beside the pool: assets and shells
    uint64_t submissions = 0, hostWaits = 0;  ///< this frame's submissions, and how often the CPU waited for one
    uint64_t feedbackPasses = 0;  ///< frames since create() that asked rays what to read: none where nothing is missing
};

/// An image of the host's on the renderer's device: a colour image, not multisampled, of a UNORM format, with usage
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
    std::shared_ptr<const PageSource> source;  ///< source of this dataset only
    Similarity placement;
    uint32_t loaderThreads = 2;  ///< threads that keep its source busy
};

/// A page in the pool, for a picture of what is there.
struct PageBox {
    glm::dvec3 corner;                ///< world position
    std::array<glm::dvec3, 3> edges;  ///< world vectors from the corner
    uint32_t level = 0;               ///< 0: the coarsest
    bool isDrawn = false;             ///< the page is in the cut of this view
};

/// What the rays of the last frame that missed pages met, 24 x 16 over the picture, row by row from the upper left.
struct FeedbackPicture {
    static constexpr uint32_t kWidth = 24, kHeight = 16;
    /// The certified error, in pixels at the hit, of the page that was hit; with several datasets, the largest. Below
    /// 0: nothing was hit. Where it is above the request's errorPixels, the ray asked for finer pages.
    std::array<float, size_t{kWidth} * kHeight> errorPixels;
};

/// What one pixel shows.
struct PixelHit {
    double depth;            ///< distance from the ray's origin, world units
    glm::dvec3 position;     ///< world space
    glm::vec3 normal;        ///< unit, towards the viewer
    size_t dataset = 0;      ///< number of the dataset, in the order of open()
    bool onCap = false;      ///< the hit is on what a section plane cut open
    bool onSurface = false;  ///< the hit is on mesostructure; then `dataset` means nothing
};

struct MesoSurface;  // render/passes/meso_surface.h

class Renderer {
public:
    /// Makes all anew. Errors: Device (no such device, no memory for the pool), Usage (options contradict each other).
    static Result<std::unique_ptr<Renderer>> create(const RendererOptions& options);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Makes another view, which shares all but the picture and the window; it may outlive this one. `surface` asks for
    /// a window: then the options of create() must have had one too, or windowExtensions, or the host's device must
    /// meet what windows need. Errors: Device.
    Result<std::unique_ptr<Renderer>> addView(const std::optional<SurfaceSource>& surface = {});

    [[nodiscard]] const DeviceInfo& device() const;
    [[nodiscard]] PageAccess access() const;

    /// Shows a dataset, in all views, in place of the one before. Its pages come from `source` in loader threads.
    Result<void> open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source);
    /// Shows several datasets, each drawn by itself, and the nearest surface is seen; shadows and occlusion act within
    /// each dataset. Budgets are shared out (budgetShares). `surfaces`: as in setSurfaces. Errors: those of open for
    /// one dataset and of setSurfaces; then nothing is shown.
    Result<void> open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces = {});
    /// Stops the loader and forgets all pages.
    void close();

    /// Shows surfaces with mesostructure, in all views, in place of those before. They are drawn over the open
    /// datasets; the nearer surface is seen at each pixel. They take light, shadows, normals, unlit colours and steps
    /// (their iterations, 0 to 100) from the request; a surface that strays less than the request's errorPixels from
    /// its mean height is shown by its light from far. They and the datasets cast no shadow on each other, and no
    /// section plane cuts them. The renderer keeps them to upload them again to a device that is made anew. Without
    /// any, nothing is made for them. After an error there are none. Errors: Device, Limit.
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces);

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
    Result<UpdateResult> update(const FrameRequest& request);
    /// Calls update() until settled, and waits for the loader in between. Stops early with Cancelled where `cancel`
    /// returns true (it is called several times a second).
    Result<UpdateResult> settle(const FrameRequest& request, const std::function<bool()>& cancel = {});

    /// Waits until the loader has read a page, has nothing to do, or the time is over. A host calls it between updates
    /// when it has nothing else to do. Other calls never wait for reads.
    void waitForPage(std::chrono::milliseconds timeout);

    /// Draws the cut of the last update and waits for the GPU. Without a dataset it draws the background.
    Result<FrameStats> render(const FrameRequest& request);

    /// Returns the picture of the last render(). Errors: Usage, where nothing was drawn yet; Device.
    Result<Picture> readPicture();
    /// Distances in world units along the unit ray; infinity where nothing is hit, not a number where the ray gave up.
    Result<std::vector<float>> readDepth();
    Result<std::vector<glm::vec3>> readNormals();  ///< unit, towards the viewer; 0 where no hit
    /// Returns the number behind the false colour of each pixel: steps, cells or fetches of its ray. Precondition: the
    /// last render() was shaded so.
    Result<std::vector<uint32_t>> readWork();
    /// Returns each pixel's iterations in mesostructure, over all pieces that its ray passed; all 0 without surfaces.
    Result<std::vector<uint32_t>> readIterations();
    /// Returns what one pixel of the last render() shows; nothing where the ray hit nothing or the pixel is outside.
    Result<std::optional<PixelHit>> pick(uint32_t x, uint32_t y);

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
    /// `drawOver` (may be empty) draws over it. Precondition: options.surface. Errors: Device.
    Result<void> present(uint32_t width, uint32_t height, const DrawOver& drawOver = {});
    /// Returns the same as long as the renderer lives. Precondition: options.surface. Errors: Device.
    Result<WindowDrawing> windowDrawing();

    /// Returns validation messages (warnings and errors) since create(); always empty without options.validation.
    [[nodiscard]] std::vector<std::string> validationMessages() const;

private:
    struct Shared;
    struct State;
    explicit Renderer(std::unique_ptr<State> state);
    Result<void> openDatasets(std::vector<PlacedDataset> datasets);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
