// What a Renderer is made of: what its views share, and a view. Included by renderer.cpp (its life), renderer_frame.cpp
// (drawing) and renderer_readback.cpp (what was drawn).
#pragma once

#include "render/renderer.h"

#include <utility>

#include "render/passes/beam.h"
#include "render/passes/compose.h"
#include "render/passes/feedback.h"
#include "render/passes/light.h"
#include "render/passes/meso_surface.h"
#include "render/passes/paper_trace.h"
#include "render/passes/shade.h"
#include "render/passes/trace.h"
#include "render/picture_scaling.h"
#include "render/residency.h"
#include "render/swapchain.h"
#include "render/vulkan/pass_timer.h"

namespace vcp {

/// Number of time marks in a layer's frame: one before the beam pass, and one after each pass.
constexpr uint32_t kPassMarks = 6;

/// What the views share: device, passes, and the datasets with their pages.
struct Renderer::Shared {
    struct Placed {
        std::unique_ptr<Residency> residency;
        Similarity placement;
    };
    RendererOptions options;
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;  // null after a loss that could not be repaired
    DeviceInfo info;
    PageAccess access = PageAccess::TexelBuffer;
    uint32_t stripes = 1;
    std::vector<Placed> datasets;
    std::vector<std::pair<uint32_t, uint32_t>> poolLayouts;  // layouts of the datasets that the pipelines were made for
    uint32_t losses = 0;
    // Views draw one after the other, so one set of pipelines is enough for all.
    BeamPass beam;
    TracePass trace;
    PaperTracePass paperTrace;
    LightPass light;
    ShadePass shade;
    FeedbackPass feedback;
    ComposePass compose;
    /// The surfaces with mesostructure, and what draws them.
    struct Meso {
        std::vector<MesoSurface> surfaces;  // kept to be uploaded again
        std::unique_ptr<MesoResources> resources;
        std::unique_ptr<MesoSurfacePass> pass;
        PassTimer timer;
    };
    std::unique_ptr<Meso> meso;  // null: there are none
    uint64_t mesoVersion = 0;    // counts setSurfaces
    std::vector<State*> views;
    ViewNumber nextNumber = 0;

    /// Uploads the copies of the surfaces to the device. After an error there are none.
    Result<void> uploadSurfaces();
};

struct Renderer::State {
    explicit State(std::shared_ptr<Shared> with, std::optional<SurfaceSource> window)
        : shared(std::move(with)), surface(std::move(window)), number(shared->nextNumber++) {
        shared->views.push_back(this);
    }
    ~State() {
        std::erase(shared->views, this);
        for (const Shared::Placed& placed : datasets) placed.residency->forgetView(number);
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    const std::shared_ptr<Shared> shared;
    RendererOptions& options = shared->options;
    std::unique_ptr<Instance>& instance = shared->instance;
    std::unique_ptr<Device>& device = shared->device;
    DeviceInfo& info = shared->info;
    PageAccess& access = shared->access;
    uint32_t& stripes = shared->stripes;
    std::vector<Shared::Placed>& datasets = shared->datasets;
    uint32_t& losses = shared->losses;
    BeamPass& beam = shared->beam;
    TracePass& trace = shared->trace;
    PaperTracePass& paperTrace = shared->paperTrace;
    LightPass& light = shared->light;
    ShadePass& shade = shared->shade;
    FeedbackPass& feedback = shared->feedback;
    ComposePass& compose = shared->compose;

    const std::optional<SurfaceSource> surface;
    const ViewNumber number;
    std::function<void()> gone;
    std::unique_ptr<Swapchain> swapchain;
    std::unique_ptr<PictureScaling> scaling;  // scales to the host's images; made on first use
    /// This view's part of drawing one dataset.
    struct Layer {
        std::unique_ptr<FrameResources> resources;
        Residency* residency = nullptr;  // null: nothing but the background is drawn
        Similarity placement;
        PassConstants constants;  // those of the last frame
        bool tableStale = true;
        uint64_t tableVersion = 0;
        std::vector<glm::uvec4> table;  // the table of the last frame
        double errorPixels = 0;         // largest error in the cut
        FrameRequest drawn;

        [[nodiscard]] bool isPaper() const {
            return residency != nullptr && residency->dataset().header.method == Method::Paper;
        }
        /// Whether the next frame has a feedback pass.
        [[nodiscard]] bool listens() const { return residency != nullptr && residency->listens() && !isPaper(); }
        /// World units per unit of the hits' depths.
        [[nodiscard]] double unit() const {
            return (residency != nullptr ? residency->dataset().header.cell : 1) * placement.scale;
        }
        /// The request as seen from the dataset's own space, without what its method cannot draw.
        [[nodiscard]] FrameRequest drawable(const FrameRequest& request) const;
    };
    std::vector<Layer> layers;  // one for each dataset, and at least one; the first one's picture is the view's
    PassTimer timer;
    ComposeTarget target;  // pictures are composed into it
    MesoTarget mesoTarget;
    uint64_t mesoSeen = 0;  // Shared::mesoVersion of the last update
    std::optional<FrameRequest> drawn;
    bool keepsFeedback = false;
    std::optional<FeedbackPicture> feedbackPicture;
    /// Makes the device, and this view's part of it.
    Result<void> createDevice(const DeviceFaults& faults);
    Result<VkSurfaceKHR> createSurface() const;
    Result<void> attach(VkSurfaceKHR window);
    Result<void> attachToDevice();
    void release();
    /// Makes as many layers as there are datasets.
    Result<void> makeLayers();
    /// Whether the picture is composed of more than one dataset, or has surfaces.
    [[nodiscard]] bool composes() const { return layers.size() > 1 || shared->meso; }
    /// Whether each dataset has its layer; false where the device failed half-way.
    [[nodiscard]] bool isComplete() const;
    /// hidePool: all views' shaders see no pool. showPool: the residencies'; where one has none, datasets are closed.
    void hidePool();
    Result<void> showPool();
    void clearPipelines();
    /// Shares the budgets out among the datasets.
    Result<void> setShares(uint64_t budgetBytes, uint64_t ramBytes);
    /// Makes anew all that the device held.
    Result<void> rebuild();
    /// Calls `doIt`; after an error that can be recovered from, once more.
    template <class Do>
    auto tryAgain(Do doIt) -> decltype(doIt());
    bool recover(bool mayRebuild);
    Result<UpdateResult> updateAll(const FrameRequest& request);
    Result<FrameStats> draw(const FrameRequest& request);
    void keep(const RayFeedback& heard, const SelectionView& view, const Dataset& dataset);
    Result<FrameStats> drawLayer(Layer& layer, const FrameRequest& request);
    [[nodiscard]] PassConstants constantsFor(const Layer& layer, const FrameRequest& request) const;
    Result<void> checkLimits(const Layer& layer, const FrameRequest& request) const;
    Result<void> prepareTable(Layer& layer);
    Result<void> prepare(Layer& layer, const FrameRequest& request);
    void recordFrame(VkCommandBuffer commands, const Layer& layer, const FrameRequest& request);
    /// Draws the surfaces over the datasets' picture.
    Result<void> drawSurfaces(const FrameRequest& request, FrameStats& stats);
    Result<FrameStats> collectStats(const Layer& layer, const FrameRequest& request) const;
    /// Returns the words of a plane of the last frame; pixels of empty tiles, which were not written, get `missing`.
    Result<std::vector<uint32_t>> hitPlane(const Layer& layer, uint32_t plane, uint32_t missing) const;
    /// Returns the distances of the last frame in one layer, as readDepth() gives them.
    Result<std::vector<float>> depthOf(const Layer& layer) const;
    /// Returns the words of a plane of the surfaces' hits; empty where there are none.
    [[nodiscard]] Result<std::vector<uint32_t>> mesoPlane(uint32_t plane) const;
    Result<std::optional<PixelHit>> pick(const Layer& layer, uint32_t x, uint32_t y) const;
    Result<std::optional<PixelHit>> pickSurfaces(uint32_t x, uint32_t y) const;
    [[nodiscard]] PixelHit hitAt(uint32_t x, uint32_t y, double depth) const;
};

template <class Do>
auto Renderer::State::tryAgain(Do doIt) -> decltype(doIt()) {
    const uint32_t before = losses;
    auto done = doIt();
    // A device that is lost each time is given up; the pool can be halved only a few times.
    while (!done && recover(losses == before)) done = doIt();
    return done;
}

inline const Error kGone{.code = ErrorCode::Device, .message = "the device was lost and could not be made anew"};

/// Whether pixels show the work of their rays.
constexpr bool showsWork(ShadingMode mode) {
    return mode == ShadingMode::Steps || mode == ShadingMode::Cells || mode == ShadingMode::Fetches;
}

}  // namespace vcp
