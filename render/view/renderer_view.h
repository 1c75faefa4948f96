// A view of a renderer: camera, pictures and window of its own. Included by renderer.cpp (its life), renderer_frame.cpp
// (drawing), renderer_cast.cpp (drawing by the processor), renderer_refine.cpp (further samples) and
// renderer_readback.cpp (what was drawn).
//
// The life of a frame: it is recorded with resources that no frame in flight has, submitted as one submission, and,
// when the device has ended it, taken in: its counts, what its rays asked for, and the hit under the cursor. Everything
// that the CPU writes for a frame, or reads of it, is in Frame, so that there is one for each that may be in flight;
// what only the device touches is ordered by the barrier at the start of each frame.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>

#include "render/host_drawing.h"
#include "render/picture_parts.h"
#include "render/picture_scaling.h"
#include "render/swapchain.h"
#include "render/view/renderer_shared.h"
#include "render/vulkan/pass_timer.h"

namespace vcp {

/// Number of the frame that draws parts of further samples (View::frames).
constexpr size_t kRefiningFrame = kFramesAhead;

/// Number of time marks of a dataset in a frame: one before the beam pass, and one after each pass.
constexpr uint32_t kPassMarks = 6;

/// A pass over one of a frame's datasets. A frame that takes long is drawn step by step, a submission each, between
/// which the device can do other things: a step is a pass, or, where rays are cast, as many tiles of it as take a short
/// time.
struct FrameStep {
    /// Gather and SceneLight: of pictures in which datasets and surfaces shade each other; Surfaces finds what is hit
    /// of these there, SurfaceLight casts a ray through them.
    enum class Pass { Beam, Trace, Light, Gather, Surfaces, SceneLight, SurfaceLight, Shade };
    Pass pass = Pass::Beam;
    size_t layer = 0;
    uint32_t raysPerPixel = 0;  // 0: the pass is not parted
    frame::SceneRay ray{};      // of SceneLight and SurfaceLight

    [[nodiscard]] bool isOfSurfaces() const { return pass == Pass::Surfaces || pass == Pass::SurfaceLight; }
};

struct Renderer::View {
    View(std::shared_ptr<Shared> with, std::optional<SurfaceSource> window);
    ~View();
    View(const View&) = delete;
    View& operator=(const View&) = delete;

    /// What this view draws of one dataset.
    struct Layer {
        Residency* dataset = nullptr;    // null: none is open
        Residency* residency = nullptr;  // the same; null where it is hidden: nothing but the background is drawn
        Similarity placement;
        size_t number = 0;  // of the dataset
        bool tableStale = true;
        uint64_t tableVersion = 0;
        std::vector<frame::TableRecord> table;
        uint64_t tableNumber = 0;  // counts changes of the table
        double errorPixels = 0;    // largest error in the cut

        [[nodiscard]] bool isPaper() const {
            return residency != nullptr && residency->dataset().header.method == Method::Paper;
        }
        /// Whether rays of light go through it.
        [[nodiscard]] bool casts() const { return residency != nullptr && !isPaper(); }
        /// Whether the next frame has a feedback pass.
        [[nodiscard]] bool listens() const { return residency != nullptr && residency->listens() && !isPaper(); }
        /// Whether the next frame of the view says which pages its rays hit.
        [[nodiscard]] bool asksRays(ViewNumber view) const {
            return residency != nullptr && residency->asksRays(view) && !isPaper();
        }
        /// World units per unit of the hits' depths.
        [[nodiscard]] double unit() const {
            return (residency != nullptr ? residency->dataset().header.cell : 1) * placement.scale;
        }
        /// The request as seen from the dataset's own space, without what its method cannot draw.
        [[nodiscard]] FrameRequest drawable(const FrameRequest& request) const;
    };
    /// One dataset in one frame.
    struct LayerFrame {
        std::unique_ptr<FrameResources> resources;
        FeedbackTarget feedback;
        PassTimer timer;
        PassConstants constants;
        std::shared_ptr<const Buffer> images;  // that it reads
        uint64_t imagesVersion = 0;
        FrameRequest request;      // as seen from the dataset
        uint64_t tableNumber = 0;  // of the table that the resources have
        bool listened = false;     // the frame has a feedback pass
        bool asked = false;        // its rays say which pages they hit
        uint64_t pagesNumber = 0;  // of what is drawn (Residency::pagesNumber)
        uint64_t others = 0;       // what is drawn beside it (Residency::others)

        [[nodiscard]] bool reports() const { return listened || asked; }
    };
    /// A picture that the processor drew.
    struct CastPicture {
        HostPicture picture;
        std::vector<uint64_t> cuts;  // numbers of those that it shows
        SampledLight light;          // none before the second sample
        Buffer colours;              // what is shown of it, on the device
    };
    struct Frame {
        std::vector<LayerFrame> layers;  // one for each of the view's; the first one's picture is the frame's
        ComposeTarget target;            // pictures are composed into it
        MesoTarget surfaces;
        PassTimer surfacesTimer, lightTimer;
        bool isLit = false;  // datasets and surfaces shade each other
        FrameRequest request;
        std::vector<FrameStep> steps;
        size_t nextStep = 0;              // the first one that is not wholly submitted
        uint32_t nextTile = 0;            // of that one
        std::optional<PicturePart> part;  // what is added to the last picture, where this is no picture of its own
        std::optional<PicturePixel> cursor;
        FrameStats stats;  // what is known when it is submitted
        std::chrono::steady_clock::time_point began;
        uint64_t submission = 0;          // of the frame; 0: none that is to be taken in
        uint64_t lastUse = 0;             // the last submission that uses any of this
        bool isAhead = false;             // drawn with renderAhead()
        std::optional<CastPicture> cast;  // in place of what the layers' passes draw

        [[nodiscard]] bool isUnfinished() const { return nextStep < steps.size(); }
        /// The first step that casts light through several datasets, or the end.
        [[nodiscard]] const FrameStep* firstLight() const {
            return &*std::find_if(steps.begin(), steps.end(), [](const FrameStep& step) {
                return step.pass == FrameStep::Pass::SceneLight || step.pass == FrameStep::Pass::SurfaceLight;
            });
        }
        [[nodiscard]] const Buffer& picture() const {
            return cast ? cast->colours : layers.front().resources->picture();
        }
        [[nodiscard]] PictureSize size() const {
            return cast ? PictureSize{request.width, request.height} : layers.front().resources->size();
        }
    };

    const std::shared_ptr<Shared> shared;
    const std::optional<SurfaceSource> surface;
    const ViewNumber number;
    std::function<void()> gone;
    std::unique_ptr<Swapchain> swapchain;
    std::unique_ptr<PictureScaling> scaling;  // scales to the host's images; made on first use
    PaintOver paintOver;                      // may be empty
    Buffer painted;                           // the last picture, with what paintOver painted
    std::vector<Layer> layers;                // one for each dataset, and at least one
    /// render() draws with the first one only; the last one is for parts of further samples, and is as small.
    std::array<Frame, kFramesAhead + 1> frames;
    std::optional<size_t> drawn;        // number of the frame with the last picture, and with its hits
    std::optional<size_t> begun;        // number of the frame that is drawn step by step, until all are submitted
    SampleSums sums;                    // of that picture
    uint32_t samples = 1;               // that it has
    uint32_t nextPart = 0;              // of the sample that is being added
    uint64_t stepRays = kPartRays / 8;  // rays of a step
    std::chrono::steady_clock::time_point stepBegan;  // of the step that was submitted last
    std::optional<DoneFrame> lastDone;
    uint64_t framesDone = 0;                  // counts those that were taken in
    uint64_t mesoSeen = 0;                    // Shared::mesoVersion of the last update
    std::optional<FrameRequest> heightsRead;  // of the frame that last said which heights it read
    bool keepsFeedback = false;
    std::optional<FeedbackPicture> feedbackPicture;

    /// Makes the device, and this view's part of it.
    Result<void> createDevice(const DeviceFaults& faults);
    Result<VkSurfaceKHR> createSurface() const;
    Result<void> attach(VkSurfaceKHR window);
    Result<void> attachToDevice();
    void release();
    /// Makes as many layers as there are datasets, in the view and in its first frame.
    Result<void> makeLayers();
    Result<void> makeLayers(Frame& frame);
    /// Lets the layers draw the datasets that are open.
    Result<void> showDatasets();
    /// Lets the frame's shaders see the layers' pools.
    void bindPools(Frame& frame);
    /// Lets go of the images that frames have read, but those that go on being drawn. Precondition: nothing is in
    /// flight.
    void forgetImages();
    /// Whether each dataset has its layer; false where the device failed half-way.
    [[nodiscard]] bool isComplete() const;
    /// Lets the layers draw what the request does not hide; waits for frames in flight where that is news. Errors:
    /// Device.
    Result<void> hideAsAsked(const FrameRequest& request);
    /// Forgets the pictures, and what the frames would tell. Precondition: no frame is in flight.
    void forgetFrames();

    Result<UpdateResult> updateAll(const FrameRequest& request);
    /// Takes in heights that have come, and adds what is to come.
    Result<void> updateHeights(const FrameRequest& request, UpdateResult& all);
    /// Draws a frame and waits for it.
    Result<FrameStats> draw(const FrameRequest& request, const std::function<bool()>& cancel);
    Result<void> drawAhead(const FrameRequest& request, const std::optional<PicturePixel>& cursor);
    /// Draws the next part of a further sample; as Renderer::refineAhead().
    Result<uint32_t> drawPart();
    /// Whether the processor casts rays now, in place of the device.
    [[nodiscard]] bool isCastOnHost() const;
    /// Draws a frame by the processor, and takes it in. Precondition: isCastOnHost(), and nothing in flight uses it.
    Result<void> cast(size_t number, const FrameRequest& request, const std::optional<PicturePixel>& cursor,
                      const std::function<bool()>& cancel);
    /// Does what drawPart() does for the last picture, which the processor drew.
    Result<uint32_t> castPart();
    [[nodiscard]] std::vector<HostDataset> hostDatasets() const;
    [[nodiscard]] std::optional<PixelHit> castHit(const Frame& frame, PicturePixel pixel) const;
    /// What a picture costs, in rays through pages.
    [[nodiscard]] uint64_t raysOf(const FrameRequest& request) const;
    /// Submits the next step of the frame that was begun; as Renderer::continueFrame().
    Result<bool> drawStep();
    /// Forgets the frame that was begun.
    void abandonFrame();
    Result<void> submit(size_t number, const FrameRequest& request, const std::optional<PicturePixel>& cursor,
                        bool mayTakeSteps);
    /// Submits one of the frame's next steps, or all, and with the last one what follows them.
    Result<void> submitSteps(Frame& frame, bool one);
    [[nodiscard]] std::vector<FrameStep> stepsOf(const FrameRequest& request) const;
    [[nodiscard]] std::vector<FrameStep> litStepsOf(const FrameRequest& request) const;
    /// How far occlusion reaches where datasets shade each other, world units.
    [[nodiscard]] double occlusionRadius() const;
    /// Whether rays of light go through more than the dataset that they begin on.
    [[nodiscard]] bool isLit(const FrameRequest& request) const;
    /// Returns the number of tiles that a step works on: those of the layer that a frame's beams could not prove empty,
    /// or all. Precondition: the beams are done.
    static uint32_t tilesOf(const Frame& frame, const FrameStep& step);
    /// Returns the tiles of the frame's next step, and goes on behind them.
    TileRange takeTiles(Frame& frame, bool one) const;
    /// Makes steps shorter or longer by what the last one took.
    void adaptSteps();
    void addKnownStats(Frame& frame) const;
    Result<void> checkLimits(const Layer& layer, const FrameRequest& request) const;
    [[nodiscard]] PassConstants constantsFor(const Layer& layer, const FrameRequest& request) const;
    void refreshTable(Layer& layer) const;
    Result<void> prepareTable(Layer& layer, LayerFrame& frame);
    Result<void> prepare(Frame& frame, size_t layer);
    /// Chooses the passes' pipelines for what is recorded next.
    Result<void> choosePipelines(Frame& frame, size_t layer);
    void record(VkCommandBuffer commands, Frame& frame, const FrameStep& step, TileRange tiles);
    void recordBeam(VkCommandBuffer commands, Frame& frame, size_t layer);
    void recordShade(VkCommandBuffer commands, Frame& frame, size_t layer);
    /// Returns what the surfaces are drawn over.
    [[nodiscard]] static MesoSurfacePass::Picture underSurfaces(const Frame& frame);
    void recordSurfaceHits(VkCommandBuffer commands, Frame& frame) const;
    void recordSurfaceRay(VkCommandBuffer commands, const Frame& frame, const frame::SceneRay& ray) const;
    /// Records the surfaces, over the datasets' picture; where they shade each other, what is left of them.
    Result<void> recordSurfaces(VkCommandBuffer commands, Frame& frame);

    /// Takes in frames that have ended, in their order. Never waits. Errors: Device.
    Result<void> takeInDone();
    /// Waits for this view's frames, and takes them in.
    Result<void> takeInAll();
    Result<void> takeIn(Frame& frame);
    Result<void> addStats(const Frame& frame, size_t layer, FrameStats& all) const;
    Result<void> addSurfaceStats(const Frame& frame, FrameStats& all) const;
    void hear(const Frame& frame);
    void keep(const RayFeedback& heard, const SelectionView& view, const Dataset& dataset);

    /// The frame with the last picture, of which nothing is in flight any more. Errors: Usage, without one; Device.
    Result<const Frame*> lastFrame();
    /// Returns the picture as the host sees it: with what paintOver paints. Precondition: a picture was drawn. Errors:
    /// Device.
    Result<Picture> hostPicture();
    /// Returns its bytes in a buffer that may be copied to windows and images.
    Result<const Buffer*> shownPicture();
    /// Returns the words of a plane of a frame; pixels of empty tiles, which were not written, get `missing`.
    Result<std::vector<uint32_t>> hitPlane(const LayerFrame& layer, uint32_t plane, uint32_t missing) const;
    /// Returns the distances in one layer, as readDepth() gives them.
    Result<std::vector<float>> depthOf(const Frame& frame, size_t layer) const;
    /// Returns the words of a plane of the surfaces' hits; empty where there are none.
    [[nodiscard]] Result<std::vector<uint32_t>> mesoPlane(const Frame& frame, uint32_t plane) const;
    Result<std::optional<PixelHit>> pick(PicturePixel pixel);
    /// Returns the nearest of the layers' hits and the surfaces', from their words at a pixel.
    [[nodiscard]] std::optional<PixelHit> nearestHit(const FrameRequest& request, PicturePixel pixel,
                                                     std::span<const HitWords> words, const MesoReport& surfaces) const;
};

/// What a pixel costs, in rays through pages.
uint32_t raysPerPixel(const FrameRequest& request, bool hasSurfaces);

}  // namespace vcp
