#include "viewer/view_session.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "streaming/http_reader.h"

namespace vcp {

namespace {

// How often what goes on in other threads is looked at.
constexpr double kOpeningPollSeconds = 0.1;
constexpr double kPickPollSeconds = 0.01;

constexpr uint32_t kRemoteLoaderThreads = 8;
constexpr int kMostExports = 10000;

bool writeText(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    return static_cast<bool>((file << text).flush());
}

}  // namespace

Result<std::unique_ptr<ViewSession>> ViewSession::create(const SessionOptions& options, SurfaceSource surface) {
    ViewerOptions viewerOptions;
    viewerOptions.renderer = options.render.rendererOptions();
    // Any shading may be chosen later.
    viewerOptions.renderer.colour = true;
    if (std::any_of(options.inputs.begin(), options.inputs.end(), isHttpUrl)) viewerOptions.renderer.loaderThreads = kRemoteLoaderThreads;
    viewerOptions.renderer.surface = std::move(surface);
    viewerOptions.errorPixels = options.render.errorPixels;
    viewerOptions.shading = options.render.shadingChosen();
    viewerOptions.shading.backgroundTop = options.user.backgroundTop;
    viewerOptions.shading.backgroundBottom = options.user.backgroundBottom;
    viewerOptions.sectionCaps = options.render.caps;
    viewerOptions.march = options.render.march;
    auto viewer = Viewer::create(viewerOptions);
    if (!viewer) return viewer.error();
    return std::unique_ptr<ViewSession>(new ViewSession(options, *std::move(viewer)));
}

ViewSession::ViewSession(const SessionOptions& options, std::unique_ptr<Viewer> viewer)
    : options_(options), user_(options.user), viewer_(std::move(viewer)) {}

ViewSession::~ViewSession() {
    if (pick_.valid()) pick_.wait();
}

void ViewSession::open(std::vector<std::string> inputs) {
    if (inputs.empty()) return;
    dismissProblem();
    opening_.reset();
    opening_ = std::make_unique<DatasetOpening>(std::move(inputs), options_.build, options_.render.source, options_.progress);
}

void ViewSession::takeOpened() {
    if (!opening_ || !opening_->isDone()) return;
    const auto opened = opening_->take();
    const std::vector<std::string> inputs = opening_->inputs();
    opening_.reset();
    const auto shown = opened ? show(*opened, inputs) : Result<void>(opened.error());
    if (shown) return;
    if (shown.error().code == ErrorCode::Cancelled)
        note("cancelled");
    else
        say(shown.error().line());
}

Result<void> ViewSession::show(const OpenDataset& open, const std::vector<std::string>& inputs) {
    const glm::ivec2 size = glm::max(viewer_->size(), glm::ivec2(1));
    OrbitCamera camera;
    camera.up = user_.up;
    camera.look(View::Fit, open.bounds(), size);
    // What the command line says is for what it opens.
    if (!std::exchange(wasShown_, true)) {
        const auto asked = options_.render.cameraFor(open.bounds(), size);
        if (asked)
            camera = *asked;
        else
            say(asked.error().line());
        viewer_->setSections(options_.render.sectionPlanes(open.bounds()));
    } else {
        viewer_->setSections({});
    }
    if (pick_.valid()) pick_.wait(), pick_ = {};
    measurement_.clear();
    finest_ = std::make_shared<FinestPick>(open.reader, *open.dataset);
    VCP_TRY(viewer_->open(open.dataset, open.source, camera, nameOf(inputs)));
    shown_ = rememberedName(inputs.front());
    for (const std::string& input : inputs) user_.remember(input);
    return {};
}

Result<NextStep> ViewSession::update(double now) {
    takeOpened();
    takePicked();
    auto next = viewer_->update(now);
    if (!next) return next;
    if (opening_) next->waitSeconds = std::min(next->waitSeconds, kOpeningPollSeconds);
    if (pick_.valid()) next->waitSeconds = std::min(next->waitSeconds, kPickPollSeconds);
    return next;
}

std::string ViewSession::problem() const { return problem_.empty() ? viewer_->status().problem : problem_; }

void ViewSession::dismissProblem() {
    problem_.clear();
    viewer_->dismissProblem();
}

void ViewSession::keepBookmark(int number) {
    if (shown_.empty()) return;
    user_.bookmarks[shown_][number] = viewer_->camera();
    note(fmt::format("bookmark {} kept; Shift+{} goes back to it", number, number));
}

void ViewSession::goToBookmark(int number) {
    const auto* kept = bookmarks();
    const auto bookmark = kept ? kept->find(number) : std::map<int, OrbitCamera>::const_iterator{};
    if (!kept || bookmark == kept->end()) return note(fmt::format("there is no bookmark {}; Ctrl+{} makes one", number, number));
    viewer_->moveTo(bookmark->second);
}

const std::map<int, OrbitCamera>* ViewSession::bookmarks() const {
    const auto of = user_.bookmarks.find(shown_);
    return of == user_.bookmarks.end() ? nullptr : &of->second;
}

void ViewSession::pasteCamera(const std::string& json) {
    const auto camera = cameraFromJson(json, "clipboard");
    if (!camera) return say(camera.error().line());
    viewer_->moveTo(*camera);
}

void ViewSession::measureAt(glm::dvec2 pixel) {
    if (!finest_ || pick_.valid()) return;
    const CameraRay through = viewer_->camera().rayThrough(pixel, viewer_->size());
    const Ray ray{through.origin, through.direction};
    pick_ = std::async(std::launch::async, [finest = finest_, ray, sections = viewer_->sections()] { return finest->cast(ray, sections); });
}

void ViewSession::takePicked() {
    if (!pick_.valid() || pick_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    const Picked picked = pick_.get();
    if (!picked) return say(picked.error().line());
    if (!*picked) return note("there is no surface under the cursor");
    measurement_.add({(*picked)->position, (*picked)->certifiedError, (*picked)->level});
}

void ViewSession::exportMeasurement() {
    if (measurement_.empty()) return note("nothing is measured yet: D, then click");
    namespace fs = std::filesystem;
    for (int i = 1; i < kMostExports; ++i) {
        const std::string name = fmt::format("measurement-{}", i);
        std::error_code failed;
        if (fs::exists(name + ".csv", failed) || fs::exists(name + ".json", failed)) continue;
        if (!writeText(name + ".csv", measurementCsv(measurement_)) || !writeText(name + ".json", measurementJson(measurement_)))
            return say(fs::absolute(name + ".csv", failed).string() + ": cannot be written");
        return note(fmt::format("written: {}.csv and .json in {}", name, fs::current_path(failed).string()));
    }
}

void ViewSession::collectSettings() {
    const Shading& shading = viewer_->shading();
    user_.shadows = shading.shadows;
    user_.occlusion = shading.occlusionRays > 0;
    user_.backgroundTop = shading.backgroundTop;
    user_.backgroundBottom = shading.backgroundBottom;
    user_.errorPixels = viewer_->errorPixels();
    user_.budgetBytes = viewer_->status().budgetBytes;
    if (viewer_->dataset()) user_.up = viewer_->camera().up;
}

}  // namespace vcp
