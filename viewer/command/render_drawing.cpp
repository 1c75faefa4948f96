// Drawing and reporting of `vcp render`.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <fmt/format.h>

#include "builder/measure/quantile.h"
#include "render/pixel_samples.h"
#include "viewer/asset/share_out.h"
#include "viewer/command/method_panels.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/render_command.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/picture/image_files.h"
#include "viewer/scene/option_values.h"
#include "viewer/viewer.h"

namespace vcp {

namespace {

constexpr std::chrono::milliseconds kWait(100);

/// What the frames cost and showed.
struct Drawing {
    UpdateResult update;
    FrameStats stats;         ///< statistics of the last frame
    double firstFrameMs = 0;  ///< time of the frame before those, with what is compiled on first use
    std::vector<double> frameMs;
    uint32_t samples = 1;
    double samplesMs = 0;  ///< time of all samples of the picture together

    /// Returns the median of the timed frames, or the time of the first where none was timed.
    [[nodiscard]] double medianMs() const { return frameMs.empty() ? firstFrameMs : upperQuantile(frameMs, 0.5); }
    [[nodiscard]] double raysPerSecond() const { return double(stats.rays) / std::max(1e-3 * medianMs(), 1e-9); }
};

/// Without --settle: updates until the coarsest page is there, and draws what there is.
Result<SettledFrame> drawWhenDrawable(PictureRenderer& renderer, const FrameRequest& request) {
    for (;;) {
        VCP_TRY_ASSIGN(auto update, renderer.update(request));
        if (update.drawable || !update.problems.empty() || update.settled) {
            VCP_TRY_ASSIGN(const auto stats, renderer.render(request, interrupted));
            return SettledFrame{std::move(update), stats};
        }
        if (interrupted()) return Error::cancelled();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

/// Adds the other samples to the last frame, with progress.
Result<void> refine(PictureRenderer& renderer, const FrameRequest& request, const RenderCommand& command,
                    Drawing& drawing) {
    const auto began = std::chrono::steady_clock::now();
    drawing.samples = samplesOf(request, command.samples);
    ProgressDisplay display(command.report.progressStyle(), stderr);
    VCP_TRY(renderer.refineTo(drawing.samples, request, interrupted, [&](uint32_t samples) {
        display.update("drawing samples", double(samples) / drawing.samples);
    }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    drawing.samplesMs = drawing.medianMs() + took.count();
    return {};
}

Result<Drawing> draw(PictureRenderer& renderer, const FrameRequest& request, const RenderCommand& command) {
    VCP_TRY_ASSIGN(auto first,
                   command.settle ? renderer.drawSettled(request, interrupted) : drawWhenDrawable(renderer, request));
    if (!first.update.problems.empty()) return first.update.problems.front();
    Drawing drawing;
    drawing.update = std::move(first.update);
    drawing.stats = first.stats;
    drawing.firstFrameMs = first.stats.msFrame;
    for (int i = 0; i < command.framesToTime(); ++i) {
        if (interrupted()) return Error::cancelled();
        VCP_TRY_ASSIGN(drawing.stats, renderer.render(request, interrupted));
        drawing.frameMs.push_back(drawing.stats.msFrame);
    }
    VCP_TRY(refine(renderer, request, command, drawing));
    return drawing;
}

/// Writes depth and normals of the last frame, where they are asked for.
Result<void> writePlanes(PictureRenderer& renderer, const FrameRequest& request, const RenderCommand& command,
                         const OutputRules& rules) {
    if (!command.depth.empty()) {
        VCP_TRY_ASSIGN(const auto depth, renderer.readDepth());
        VCP_TRY(writeDepth(depth, request.width, request.height, command.depth, rules));
    }
    if (!command.normals.empty()) {
        VCP_TRY_ASSIGN(const auto normals, renderer.readNormals());
        VCP_TRY(writeNormals(normals, request.width, request.height, command.normals, rules));
    }
    return {};
}

Json toJson(const Drawing& drawing, const DeviceInfo& device, const FrameRequest& request, const OrbitCamera& camera) {
    const FrameStats& stats = drawing.stats;
    return {{"width", request.width},
            {"height", request.height},
            {"frames", std::max<size_t>(drawing.frameMs.size(), 1)},
            {"ms_per_frame", drawing.medianMs()},
            {"first_frame_ms", drawing.firstFrameMs},
            {"samples", drawing.samples},
            {"ms_samples", drawing.samplesMs},
            {"ms_beam", stats.msBeam},
            {"ms_trace", stats.msTrace},
            {"ms_light", stats.msLight},
            {"ms_shade", stats.msShade},
            {"ms_surfaces", stats.msSurfaces},
            {"rays_per_second", drawing.raysPerSecond()},
            {"rays", stats.rays},
            {"traced_rays", stats.tracedRays},
            {"hit_pixels", stats.hitPixels},
            {"unresolved_rays", stats.unresolvedRays},
            {"far_hits", stats.farHits},
            {"surface_bytes", stats.surfaceBytes},
            {"remeshed_pixels", stats.remeshedPixels},
            {"missing_heights", stats.missingHeights},
            {"height_bytes", stats.heightBytes},
            {"uncertified_patches", stats.uncertifiedPatches},
            {"device", castBy(device, stats.onHost)},
            {"software", device.software},
            {"settled", drawing.update.settled},
            {"detail", nameOf(detailOf(drawing.update, request.errorPixels))},
            {"error_pixels", drawing.update.errorPixels},
            {"colour_pixels", drawing.update.colourPixels},
            {"limited_by", nameOf(detailLimitOf(drawing.update))},
            {"subvolumes_in_cut", stats.pagesInCut},
            {"resident_bytes", drawing.update.residentBytes},
            {"bytes_read", drawing.update.bytesRead},
            {"pipelines", stats.pipelines},
            {"camera", Json::parse(cameraToJson(camera))}};
}

std::string summary(const RenderCommand& command, const Drawing& drawing, const DeviceInfo& device,
                    double askedPixels) {
    const UpdateResult& update = drawing.update;
    const std::string remeshed = remeshedText(drawing.stats);
    std::string error;
    if (std::isfinite(update.errorPixels)) error = fmt::format("error {:.2g} pixels", update.errorPixels);
    if (!remeshed.empty()) error += (error.empty() ? "remeshed " : ", remeshed ") + remeshed;
    if (error.empty()) error = "no certified error";
    if (update.colourPixels > 0) error += fmt::format(", colours off within {:.2g}", update.colourPixels);
    const std::string samples = drawing.samples > 1 ? fmt::format(", {} samples in {}", drawing.samples,
                                                                  formatSeconds(1e-3 * drawing.samplesMs))
                                                    : "";
    return fmt::format("{}: {}, {} in {:.1f} ms ({:.1f} M rays/s){} on {}{}\n  {} part{}, {} of memory, {}, {}",
                       command.output, sizeText(command.size), drawing.frameMs.empty() ? "first frame" : "a frame",
                       drawing.medianMs(), 1e-6 * drawing.raysPerSecond(), samples,
                       castBy(device, drawing.stats.onHost), device.software ? " (software)" : "", update.pagesInCut,
                       update.pagesInCut == 1 ? "" : "s", formatBytes(update.residentBytes), error,
                       textOf(detailOf(update, askedPixels)));
}

/// Prints a line about the picture, or returns its figures, for --json.
Result<Json> report(const RenderCommand& command, const Drawing& drawing, const std::vector<MethodPanel>& panels,
                    const DeviceInfo& device, const FrameRequest& request, const OrbitCamera& camera) {
    if (command.report.json) {
        Json json = toJson(drawing, device, request, camera);
        if (panels.front().iterationsMean) json["iterations_mean"] = *panels.front().iterationsMean;
        for (const MethodPanel& panel : panels)
            if (!command.methods.empty()) json["methods"].push_back(toJson(panel));
        return json;
    }
    std::string text = summary(command, drawing, device, request.errorPixels);
    for (const MethodPanel& panel : panels)
        if (!command.methods.empty()) text += "\n  " + summary(panel);
    VCP_TRY(printLineAbout(command.output, text));
    return Json();
}

Json toJson(const TiledPictureStats& total, size_t pictures, uint32_t samples, const DeviceInfo& device,
            const FrameRequest& request) {
    return {{"width", request.width},
            {"height", request.height},
            {"pictures", pictures},
            {"tiles", total.tiles},
            {"ms_per_frame", total.ms / double(pictures)},
            {"rays_per_second", double(total.rays) / std::max(1e-3 * total.ms, 1e-9)},
            {"samples", samples},
            {"rays", total.rays},
            {"hit_pixels", total.hitPixels},
            {"remeshed_pixels", total.missingHeights > 0 ? 0 : total.remeshedPixels},
            {"missing_heights", total.missingHeights},
            {"uncertified_patches", total.uncertifiedPatches},
            {"device", castBy(device, total.onHost)},
            {"software", device.software},
            {"settled", total.update.settled},
            {"detail", nameOf(detailOf(total.update, request.errorPixels))},
            {"error_pixels", total.errorPixels},
            {"colour_pixels", total.colourPixels},
            {"limited_by", nameOf(detailLimitOf(total.update))},
            {"resident_bytes", total.update.residentBytes},
            {"bytes_read", total.update.bytesRead}};
}

/// `hits`: pixels where something is seen, of one picture or of all.
void warnOfEmptyPicture(uint64_t hits, const FrameRequest& request) {
    if (hits > 0) return;
    warnOnTerminal(fmt::format("nothing is seen: the camera looks elsewhere{}",
                               request.sections.empty() ? "" : ", or the section cuts all of it away"));
}

}  // namespace

void reportMeasuring(std::span<MesoSurface> surfaces, ProgressStyle style) {
    for (MesoSurface& surface : surfaces)
        surface.remeshed.options.shareOut = [style](size_t count,
                                                    const std::function<void(size_t first, size_t last)>& fill) {
            // Only a first view measures for long.
            constexpr std::chrono::milliseconds kSilent(500);
            const auto began = std::chrono::steady_clock::now();
            ProgressDisplay display(style, stderr);
            return shareOut(count, fill, [&](double part) {
                if (std::chrono::steady_clock::now() - began > kSilent) display.update("measuring heights", part);
                return !interrupted();
            });
        };
}

Result<void> checkValidation(const PictureRenderer& renderer) {
    const std::vector<std::string> problems = renderer.validationMessages();
    return problems.empty() ? Result<void>() : Error{.code = ErrorCode::Device, .message = problems.front()};
}

Result<Json> drawOne(PictureRenderer& renderer, const FrameRequest& request, const OrbitCamera& camera,
                     const PaintRows& paintOver, const RenderCommand& command, const SceneFile& scene,
                     const OutputRules& rules) {
    std::vector<std::string> methods = command.methods;
    if (methods.empty()) methods.emplace_back();
    std::optional<Drawing> first;
    std::vector<MethodPanel> panels;
    for (const std::string& method : methods) {
        if (first) {
            ProgressDisplay display(command.report.progressStyle(), stderr);
            VCP_TRY_ASSIGN(auto surfaces, surfacesBy(method, scene, [&](const char* stage, double part) {
                               display.update(stage, part);
                               return !interrupted();
                           }));
            display.finish();
            reportMeasuring(surfaces.surfaces, command.report.progressStyle());
            VCP_TRY(renderer.setSurfaces(surfaces.surfaces));
        }
        VCP_TRY_ASSIGN(auto drawing, draw(renderer, request, command));
        VCP_TRY_ASSIGN(auto panel,
                       readPanel(renderer, method, !scene.surfaces.empty(), drawing.stats, drawing.medianMs()));
        if (drawing.stats.unresolvedRays > 0)
            warnOnTerminal(fmt::format(
                "{} rays of mesostructure were given up: too many pieces of a base, or of its map, along them",
                drawing.stats.unresolvedRays));
        if (paintOver) paintOver(0, panel.picture, 0);
        panels.push_back(std::move(panel));
        if (!first) first = std::move(drawing);
    }
    VCP_TRY(checkValidation(renderer));
    VCP_TRY(writePlanes(renderer, request, command, rules));
    VCP_TRY(writePng(sideBySide(panels), command.output, rules));
    warnOfEmptyPicture(first->stats.hitPixels, request);
    return report(command, *first, panels, renderer.device(), request, camera);
}

Result<Json> makeTiled(PictureRenderer& renderer, const FrameRequest& request, const PictureCourse& course,
                       const PaintRows& paintOver, const RenderCommand& command, const OutputRules& rules) {
    ProgressDisplay display(command.report.progressStyle(), stderr);
    std::vector<Camera> current;
    for (const OrbitCamera& each : course.cameras) current.push_back(each.current());
    PictureSequence sequence(renderer, {.request = request,
                                        .cameras = std::move(current),
                                        .surfacesMoved = course.surfacesMoved,
                                        .files = {command.output, command.depth, command.normals},
                                        .isNumbered = command.isSequence(),
                                        .framesPerSecond = command.framesPerSecond,
                                        .tile = command.tile > 0 ? command.tile : kUsualTile,
                                        .samples = command.samples,
                                        .rules = rules,
                                        .paintOver = paintOver,
                                        .cancel = interrupted});
    for (bool isDone = false; !isDone;) {
        VCP_TRY_ASSIGN(isDone, sequence.step());
        display.update("drawing", sequence.fraction());
        if (!isDone && interrupted()) return Error::cancelled();
        if (sequence.isWaiting()) renderer.waitForPage(kWait);
    }
    display.finish();
    const TiledPictureStats& total = sequence.stats();
    warnOfEmptyPicture(total.hitPixels, request);
    if (command.report.json)
        return toJson(total, course.cameras.size(), samplesOf(request, command.samples), renderer.device(), request);
    const std::string first = command.fileOf(command.output, 1).string();
    const std::string last = command.fileOf(command.output, course.cameras.size()).string();
    const std::string name = first == last ? first : fmt::format("{} to {}", first, last);
    const std::string drawn = course.cameras.size() > 1 ? fmt::format("{} pictures", course.cameras.size())
                                                        : fmt::format("{} tiles", total.tiles);
    VCP_TRY(printLineAbout(command.output, fmt::format("{}: {}, {} in {}", name, sizeText(command.size), drawn,
                                                       formatSeconds(1e-3 * total.ms))));
    return Json();
}

}  // namespace vcp
