#include "viewer/bench/motion_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "builder/measure/quantile.h"
#include "viewer/scene/environment.h"

namespace vcp {

namespace {

constexpr double kNearest = 1.0 / 3;
constexpr double kLongestRest = 60;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Returns the camera after a part of the way.
OrbitCamera cameraAt(const OrbitCamera& start, glm::dvec3 centre, double part) {
    OrbitCamera camera = start;
    camera.orbit(centre, 2 * std::numbers::pi * part, 0);
    const double near = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * part);
    camera.zoomAbout(centre, std::pow(kNearest, near));
    return camera;
}

class Motion {
public:
    Motion(Viewer& viewer, const MotionOptions& options) : viewer_(viewer), options_(options) {}

    Result<bool> turn() {
        if (options_.cancel && options_.cancel()) return Error::cancelled();
        VCP_TRY_ASSIGN(const auto next, viewer_.update(seconds()));
        if (!next.draw) {
            std::this_thread::sleep_for(std::chrono::duration<double>(std::clamp(next.waitSeconds, 0.0, 0.002)));
            return false;
        }
        VCP_TRY(viewer_.draw());
        return true;
    }

    /// Waits until all is read and drawn, and a second frame at full size has been timed: the first one compiles.
    Result<void> settle() {
        for (bool again = true;;) {
            VCP_TRY_ASSIGN(const auto drew, turn());
            if (drew || !viewer_.status().update.settled) continue;
            if (!std::exchange(again, false)) return {};
            viewer_.act(ViewerAction::ToggleLight);
        }
    }

private:
    Viewer& viewer_;
    const MotionOptions& options_;
};

}  // namespace

double MotionReport::quantileMs(double part) const { return quantile(frameMs, part); }

Result<MotionReport> measureMotion(const OpenedScene& scene, const MotionOptions& options) {
    ViewerOptions viewerOptions = options.viewer;
    viewerOptions.framesAhead = true;
    setSceneLight(viewerOptions.shading, scene, options.viewer.shading);
    const Box bounds = scene.bounds();
    VCP_TRY_ASSIGN(auto viewer, Viewer::create(viewerOptions));
    OrbitCamera start;
    start.look(View::Front, bounds, options.size);
    if (scene.file.camera) start = *scene.file.camera;
    viewer->resize(options.size);
    VCP_TRY(viewer->open(scene.placed(), scene.surfaces, start, "motion"));
    Motion motion(*viewer, options);
    VCP_TRY(motion.settle());
    MotionReport report;
    report.device = viewer->status().device;
    report.size = options.size;
    report.stillMs = viewer->status().frame.msFrame;
    const double began = seconds();
    double last = began;
    while (last - began < options.seconds) {
        if (const auto waited = viewer->waitForFrame(); !waited) return waited.error();
        viewer->setCamera(cameraAt(start, bounds.centre(), (seconds() - began) / options.seconds));
        VCP_TRY_ASSIGN(const auto drew, motion.turn());
        const double now = seconds();
        if (drew) {
            report.frameMs.push_back(1e3 * (now - last));
            ++report.byReduction[viewer->status().reduction];
        }
        last = drew ? now : last;
        report.seconds = now - began;
        if (!drew && report.seconds > 2 * options.seconds) break;
    }
    // The camera rests from here on, until the frame at full size is there.
    const double stopped = seconds();
    while (!report.fullSizeAfterMs && seconds() - stopped <= kLongestRest) {
        VCP_TRY(motion.turn());
        const bool isDone = !viewer->renderer().isDrawing();
        if (isDone && viewer->status().reduction == 1) report.fullSizeAfterMs = 1e3 * (seconds() - stopped);
    }
    return report;
}

std::string motionJson(const MotionReport& report) {
    nlohmann::ordered_json sizes = nlohmann::ordered_json::object();
    for (const auto& [reduction, frames] : report.byReduction)
        sizes[reduction == 1 ? "1" : fmt::format("1/{}", reduction)] = frames;
    nlohmann::ordered_json after;  // null: it was never drawn
    if (report.fullSizeAfterMs) after = *report.fullSizeAfterMs;
    const nlohmann::ordered_json json = {{"width", report.size.x},
                                         {"height", report.size.y},
                                         {"device", report.device},
                                         {"seconds", report.seconds},
                                         {"frames", report.frameMs.size()},
                                         {"frames_per_second", report.framesPerSecond()},
                                         {"median_ms", report.quantileMs(0.5)},
                                         {"ms_95", report.quantileMs(0.95)},
                                         {"worst_ms", report.quantileMs(1)},
                                         {"still_ms", report.stillMs},
                                         {"full_size_after_ms", after},
                                         {"frames_by_size", sizes}};
    return json.dump(2);
}

std::string motionText(const MotionReport& report) {
    std::string sizes;
    for (const auto& [reduction, frames] : report.byReduction)
        sizes += fmt::format("{}{} at {}", sizes.empty() ? "" : ", ", frames,
                             reduction == 1 ? std::string("full size") : fmt::format("1/{}", reduction));
    return fmt::format(
        "{} x {} on {}: {} frames in {:.1f} s, {:.1f} a second\n  median {:.1f} ms, 95 % {:.1f} ms, worst {:.1f} ms; "
        "at rest {:.1f} ms, {}\n  {}",
        report.size.x, report.size.y, report.device, report.frameMs.size(), report.seconds, report.framesPerSecond(),
        report.quantileMs(0.5), report.quantileMs(0.95), report.quantileMs(1), report.stillMs,
        report.fullSizeAfterMs ? fmt::format("at full size {:.0f} ms after the motion", *report.fullSizeAfterMs)
                               : "never at full size again",
        sizes);
}

}  // namespace vcp
