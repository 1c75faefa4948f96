// Renderer: drawing.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"
#include "render/renderer_state.h"

namespace vcp {

namespace {

/// Adds the counts of another dataset; pixels that are hit are counted where pictures are composed.
void add(FrameStats& all, const FrameStats& one) {
    all.tracedRays += one.tracedRays;
    all.msBeam += one.msBeam;
    all.msTrace += one.msTrace;
    all.msLight += one.msLight;
    all.msShade += one.msShade;
    all.msFeedback += one.msFeedback;
    all.msFrame += one.msFrame;
    all.steps += one.steps;
    all.fetches += one.fetches;
    all.poolBytes += one.poolBytes;
    all.colourBytes += one.colourBytes;
    all.pagesInCut += one.pagesInCut;
    all.pipelines += one.pipelines;
    all.feedbackPasses = one.feedbackPasses;
}

MesoShading mesoShading(ShadingMode mode) {
    switch (mode) {
        case ShadingMode::Normals:
            return MesoShading::Normals;
        case ShadingMode::Unlit:
            return MesoShading::Unlit;
        case ShadingMode::Steps:
            return MesoShading::Heat;
        default:
            return MesoShading::Lit;
    }
}

MesoLook mesoLook(const FrameRequest& request) {
    const PictureTile tile = wholePicture(request);
    const LightDirections directions =
        lightDirections(request, cameraBasis(request.camera, tile.fullWidth, tile.fullHeight));
    return {request.camera,          tile,
            directions.light,        directions.sky,
            request.shading.shadows, mesoShading(request.shading.mode),
            request.errorPixels};
}

}  // namespace

PassConstants Renderer::State::constantsFor(const Layer& layer, const FrameRequest& request) const {
    PassConstants c;
    c.access = access;
    if (const Residency* residency = layer.residency) {
        c.poolChunks = residency->pages().chunks();
        c.chunkShift = residency->pages().chunkShift();
        c.colour = residency->hasColour();
    }
    c.falseColour = isFalseColour(request.shading.mode);
    c.countSteps = request.countSteps || showsWork(request.shading.mode);
    return c;
}

Result<void> Renderer::State::checkLimits(const Layer& layer, const FrameRequest& request) const {
    const uint64_t words = uint64_t{request.width} * request.height *
                           hitPlanes(request, layer.residency != nullptr && layer.residency->hasColour());
    const VkPhysicalDeviceLimits& limits = device->limits();
    if (words * 4 <= limits.maxStorageBufferRange && words <= limits.maxTexelBufferElements) return {};
    return Error{
        .code = ErrorCode::Limit,
        .message = fmt::format("{} x {} pixels are more than '{}' can address at once; at most {} pixels",
                               request.width, request.height, device->info().name,
                               std::min<uint64_t>(limits.maxStorageBufferRange / 4, limits.maxTexelBufferElements) /
                                   (words / (uint64_t{request.width} * request.height)))};
}

Result<void> Renderer::State::prepareTable(Layer& layer) {
    const uint64_t version = layer.residency != nullptr ? layer.residency->version() : 0;
    if (!layer.tableStale && version == layer.tableVersion) return {};
    auto next = layer.residency != nullptr ? layer.residency->table(number)
                                           : std::vector<glm::uvec4>(frame::kRecordTexels, glm::uvec4(0));
    if (layer.tableStale || next != layer.table) VCP_TRY(layer.resources->setTable(next));
    layer.table = std::move(next);
    layer.tableVersion = version;
    layer.tableStale = false;
    return {};
}

Result<void> Renderer::State::prepare(Layer& layer, const FrameRequest& request) {
    VCP_TRY(checkLimits(layer, request));
    const auto& resources = layer.resources;
    const PassConstants& constants = layer.constants = constantsFor(layer, request);
    VCP_TRY(resources->resize({request.width, request.height}, hitPlanes(request, constants.colour)));
    resources->setBackground(backgroundRows(request));
    VCP_TRY(prepareTable(layer));
    if (composes()) {
        VCP_TRY(target.resize(*device, resources->size()));
        resources->setTarget(&layers.front().resources->picture(), &target.depths());
        VCP_TRY(compose.prepare(*resources, constants));
    }
    VCP_TRY(beam.prepare(*resources, constants, request.beam));
    const SectionKind sections = request.sections.empty() ? SectionKind::None
                                 : request.sectionCaps    ? SectionKind::Capped
                                                          : SectionKind::Open;
    if (layer.isPaper())
        VCP_TRY(paperTrace.prepare(*resources, constants, sections != SectionKind::None, request.march));
    else
        VCP_TRY(trace.prepare(*resources, constants, sections));
    const bool traceLight = hasLight(request.shading);
    if (traceLight) VCP_TRY(light.prepare(*resources, constants));
    if (layer.listens()) VCP_TRY(feedback.prepare(*device, *resources, constants, layer.table));
    return shade.prepare(*resources, constants, traceLight);
}

void Renderer::State::recordFrame(VkCommandBuffer commands, const Layer& layer, const FrameRequest& request) {
    const auto& resources = layer.resources;
    timer.reset(commands);
    frame::FrameConstants c =
        frameConstants(request, layer.residency != nullptr ? &layer.residency->dataset() : nullptr, stripes,
                       layer.constants.colour, layer.errorPixels, layer.placement);
    c.feedbackX = feedback.jitter().x;
    c.feedbackY = feedback.jitter().y;
    resources->begin(commands, c);
    if (composes() && &layer == &layers.front()) target.clear(commands);
    timer.mark(commands, 0);
    beam.record(commands, *resources);
    timer.mark(commands, 1);
    if (layer.isPaper())
        paperTrace.record(commands, *resources);
    else
        trace.record(commands, *resources);
    timer.mark(commands, 2);
    if (hasLight(request.shading)) light.record(commands, *resources);
    timer.mark(commands, 3);
    shade.record(commands, *resources);
    if (composes()) compose.record(commands, *resources);
    timer.mark(commands, 4);
    if (layer.listens()) feedback.record(commands);
    timer.mark(commands, 5);
    resources->recordReadback(commands);
    if (composes()) target.recordReadback(commands);
}

FrameRequest Renderer::State::Layer::drawable(const FrameRequest& wanted) const {
    FrameRequest request = requestIn(placement, wanted);
    if (!isPaper()) return request;
    request.beam = request.sectionCaps = request.shading.shadows = false;
    request.shading.occlusionRays = 0;
    return request;
}

Result<FrameStats> Renderer::render(const FrameRequest& request) {
    return state_->tryAgain([&] { return state_->draw(request); });
}

Result<FrameStats> Renderer::State::draw(const FrameRequest& request) {
    drawn.reset();
    if (!device || !isComplete()) return kGone;
    VCP_TRY(checkRequest(request));
    const DeviceWork before = device->work();
    if (std::any_of(layers.begin(), layers.end(), [](const Layer& layer) { return layer.listens(); }))
        feedbackPicture.reset();
    std::optional<FrameStats> all;
    for (Layer& layer : layers) {
        layer.drawn = layer.drawable(request);
        auto stats = drawLayer(layer, layer.drawn);
        if (!stats) return stats;
        if (all)
            add(*all, *stats);
        else
            all = *stats;
    }
    if (shared->meso) {
        VCP_TRY(drawSurfaces(request, *all));
    } else if (composes()) {
        all->hitPixels = target.hitPixels();
    }
    drawn = request;
    all->submissions = device->work().submissions - before.submissions;
    all->hostWaits = device->work().waits - before.waits;
    return *all;
}

Result<FrameStats> Renderer::State::drawLayer(Layer& layer, const FrameRequest& request) {
    VCP_TRY(prepare(layer, request));
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY(device->submitAndWait([&](VkCommandBuffer commands) { recordFrame(commands, layer, request); }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    if (layer.listens()) {
        const RayFeedback heard = feedback.read();
        const SelectionView view = selectionView(request);
        if (keepsFeedback) keep(heard, view, layer.residency->dataset());
        layer.residency->hear(heard, view);
    }
    auto stats = collectStats(layer, request);
    if (stats) stats->msFrame = took.count();
    return stats;
}

Result<void> Renderer::State::drawSurfaces(const FrameRequest& request, FrameStats& stats) {
    const Shared::Meso& meso = *shared->meso;
    const Buffer& picture = layers.front().resources->picture();
    const MesoLook look = mesoLook(request);
    VCP_TRY(meso.pass->prepare(mesoTarget, {request.width, request.height}, picture, look.shadows));
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY(device->submitAndWait([&](VkCommandBuffer commands) {
        meso.timer.reset(commands);
        meso.timer.mark(commands, 0);
        meso.pass->record(commands, mesoTarget, look, target.depths());
        meso.timer.mark(commands, 1);
    }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    const MesoCounts counts = mesoTarget.counts();
    VCP_TRY_ASSIGN(const auto ms, meso.timer.read());
    stats.msFrame += took.count();
    stats.msSurfaces = ms.front();
    stats.unresolvedRays = counts.unresolvedRays, stats.farHits = counts.farHits, stats.hitPixels = counts.hitPixels;
    stats.pipelines += meso.resources->pipelinesMade();
    stats.surfaceBytes = meso.pass->assetBytes();
    return {};
}

void Renderer::State::keep(const RayFeedback& heard, const SelectionView& view, const Dataset& dataset) {
    if (!feedbackPicture) feedbackPicture.emplace().errorPixels.fill(-1);
    const glm::dvec3 corner = dataset.originOf(dataset.pages[0]);
    const double unit = std::ldexp(dataset.edgeOf(dataset.pages[0]), -int(frame::kLatticeBits));
    for (const RayFeedback::Hit& hit : heard.hits) {
        const double distance = view.orthographic ? 1 : glm::length(corner + glm::dvec3(hit.place) * unit - view.eye);
        const double error =
            double(dataset.pages[hit.page].certifiedError) * view.pixelsPerUnit / std::max(distance, unit);
        float& kept = feedbackPicture->errorPixels[hit.ray];
        kept = std::max(kept, float(error));
    }
}

Result<FrameStats> Renderer::State::collectStats(const Layer& layer, const FrameRequest& request) const {
    const auto& resources = layer.resources;
    FrameStats stats;
    stats.rays = uint64_t{request.width} * request.height;
    const FrameCounts counts = resources->counts();
    stats.hitPixels = counts.counters.hitPixels;
    stats.tracedRays =
        std::min<uint64_t>(stats.rays, uint64_t{counts.listedTiles} * frame::kTileSize * frame::kTileSize);
    stats.steps = counts.counters.steps;
    stats.fetches = counts.counters.fetches;
    VCP_TRY_ASSIGN(auto ms, timer.read());
    stats.msBeam = ms[0];
    stats.msTrace = ms[1];
    stats.msLight = ms[2];
    stats.msShade = ms[3];
    stats.msFeedback = ms[4];
    stats.feedbackPasses = feedback.passes();
    stats.pipelines = resources->pipelinesMade();
    if (Residency* const residency = layer.residency) {
        stats.colourBytes = residency->colourBytes();
        stats.poolBytes = residency->pages().bytes();
        stats.pagesInCut = uint32_t(residency->cut(number).size());
    }
    return stats;
}

}  // namespace vcp
