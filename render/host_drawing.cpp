#include "render/host_drawing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "render/false_colours.h"
#include "render/frame_setup.h"
#include "render/host/lit_layers.h"
#include "render/host_layer.h"
#include "render/residencies.h"

namespace vcp {

namespace {

/// A dataset's layer of a picture, and what the layer points to.
struct PlacedLayer {
    const HostDataset& drawn;
    FrameRequest seen;  // from the dataset's own space
    std::optional<CutScene> cut;
    std::optional<PictureMarks> marks;  // where the dataset is asked which pages rays hit
};

/// Fills what a layer is made of.
Result<void> place(PlacedLayer& layer, const FrameRequest& request) {
    Residency& residency = layer.drawn.residency;
    layer.seen = requestIn(layer.drawn.placement, requestOfLook(request, layer.drawn.number));
    VCP_TRY_ASSIGN(layer.cut, CutScene::create(residency.dataset().header, residency.hasColour(),
                                               cutPages(residency, layer.drawn.view)));
    layer.cut->showImages(residency.images());
    if (request.sample == 0 && residency.asksRays(layer.drawn.view)) layer.marks.emplace(layer.cut->scene().pages());
    return {};
}

HostLayer layerOf(PlacedLayer& placed, const FrameRequest& request) {
    const HostDataset& drawn = placed.drawn;
    const Dataset& dataset = drawn.residency.dataset();
    const bool hasColour = drawn.residency.hasColour();
    return {.scene = placed.cut->scene(),
            .rays = pictureRays(placed.seen),
            .frame = frameConstants(placed.seen, &dataset, 1, hasColour, drawn.errorPixels, drawn.placement),
            .hasColour = hasColour,
            .hasChannels = placed.seen.shading.channels,
            .caps = capsOf(request, dataset),
            .worldPerUnit = drawn.placement.scale,
            .number = drawn.number,
            .marks = placed.marks ? &*placed.marks : nullptr};
}

/// Returns how far occlusion reaches where nothing else is asked for; world units.
double occlusionReach(std::span<const HostDataset> datasets, std::span<const HostSurface> surfaces) {
    std::vector<PictureDataset> all;
    for (const HostDataset& each : datasets) all.push_back({each.residency.dataset(), each.placement});
    std::vector<WorldBox> boxes;
    for (const HostSurface& each : surfaces) boxes.push_back({each.shell.low, each.shell.high});
    return occlusionRadiusAmong(all, boxes);
}

/// Draws layers and surfaces; where they shade each other, all at once.
Result<void> drawLayers(std::span<const HostLayer> layers, std::span<const HostSurface> surfaces,
                        std::span<const HostDataset> datasets, const FrameRequest& request,
                        const HostCastOptions& options, HostPicture& picture) {
    LitScene scene{layers, surfaces, frameConstants(request, nullptr, 1, false, 0), 0};
    const double asked = request.shading.occlusionRadius;
    scene.occlusionReach = float(asked > 0 ? asked : occlusionReach(datasets, surfaces));
    scene.frame.hasShadows = hasMesoShadows(request.shading) ? 1 : 0;
    if (hasLight(request.shading) && layers.size() + surfaces.size() > 1) return drawLitScene(scene, options, picture);
    for (const HostLayer& layer : layers) VCP_TRY(drawLayer(layer, options, picture));
    if (surfaces.empty()) return {};
    scene.layers = {};
    return drawLitScene(scene, options, picture);
}

/// Tells the residencies what the rays of a first sample hit.
void tell(std::span<const PlacedLayer> placed, std::span<const HostLayer> layers, const HostPicture& picture) {
    std::vector<SeenPages> seen;
    for (size_t i = 0; i < placed.size(); ++i) {
        const PlacedLayer& layer = placed[i];
        Residency& residency = layer.drawn.residency;
        const ViewNumber view = layer.drawn.view;
        if (layer.marks)
            seen.push_back({&residency,
                            {layer.cut->marked(layer.marks->byCamera), layer.cut->marked(layer.marks->byLight)},
                            selectionView(layer.seen),
                            residency.pagesNumber(view)});
        if (residency.listens())
            residency.hear(feedbackOf(layers[i], residency.dataset(), picture, {0, 0, picture.size.y, picture.size.y}),
                           selectionView(layer.seen));
    }
    if (!placed.empty()) seeAll(std::move(seen), placed.front().drawn.view);
}

}  // namespace

Result<void> checkHostDraws(const Dataset& dataset, const std::string& name) {
    const auto refused = [&](const char* message) {
        return Error{.code = ErrorCode::Unsupported, .message = message, .file = name};
    };
    if (dataset.header.method == Method::Paper)
        return refused("the host does not draw files built by the paper's method; take a Vulkan device");
    // Where pages do not cover the surface, the shaders continue coarser pages into finer ones.
    if (dataset.header.levels > 1 && !dataset.isCovering())
        return refused(
            "the host does not draw the seams between levels that are no slabs, as this file's; take a Vulkan device");
    return {};
}

Result<std::vector<PreparedSurface>> prepareOnHost(std::span<const MesoSurface> surfaces) {
    using Words = std::shared_ptr<const std::vector<uint64_t>>;
    std::map<LookKey, Words> known;
    std::vector<PreparedSurface> prepared;
    for (const MesoSurface& surface : surfaces) {
        if (!surface.arrays || surface.remeshed.surface)
            return Error{.code = ErrorCode::Unsupported,
                         .message = "the host does not draw remeshed surfaces; take a Vulkan device"};
        MesoLook look = mesoLook(surface);
        Words& words = known[lookKey(surface)];
        if (!words) words = std::make_shared<const std::vector<uint64_t>>(std::move(look.looks));
        look.looks.clear();
        prepared.push_back({&surface, std::move(look), words});
    }
    return prepared;
}

uint64_t bytesOf(std::span<const PreparedSurface> surfaces) {
    std::map<const void*, uint64_t> bytes;
    for (const PreparedSurface& each : surfaces) {
        const MesoSurface& surface = *each.surface;
        bytes[surface.arrays.get()] = surface.arrays->words.size() * sizeof(uint32_t);
        bytes[&surface.shell] = surface.shell.texels.size() * sizeof(glm::vec4);
        bytes[each.words.get()] = each.words->size() * sizeof(uint64_t);
    }
    uint64_t sum = 0;
    for (const auto& [what, count] : bytes) sum += count;
    return sum;
}

namespace {

/// Returns the light over a surface's base, which is made anew where the surroundings are others.
std::span<const uint64_t> baseLightOf(PreparedSurface& surface, const std::array<glm::vec4, 16>& harmonics) {
    if (surface.baseLightOf != harmonics) {
        surface.baseLight = surface.surface->baseTransfer->lightTexels(harmonics);
        surface.baseLightOf = harmonics;
    }
    return surface.baseLight;
}

}  // namespace

Result<HostPicture> drawOnHost(std::span<const HostDataset> datasets, std::span<PreparedSurface> surfaces,
                               const FrameRequest& request, const std::function<bool()>& cancel) {
    const HostCastOptions options{.cancel = cancel};
    HostPicture picture({int(request.width), int(request.height)}, backgroundRows(request));
    if (showsWork(request.shading.mode)) picture.work.resize(picture.colours.size());
    std::vector<PlacedLayer> placed;
    for (const HostDataset& each : datasets) placed.push_back({each, {}, {}, {}});
    std::vector<HostLayer> layers;
    for (PlacedLayer& each : placed) {
        VCP_TRY(place(each, request));
        layers.push_back(layerOf(each, request));
    }
    std::vector<HostSurface> drawn;
    for (PreparedSurface& each : surfaces) {
        const meso::Shell& shell = each.surface->shell;
        drawn.push_back(
            {*each.surface->arrays, shell, each.look.view, *each.words, each.look.textures, each.look.isFarDrawn, {}});
        HostSurface& made = drawn.back();
        setPicture(made.view, shell.origin + movedBy(request, drawn.size() - 1), request);
        if (made.view.hasBaseLight != 0 && readsTransfer(request.shading))
            made.baseLight = baseLightOf(each, std::to_array(made.view.harmonics));
    }
    VCP_TRY(drawLayers(layers, drawn, datasets, request, options, picture));
    if (request.sample == 0) tell(placed, layers, picture);
    return picture;
}

std::vector<uint64_t> cutNumbers(std::span<const HostDataset> datasets) {
    std::vector<uint64_t> all;
    for (const HostDataset& each : datasets) all.push_back(each.residency.cutNumber(each.view));
    return all;
}

FrameStats hostStats(std::span<const HostDataset> datasets, std::span<const PreparedSurface> surfaces,
                     const HostPicture& picture) {
    FrameStats stats{.rays = picture.depth.size(),
                     .tracedRays = picture.depth.size(),
                     .unresolvedRays = picture.unresolvedRays,
                     .farHits = picture.farSurfaceHits,
                     .surfaceBytes = bytesOf(surfaces),
                     .onHost = true};
    for (const HostDataset& each : datasets) {
        stats.poolBytes = each.residency.pages().bytes();  // of all datasets
        stats.colourBytes += each.residency.colourBytes();
        stats.pagesInCut += uint32_t(each.residency.cut(each.view).size());
    }
    stats.hitPixels = uint64_t(std::ranges::count_if(picture.depth, [](float depth) { return std::isfinite(depth); }));
    return stats;
}

}  // namespace vcp
