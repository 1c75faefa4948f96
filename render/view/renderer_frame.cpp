// Renderer: drawing.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/false_colours.h"
#include "render/frame_setup.h"
#include "render/residencies.h"
#include "render/view/renderer_view.h"
#include "render/vulkan/compute_pipeline.h"

namespace vcp {

namespace {

// What takes a software device longer, about a second, is drawn step by step.
constexpr uint64_t kMostRaysAtOnce = 8 * kPartRays;
// A step is to take so long: what presents waits for it.
constexpr double kStepSeconds = 0.04;
constexpr uint64_t kFewestStepRays = 1 << 12;

// Planes of a pixel's record behind the others, where channels of materials are shown.
constexpr uint32_t kChannelPlanes = 3;

uint32_t hitPlanesOf(const FrameRequest& request, const PassConstants& constants) {
    return hitPlanes(request, constants.colour) + (constants.channels ? kChannelPlanes : 0);
}

}  // namespace

PassConstants Renderer::View::constantsFor(const Layer& layer, const FrameRequest& request) const {
    PassConstants c;
    c.access = shared->access;
    if (const Residency* residency = layer.residency) {
        c.poolChunks = poolOf(*residency).chunks();
        c.chunkShift = poolOf(*residency).chunkShift();
        c.colour = residency->hasColour();
        c.images = residency->images() != nullptr;
        c.channels = showsChannels(*residency, request);
        c.seams = residency->dataset().header.levels > 1 && !residency->dataset().isCovering();
    }
    c.falseColour = hasHitNumbers(request.shading.mode);
    c.countSteps = showsWork(request.shading.mode);
    return c;
}

Result<void> Renderer::View::checkLimits(const Layer& layer, const FrameRequest& request) const {
    const uint64_t words =
        uint64_t{request.width} * request.height * hitPlanesOf(request, constantsFor(layer, request));
    const Device& device = *shared->device;
    const VkPhysicalDeviceLimits& limits = device.limits();
    uint64_t most = limits.maxStorageBufferRange / 4;
    if (shared->access == PageAccess::TexelBuffer) most = std::min<uint64_t>(most, limits.maxTexelBufferElements);
    if (words <= most) return {};
    return Error{.code = ErrorCode::Limit,
                 .message = fmt::format("{} x {} pixels are more than '{}' can address at once; at most {} pixels",
                                        request.width, request.height, device.info().name,
                                        most / (words / (uint64_t{request.width} * request.height)))};
}

void Renderer::View::refreshTable(Layer& layer) const {
    const uint64_t version = layer.residency != nullptr ? layer.residency->version() : 0;
    if (!layer.tableStale && version == layer.tableVersion) return;
    auto next = layer.residency != nullptr ? layer.residency->table(number) : std::vector{frame::TableRecord{}};
    if (layer.tableStale || next != layer.table) ++layer.tableNumber;
    layer.table = std::move(next);
    layer.tableVersion = version;
    layer.tableStale = false;
}

Result<void> Renderer::View::prepareTable(Layer& layer, LayerFrame& frame) {
    refreshTable(layer);
    if (frame.tableNumber == layer.tableNumber) return {};
    VCP_TRY(frame.resources->setTable(layer.table));
    frame.tableNumber = layer.tableNumber;
    return {};
}

Result<void> Renderer::View::prepare(Frame& frame, size_t i) {
    Layer& layer = layers[i];
    LayerFrame& drawing = frame.layers[i];
    drawing.request = layer.drawable(frame.request);
    drawing.listened = layer.listens() && !frame.part;
    drawing.asked = layer.asksRays(number) && !frame.part;
    drawing.pagesNumber = layer.residency != nullptr ? layer.residency->pagesNumber(number) : 0;
    drawing.others = layer.residency != nullptr ? layer.residency->others(number) : 0;
    drawing.constants = constantsFor(layer, drawing.request);
    const FrameRequest& request = drawing.request;
    const PassConstants& constants = drawing.constants;
    FrameResources& resources = *drawing.resources;
    VCP_TRY(checkLimits(layer, request));
    VCP_TRY(resources.resize({request.width, request.height}, hitPlanesOf(request, constants)));
    resources.setBackground(backgroundRows(request));
    VCP_TRY(prepareTable(layer, drawing));
    drawing.imagesVersion = layer.residency != nullptr ? layer.residency->imagesVersion() : 0;
    drawing.images = constants.images ? shared->images[layer.number].words : nullptr;
    resources.setImages(drawing.images.get());
    if (shared->composes()) {
        VCP_TRY_ASSIGN(const bool isNew, frame.target.resize(*shared->device, resources.size(), frame.isLit));
        if (isNew) frame.surfaces = {};  // a handle may be used again
        resources.setTarget(&frame.layers.front().resources->picture(), &frame.target.depths(), frame.target.light());
    }
    if (drawing.reports()) VCP_TRY(drawing.feedback.prepare(*shared->device, resources, layer.table));
    return choosePipelines(frame, i);
}

Result<void> Renderer::View::choosePipelines(Frame& frame, size_t i) {
    const Layer& layer = layers[i];
    LayerFrame& drawing = frame.layers[i];
    const FrameRequest& request = drawing.request;
    const PassConstants& constants = drawing.constants;
    FrameResources& resources = *drawing.resources;
    if (shared->composes()) VCP_TRY(shared->compose.prepare(resources, constants, frame.isLit));
    if (frame.part && i == 0) {
        resources.setSums(sums.buffer(), frames[*drawn].layers.front().resources->picture());
        VCP_TRY(shared->accumulate.prepare(resources, constants));
    }
    VCP_TRY(shared->beam.prepare(resources, constants, request.beam));
    const Caps caps = layer.residency != nullptr ? capsOf(request, layer.residency->dataset()) : Caps::None;
    const SectionKind sections = sectionKind(request, caps);
    if (layer.isPaper())
        VCP_TRY(shared->paperTrace.prepare(resources, constants, sections != SectionKind::None, request.march));
    else
        VCP_TRY(shared->trace.prepare(resources, constants, sections));
    const ShadeLight light = frame.isLit                 ? ShadeLight::Scene
                             : hasLight(request.shading) ? ShadeLight::Own
                                                         : ShadeLight::None;
    if (light == ShadeLight::Own) VCP_TRY(shared->light.prepare(resources, constants));
    if (light == ShadeLight::Scene) VCP_TRY(shared->sceneLight.prepare(resources, constants));
    if (drawing.listened) VCP_TRY(shared->feedback.prepare(resources, constants));
    return shared->shade.prepare(resources, constants, light);
}

void Renderer::View::record(VkCommandBuffer commands, Frame& frame, const FrameStep& step, TileRange tiles) {
    const LayerFrame& drawing = frame.layers[step.layer];
    switch (step.pass) {
        case FrameStep::Pass::Beam:
            return recordBeam(commands, frame, step.layer);
        case FrameStep::Pass::Trace:
            if (layers[step.layer].isPaper())
                shared->paperTrace.record(commands, *drawing.resources);
            else
                shared->trace.record(commands, *drawing.resources, tiles);
            return;
        case FrameStep::Pass::Light:
            if (tiles.first == 0) drawing.timer.mark(commands, 2);
            return shared->light.record(commands, *drawing.resources, tiles);
        case FrameStep::Pass::Gather:
            drawing.timer.mark(commands, 2);
            shared->compose.record(commands, *drawing.resources);
            return barrierToAll(commands);
        case FrameStep::Pass::SceneLight:
        case FrameStep::Pass::SurfaceLight:
            if (tiles.first == 0 && &step == frame.firstLight()) {
                frame.lightTimer.reset(commands);
                frame.lightTimer.mark(commands, 0);
            }
            if (step.pass == FrameStep::Pass::SurfaceLight) return recordSurfaceRay(commands, frame, step.ray);
            return shared->sceneLight.record(commands, *drawing.resources, step.ray, tiles);
        case FrameStep::Pass::Surfaces:
            return recordSurfaceHits(commands, frame);
        case FrameStep::Pass::Shade:
            return recordShade(commands, frame, step.layer);
    }
}

void Renderer::View::recordBeam(VkCommandBuffer commands, Frame& frame, size_t i) {
    const Layer& layer = layers[i];
    LayerFrame& drawing = frame.layers[i];
    FrameResources& resources = *drawing.resources;
    const PassTimer& timer = drawing.timer;
    timer.reset(commands);
    frame::FrameConstants c =
        frameConstants(drawing.request, layer.residency != nullptr ? &layer.residency->dataset() : nullptr,
                       shared->stripes, drawing.constants.colour, layer.errorPixels, layer.placement);
    c.feedbackX = shared->feedback.jitter().x;
    c.feedbackY = shared->feedback.jitter().y;
    if (frame.isLit && drawing.request.shading.occlusionRadius <= 0)
        c.occlusionReach = float(occlusionRadius() / double(c.worldPerCell));
    if (frame.part) {
        c.partRow = frame.part->row;
        c.partRows = frame.part->rows;
        c.skippedRows = frame.part->skippedRows;
    }
    if (drawing.asked) c.firstHitMark = drawing.feedback.firstHitMark();
    if (drawing.reports()) drawing.feedback.clear(commands);
    resources.begin(commands, c);
    if (shared->composes() && i == 0) frame.target.clear(commands);
    timer.mark(commands, 0);
    shared->beam.record(commands, resources);
    timer.mark(commands, 1);
}

/// Records all that follows the rays.
void Renderer::View::recordShade(VkCommandBuffer commands, Frame& frame, size_t i) {
    LayerFrame& drawing = frame.layers[i];
    FrameResources& resources = *drawing.resources;
    const PassTimer& timer = drawing.timer;
    if (frame.isLit && i + 1 == layers.size()) frame.lightTimer.mark(commands, 1);
    if (frame.isLit)
        barrierComputeToCompute(commands);
    else if (!hasLight(drawing.request.shading))
        timer.mark(commands, 2);
    timer.mark(commands, 3);
    shared->shade.record(commands, resources);
    if (shared->composes() && !frame.isLit) shared->compose.record(commands, resources);
    timer.mark(commands, 4);
    if (drawing.listened) shared->feedback.record(commands);
    if (drawing.reports()) drawing.feedback.recordReadback(commands);
    timer.mark(commands, 5);
    resources.recordReadback(commands, frame.cursor);
    if (shared->composes() && (!frame.isLit || i == 0)) frame.target.recordReadback(commands);
}

MesoSurfacePass::Picture Renderer::View::underSurfaces(const Frame& frame) {
    return {&frame.layers.front().resources->picture(), &frame.target.depths(),
            frame.isLit ? frame.target.light() : nullptr};
}

void Renderer::View::recordSurfaceHits(VkCommandBuffer commands, Frame& frame) const {
    frame.surfacesTimer.reset(commands);
    frame.surfacesTimer.mark(commands, 0);
    shared->meso->pass->recordHits(commands, frame.surfaces, frame.request, underSurfaces(frame));
    if (frame.isLit) frame.surfacesTimer.mark(commands, 1);
}

void Renderer::View::recordSurfaceRay(VkCommandBuffer commands, const Frame& frame, const frame::SceneRay& ray) const {
    const Shading& shading = frame.request.shading;
    const double reach = shading.occlusionRadius > 0 ? shading.occlusionRadius : occlusionRadius();
    shared->meso->pass->recordRay(commands, frame.surfaces,
                                  {.number = ray.number,
                                   .isFirst = ray.isFirst,
                                   .isLast = ray.isLast,
                                   .occlusionRays = shading.occlusionRays,
                                   .sampleNumber = frame.request.sample,
                                   .reach = float(reach)});
}

/// Records what comes after the datasets' passes.
Result<void> Renderer::View::recordSurfaces(VkCommandBuffer commands, Frame& frame) {
    const Shared::Meso& meso = *shared->meso;
    if (!frame.isLit) {
        VCP_TRY(meso.pass->prepare(frame.surfaces, underSurfaces(frame), frame.request));
        recordSurfaceHits(commands, frame);
    }
    meso.pass->recordShade(commands, frame.surfaces, frame.request, frame.cursor);
    if (!frame.isLit) frame.surfacesTimer.mark(commands, 1);
    frame.stats.pipelines += meso.resources->pipelinesMade();
    frame.stats.surfaceBytes = meso.pass->assetBytes(), frame.stats.heightBytes = meso.pass->heightBytes();
    frame.stats.remeshedPixels = frame.surfaces.remeshed.certifiedPixels;
    frame.stats.uncertifiedPatches = frame.surfaces.remeshed.uncertified;
    return {};
}

FrameRequest Renderer::View::Layer::drawable(const FrameRequest& wanted) const {
    FrameRequest request = requestIn(placement, requestOfLook(wanted, number));
    if (!isPaper()) return request;
    request.beam = request.shading.shadows = false;
    request.sectionCaps = Caps::None;
    request.shading.occlusionRays = 0;
    return request;
}

Result<FrameStats> Renderer::render(const FrameRequest& request, const std::function<bool()>& cancel) {
    return view_->shared->tryAgain(*view_, [&] { return view_->draw(request, cancel); });
}

Result<void> Renderer::renderAhead(const FrameRequest& request, const std::optional<PicturePixel>& cursor) {
    return view_->shared->tryAgain(*view_, [&] { return view_->drawAhead(request, cursor); });
}

Result<bool> Renderer::continueFrame() {
    return view_->shared->tryAgain(*view_, [&] { return view_->drawStep(); });
}

bool Renderer::isUnfinished() const { return view_->begun.has_value(); }

double Renderer::finishedPart() const {
    if (!view_->begun) return 1;
    const View::Frame& frame = view_->frames[*view_->begun];
    // The other passes take next to nothing.
    double done = 0, all = 0;
    for (size_t i = 0; i < frame.steps.size(); ++i) {
        all += frame.steps[i].raysPerPixel;
        if (i < frame.nextStep) done += frame.steps[i].raysPerPixel;
    }
    if (frame.isUnfinished())
        if (const FrameStep& step = frame.steps[frame.nextStep]; frame.nextTile > 0)
            done += step.raysPerPixel * double(frame.nextTile) / View::tilesOf(frame, step);
    return all > 0 ? done / all : 0;
}

Result<FrameStats> Renderer::View::draw(const FrameRequest& request, const std::function<bool()>& cancel) {
    abandonFrame();
    drawn.reset();
    if (!shared->device || !isComplete()) return kGone;
    VCP_TRY(checkRequest(request));
    const DeviceWork before = shared->device->work();
    VCP_TRY(takeInAll());
    if (isCastOnHost()) {
        VCP_TRY(cast(0, request, {}, cancel));
    } else {
        VCP_TRY(submit(0, request, {}, false));
        VCP_TRY(takeInAll());
    }
    FrameStats& stats = lastDone->stats;
    stats.submissions = shared->device->work().submissions - before.submissions;
    stats.hostWaits = shared->device->work().waits - before.waits;
    drawn = 0;
    samples = 1, nextPart = 0;
    return stats;
}

Result<void> Renderer::View::drawAhead(const FrameRequest& request, const std::optional<PicturePixel>& cursor) {
    abandonFrame();
    const size_t next = drawn ? (*drawn + 1) % kFramesAhead : 0;
    const auto before = std::exchange(drawn, std::nullopt);
    if (!shared->device || !isComplete()) return kGone;
    VCP_TRY(checkRequest(request));
    const DeviceWork work = shared->device->work();
    Frame& frame = frames[next];
    VCP_TRY(shared->device->waitFor(frame.lastUse));
    VCP_TRY(takeInDone());
    VCP_TRY(makeLayers(frame));
    const bool isInside = cursor && cursor->x < request.width && cursor->y < request.height;
    const std::optional<PicturePixel> inside = isInside ? cursor : std::nullopt;
    // What takes long is drawn step by step, which the device's passes can.
    const bool isLong = request.shading.occlusionRays > 0 && raysOf(request) > kMostRaysAtOnce;
    VCP_TRY(!isLong && isCastOnHost() ? cast(next, request, inside, {}) : submit(next, request, inside, true));
    frame.isAhead = true;
    frame.stats.submissions = shared->device->work().submissions - work.submissions;
    frame.stats.hostWaits = shared->device->work().waits - work.waits;
    if (frame.isUnfinished()) {
        begun = next;
        drawn = before;  // what is shown until then
        return {};
    }
    drawn = next;
    samples = 1, nextPart = 0;
    return {};
}

Result<bool> Renderer::View::drawStep() {
    if (!shared->device) return kGone;
    if (!begun) return false;
    Frame& frame = frames[*begun];
    if (!shared->device->isDone(frame.submission)) return false;
    for (size_t i = 0; i < layers.size(); ++i) {
        refreshTable(layers[i]);
        // Pages have come and gone: the rest of the frame would not fit what is drawn of it.
        const bool isBegun =
            std::any_of(frame.steps.begin(), frame.steps.begin() + std::ptrdiff_t(frame.nextStep),
                        [&](const FrameStep& step) { return step.pass == FrameStep::Pass::Beam && step.layer == i; });
        if (!isBegun || layers[i].tableNumber == frame.layers[i].tableNumber) continue;
        abandonFrame();
        return false;
    }
    adaptSteps();
    VCP_TRY(submitSteps(frame, true));
    if (frame.isUnfinished()) return false;
    drawn = std::exchange(begun, std::nullopt);
    samples = 1, nextPart = 0;
    return true;
}

void Renderer::View::abandonFrame() {
    if (!begun) return;
    Frame& frame = frames[*std::exchange(begun, std::nullopt)];
    frame.steps.clear();
    frame.submission = 0;
}

uint64_t Renderer::View::raysOf(const FrameRequest& request) const {
    return uint64_t{request.width} * request.height * raysPerPixel(request, shared->meso != nullptr);
}

bool Renderer::View::isLit(const FrameRequest& request) const {
    if (!hasLight(request.shading)) return false;
    const auto shown = std::count_if(layers.begin(), layers.end(), [](const Layer& layer) { return layer.casts(); });
    if (!shared->meso) return shown > 1;
    // Surfaces alone cast shadows on each other by themselves.
    return shown > 0 || (shared->meso->marches() && request.shading.occlusionRays > 0);
}

double Renderer::View::occlusionRadius() const {
    std::vector<PictureDataset> shown;
    for (const Layer& layer : layers)
        if (layer.casts()) shown.push_back({layer.residency->dataset(), layer.placement});
    std::vector<WorldBox> boxes;
    if (shared->meso)
        for (const MesoSurface& each : shared->meso->surfaces)
            if (each.arrays) boxes.push_back({each.shell.low, each.shell.high});
    return occlusionRadiusAmong(shown, boxes);
}

/// All datasets are traced before any ray of light is cast. The first one is shaded last: of surfaces at one place it
/// is the one that is seen.
std::vector<FrameStep> Renderer::View::litStepsOf(const FrameRequest& request) const {
    std::vector<FrameStep> steps;
    std::vector<size_t> casters;
    for (size_t i = 0; i < layers.size(); ++i) {
        if (layers[i].casts()) casters.push_back(i);
        steps.push_back({FrameStep::Pass::Beam, i, 0});
        steps.push_back({FrameStep::Pass::Trace, i, layers[i].isPaper() ? 0u : 1u});
        steps.push_back({FrameStep::Pass::Gather, i, 0});
    }
    if (shared->meso) steps.push_back({FrameStep::Pass::Surfaces, 0, 0});
    const bool marches = shared->meso && shared->meso->marches();
    const auto addRay = [&](uint32_t ray) {
        for (const size_t i : casters)
            steps.push_back(
                {FrameStep::Pass::SceneLight, i, 1, {ray, i == casters.front(), i == casters.back() && !marches, 0}});
        if (marches) steps.push_back({FrameStep::Pass::SurfaceLight, 0, 0, {ray, casters.empty(), 1, 0}});
    };
    for (uint32_t ray = 0; ray < request.shading.occlusionRays; ++ray) addRay(ray);
    const auto lights = uint32_t(1 + request.shading.moreLights.size());
    for (uint32_t light = 0; castsShadows(request.shading) && light < lights; ++light) addRay(frame::kSunRay - light);
    for (size_t i = layers.size(); i-- > 0;) steps.push_back({FrameStep::Pass::Shade, i, 0});
    return steps;
}

std::vector<FrameStep> Renderer::View::stepsOf(const FrameRequest& request) const {
    if (isLit(request)) return litStepsOf(request);
    std::vector<FrameStep> steps;
    for (size_t i = 0; i < layers.size(); ++i) {
        const FrameRequest drawable = layers[i].drawable(request);
        steps.push_back({FrameStep::Pass::Beam, i, 0});
        steps.push_back({FrameStep::Pass::Trace, i, layers[i].isPaper() ? 0u : 1u});
        if (hasLight(drawable.shading)) steps.push_back({FrameStep::Pass::Light, i, raysPerPixel(drawable, false) - 1});
        steps.push_back({FrameStep::Pass::Shade, i, 0});
    }
    return steps;
}

uint32_t Renderer::View::tilesOf(const Frame& frame, const FrameStep& step) {
    const FrameResources& resources = *frame.layers[step.layer].resources;
    const bool all = step.pass == FrameStep::Pass::SceneLight;
    return all ? resources.size().tilesX() * resources.size().tilesY() : resources.counts().listedTiles;
}

TileRange Renderer::View::takeTiles(Frame& frame, bool one) const {
    const FrameStep& step = frame.steps[frame.nextStep];
    // The beams, a step of their own, are done, and have told how many there are.
    const uint32_t all = one && step.raysPerPixel > 0 ? tilesOf(frame, step) : 0;
    TileRange tiles;
    if (all > 0) {
        const uint64_t wanted = stepRays / (uint64_t{frame::kTileSize} * frame::kTileSize * step.raysPerPixel);
        const uint32_t column = frame.nextTile % frame::kTileRow;
        const auto count = uint32_t(std::clamp<uint64_t>(wanted, 1, all));
        tiles.first = frame.nextTile;
        tiles.count = column == 0 && count >= frame::kTileRow ? count / frame::kTileRow * frame::kTileRow
                                                              : std::min(count, frame::kTileRow - column);
        frame.nextTile += tiles.count;
        if (frame.nextTile < all) return tiles;
    }
    frame.nextTile = 0;
    ++frame.nextStep;
    return tiles;
}

void Renderer::View::adaptSteps() {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - stepBegan;
    if (took.count() > 2 * kStepSeconds) stepRays = std::max(stepRays / 2, kFewestStepRays);
    if (took.count() < kStepSeconds / 2) stepRays = std::min(stepRays * 2, kPartRays);
}

/// Submits a frame, or the first of its steps. Precondition: nothing in flight uses it.
Result<void> Renderer::View::submit(size_t which, const FrameRequest& request,
                                    const std::optional<PicturePixel>& cursor, bool mayTakeSteps) {
    Frame& frame = frames[which];
    frame.cast.reset();
    frame.request = request;
    frame.cursor = cursor;
    frame.stats = {.rays = uint64_t{request.width} * request.height};
    frame.isAhead = false;
    const bool isStepwise = mayTakeSteps && shared->info.software && raysOf(request) > kMostRaysAtOnce;
    frame.isLit = isLit(request);
    frame.steps = stepsOf(request);
    frame.nextStep = 0;
    frame.nextTile = 0;
    frame.began = std::chrono::steady_clock::now();
    return submitSteps(frame, isStepwise);
}

Result<void> Renderer::View::submitSteps(Frame& frame, bool one) {
    for (const Layer& layer : layers)
        if (layer.residency != nullptr) VCP_TRY(shared->needImages(layer.number));
    VCP_TRY_ASSIGN(auto commands, shared->device->beginCommands());
    barrierToAll(commands);
    std::optional<size_t> bound;  // the layer whose descriptor set is
    bool goesOn = true;
    while (frame.isUnfinished() && goesOn) {
        const FrameStep& step = frame.steps[frame.nextStep];
        if (step.pass == FrameStep::Pass::Beam) {
            VCP_TRY(prepare(frame, step.layer));
        } else if (step.pass == FrameStep::Pass::Surfaces) {
            VCP_TRY(shared->meso->pass->prepare(frame.surfaces, underSurfaces(frame), frame.request));
        } else if (!step.isOfSurfaces() && bound != step.layer) {
            VCP_TRY(choosePipelines(frame, step.layer));
            frame.layers[step.layer].resources->bind(commands);
        }
        record(commands, frame, step, takeTiles(frame, one));
        bound = step.isOfSurfaces() ? std::nullopt : std::optional(step.layer);
        if (one && step.pass == FrameStep::Pass::Beam) frame.layers[step.layer].resources->recordListedTiles(commands);
        goesOn = !one;
    }
    if (!frame.isUnfinished()) {
        addKnownStats(frame);
        if (shared->meso) VCP_TRY(recordSurfaces(commands, frame));
        if (frame.part) shared->accumulate.record(commands, *frame.layers.front().resources, frame.part->rows);
    }
    VCP_TRY_ASSIGN(const auto submission, shared->device->endCommands());
    frame.submission = frame.lastUse = submission;
    stepBegan = std::chrono::steady_clock::now();
    return {};
}

/// Adds what is known when a frame is submitted.
void Renderer::View::addKnownStats(Frame& frame) const {
    for (size_t i = 0; i < layers.size(); ++i) {
        for (const Frame& each : frames)
            if (i < each.layers.size()) frame.stats.pipelines += each.layers[i].resources->pipelinesMade();
        Residency* const residency = layers[i].residency;
        if (residency == nullptr) continue;
        frame.stats.colourBytes += residency->colourBytes();
        frame.stats.poolBytes = residency->pages().bytes();  // of all datasets
        frame.stats.pagesInCut += uint32_t(residency->cut(number).size());
    }
    frame.stats.feedbackPasses = shared->feedback.passes();
}

bool Renderer::isBusy() {
    Shared& s = *view_->shared;
    if (!s.device) return false;
    const auto inFlight = std::count_if(view_->frames.begin(), view_->frames.end(),
                                        [&](const View::Frame& frame) { return !s.device->isDone(frame.submission); });
    return size_t(inFlight) >= (s.info.software ? 1 : kFramesAhead);
}

bool Renderer::isDrawing() const {
    return std::any_of(view_->frames.begin(), view_->frames.end(),
                       [](const View::Frame& frame) { return frame.submission != 0; });
}

Result<void> Renderer::waitForFrame() {
    while (isBusy()) {
        uint64_t oldest = UINT64_MAX;
        for (const View::Frame& frame : view_->frames)
            if (!view_->shared->device->isDone(frame.submission)) oldest = std::min(oldest, frame.submission);
        const auto done = view_->shared->device->waitFor(oldest);
        // A lost device is found by the next update, which makes it anew.
        if (!done) return view_->shared->device->isLost() ? Result<void>() : done;
    }
    return {};
}

const std::optional<DoneFrame>& Renderer::lastDone() const { return view_->lastDone; }

Result<void> Renderer::View::takeInDone() {
    std::array<Frame*, std::tuple_size_v<decltype(frames)>> order;
    std::transform(frames.begin(), frames.end(), order.begin(), [](Frame& frame) { return &frame; });
    std::sort(order.begin(), order.end(), [](const Frame* a, const Frame* b) { return a->submission < b->submission; });
    for (Frame* frame : order)
        if (frame->submission != 0 && !frame->isUnfinished() && shared->device->isDone(frame->submission))
            VCP_TRY(takeIn(*frame));
    return {};
}

Result<void> Renderer::View::takeInAll() {
    uint64_t last = 0;
    for (const Frame& frame : frames) last = std::max({last, frame.submission, frame.lastUse});
    VCP_TRY(shared->device->waitFor(last));
    return takeInDone();
}

Result<void> Renderer::View::takeIn(Frame& frame) {
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - frame.began;
    frame.submission = 0;
    if (frame.part) return {};
    FrameStats stats = frame.stats;
    for (size_t i = 0; i < frame.layers.size(); ++i) VCP_TRY(addStats(frame, i, stats));
    if (frame.isLit) {
        VCP_TRY_ASSIGN(const auto ms, frame.lightTimer.read());
        stats.msLight = ms.front();
    }
    if (shared->composes()) stats.hitPixels = frame.target.hitPixels();
    MesoReport surfaces;
    if (shared->meso) {
        surfaces = frame.surfaces.report();
        VCP_TRY(addSurfaceStats(frame, stats));
        stats.missingHeights = shared->meso->pass->look(number, frame.surfaces);
        if (stats.missingHeights > 0) stats.remeshedPixels = 0;
        heightsRead = frame.request;
    }
    const double passes =
        stats.msBeam + stats.msTrace + stats.msLight + stats.msShade + stats.msFeedback + stats.msSurfaces;
    stats.msFrame = frame.isAhead && shared->device->timestampNanoseconds() > 0 ? passes : took.count();
    hear(frame);
    lastDone = {++framesDone, frame.request, stats, frame.cursor, std::nullopt};
    if (!frame.cursor) return {};
    std::vector<HitWords> words;
    for (const LayerFrame& layer : frame.layers) words.push_back(layer.resources->counts().cursor);
    lastDone->hit = nearestHit(frame.request, *frame.cursor, words, surfaces);
    return {};
}

Result<void> Renderer::View::addStats(const Frame& frame, size_t i, FrameStats& all) const {
    const LayerFrame& layer = frame.layers[i];
    const FrameCounts counts = layer.resources->counts();
    all.hitPixels += counts.counters.hitPixels;
    all.tracedRays += std::min<uint64_t>(all.rays, uint64_t{counts.listedTiles} * frame::kTileSize * frame::kTileSize);
    VCP_TRY_ASSIGN(const auto ms, layer.timer.read());
    all.msBeam += ms[0];
    all.msTrace += ms[1];
    if (!frame.isLit) all.msLight += ms[2];
    all.msShade += ms[3];
    all.msFeedback += ms[4];
    return {};
}

Result<void> Renderer::View::addSurfaceStats(const Frame& frame, FrameStats& all) const {
    VCP_TRY_ASSIGN(const auto ms, frame.surfacesTimer.read());
    all.msSurfaces = ms.front();
    const MesoCounts counts = frame.surfaces.report().counts;
    all.unresolvedRays = counts.unresolvedRays, all.farHits = counts.farHits, all.hitPixels = counts.hitPixels;
    return {};
}

/// Hands what the rays hit and asked for to the residencies.
void Renderer::View::hear(const Frame& frame) {
    std::vector<SeenPages> seen;
    for (size_t i = 0; i < frame.layers.size(); ++i) {
        const LayerFrame& layer = frame.layers[i];
        if (!layer.asked) continue;
        Residency& residency = *layers[i].residency;
        const bool isOfNow = layer.others == residency.others(number);
        seen.push_back(
            {&residency, layer.feedback.pagesHit(), selectionView(layer.request), isOfNow ? layer.pagesNumber : 0});
    }
    seeAll(std::move(seen), number);
    if (std::any_of(frame.layers.begin(), frame.layers.end(), [](const LayerFrame& layer) { return layer.listened; }))
        feedbackPicture.reset();
    for (size_t i = 0; i < frame.layers.size(); ++i) {
        if (!frame.layers[i].listened) continue;
        const RayFeedback heard = frame.layers[i].feedback.read();
        const SelectionView view = selectionView(frame.layers[i].request);
        if (keepsFeedback) keep(heard, view, layers[i].residency->dataset());
        layers[i].residency->hear(heard, view);
    }
}

void Renderer::View::keep(const RayFeedback& heard, const SelectionView& view, const Dataset& dataset) {
    if (!feedbackPicture) feedbackPicture.emplace().errorPixels.fill(-1);
    const glm::dvec3 corner = dataset.originOf(dataset.pages[0]);
    const double unit = std::ldexp(dataset.edgeOf(dataset.pages[0]), -int(frame::kLatticeBits));
    for (const RayFeedback::Hit& hit : heard.hits) {
        const double distance = view.orthographic ? 1 : glm::length(corner + glm::dvec3(hit.place) * unit - view.eye);
        const double error =
            refinedError(dataset, dataset.pages[hit.page], view) * view.pixelsPerUnit / std::max(distance, unit);
        float& kept = feedbackPicture->errorPixels[hit.ray];
        kept = std::max(kept, float(error));
    }
}

}  // namespace vcp
