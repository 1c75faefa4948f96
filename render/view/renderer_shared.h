// What the views of a renderer share: device, passes, and the datasets with their pages.
#pragma once

#include "render/view/renderer.h"

#include <utility>

#include "render/page_pool.h"
#include "render/passes/accumulate.h"
#include "render/passes/beam.h"
#include "render/passes/compose.h"
#include "render/passes/feedback.h"
#include "render/passes/image_buffer.h"
#include "render/passes/light.h"
#include "render/passes/meso_surface.h"
#include "render/passes/paper_trace.h"
#include "render/passes/scene_light.h"
#include "render/passes/shade.h"
#include "render/passes/trace.h"
#include "render/residencies.h"

namespace vcp {

/// The pool of a residency whose memory is a device's.
inline const PagePool& poolOf(const Residency& residency) { return static_cast<const PagePool&>(residency.pages()); }

struct Renderer::Shared {
    RendererOptions options;
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;  // null after a loss that could not be repaired
    DeviceInfo info;
    PageAccess access = PageAccess::TexelBuffer;
    uint32_t stripes = 1;
    std::vector<PlacedResidency> datasets;
    /// The images of a dataset on the device.
    struct DeviceImages {
        uint64_t version = 0;                 // Residency::imagesVersion
        std::shared_ptr<const Buffer> words;  // frames keep those that they read
    };
    std::vector<DeviceImages> images;          // of the datasets, where a pass has read them
    std::pair<uint32_t, uint32_t> poolLayout;  // chunks and their shift, which the pipelines were made for
    uint32_t losses = 0;
    // Views record their frames one after the other, so one set of pipelines is enough for all.
    BeamPass beam;
    TracePass trace;
    PaperTracePass paperTrace;
    LightPass light;
    SceneLightPass sceneLight;
    ShadePass shade;
    FeedbackPass feedback;
    ComposePass compose;
    AccumulatePass accumulate;
    /// The surfaces with mesostructure, and what draws them.
    struct Meso {
        std::vector<MesoSurface> surfaces;      // kept to be uploaded again
        std::vector<PreparedSurface> prepared;  // of them, where the processor casts the rays; else none
        std::unique_ptr<MesoResources> resources;
        std::unique_ptr<MesoSurfacePass> pass;

        /// Whether rays of light go through any of them.
        [[nodiscard]] bool marches() const {
            return std::any_of(surfaces.begin(), surfaces.end(),
                               [](const MesoSurface& each) { return bool(each.arrays); });
        }
    };
    std::unique_ptr<Meso> meso;  // null: there are none
    uint64_t mesoVersion = 0;    // counts setSurfaces
    std::vector<View*> views;
    ViewNumber nextNumber = 0;

    /// Whether pictures are composed of more than one dataset, or have surfaces.
    [[nodiscard]] bool composes() const { return datasets.size() > 1 || meso; }
    /// Takes a device that was just made.
    void take(std::unique_ptr<Device> made);
    /// Uploads the copies of the surfaces to the device. After an error there are none.
    Result<void> uploadSurfaces();
    /// Returns the surfaces as the processor draws them; nothing where it does not, or where there are none.
    [[nodiscard]] std::span<PreparedSurface> preparedSurfaces() {
        return meso ? std::span<PreparedSurface>(meso->prepared) : std::span<PreparedSurface>();
    }
    /// Bytes of the surfaces, which the budget pays for before pages.
    [[nodiscard]] uint64_t surfaceBytes() const { return meso && meso->pass ? meso->pass->assetBytes() : 0; }
    /// Copies the images that a dataset shows now to the device, unless they are there or there are none; waits for it,
    /// and for all that is in flight. Those before go, but where a frame is drawn in steps. Not while commands are
    /// recorded. Errors: as of uploadImages.
    Result<void> needImages(size_t dataset);
    /// Returns what the surfaces and the images leave of a budget for pages. Errors: Limit, where that is too little.
    Result<uint64_t> pageBudget(uint64_t budgetBytes) const {
        return budgetOfPages(budgetBytes, surfaceBytes() + imageBytes(datasets));
    }
    /// Returns what the images leave of the memory for pages on their way.
    [[nodiscard]] uint64_t pageRam(uint64_t ramBytes) const { return ramOfPages(ramBytes, imageBytes(datasets)); }
    /// Opens datasets beside those that are open, and shows all. After an error none is added. Errors: as of
    /// Renderer::open.
    Result<void> addDatasets(std::vector<PlacedDataset> placed);
    /// hidePool: ends what is in flight; no shader of any view sees a pool then. showPool: shaders see the residencies'
    /// pools; where one has none, datasets are closed.
    void hidePool();
    Result<void> showPool();
    void clearPipelines();
    /// Makes anew all that the device held. `asked`: the view that found the device lost.
    Result<void> rebuild(View& asked);
    /// Whether what failed is worth another try now.
    bool recover(View& asked, bool mayRebuild);
    /// Calls `doIt` for a view; after an error that can be recovered from, once more.
    template <class Do>
    auto tryAgain(View& asked, Do doIt) -> decltype(doIt());
};

template <class Do>
auto Renderer::Shared::tryAgain(View& asked, Do doIt) -> decltype(doIt()) {
    const uint32_t before = losses;
    auto done = doIt();
    // A device that is lost each time is given up; the pool can be halved only a few times.
    while (!done && recover(asked, losses == before)) done = doIt();
    return done;
}

inline const Error kGone{.code = ErrorCode::Device, .message = "the device was lost and could not be made anew"};

}  // namespace vcp
