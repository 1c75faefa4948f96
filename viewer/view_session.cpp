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
constexpr uint32_t kSavedTile = 512;  // small: the window goes on between tiles

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

Result<void> ViewSession::show(const OpenedScene& open, const std::vector<std::string>& inputs) {
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
        if (options_.render.camera == "fit" && open.file.camera) camera = *open.file.camera;
    } else {
        viewer_->setSections({});
        if (open.file.camera) camera = *open.file.camera;
    }
    const bool hasOwnSections = viewer_->sections().empty() && !open.file.sections.empty();
    if (hasOwnSections) viewer_->setSections(open.file.sections);
    viewer_->setSectionCaps(options_.render.caps || (hasOwnSections && open.file.sectionCaps));
    if (open.file.light || std::exchange(hasSceneLight_, false)) {
        // What lit one scene does not light the next.
        Shading shading = viewer_->shading();
        const Shading chosen = options_.render.shadingChosen();
        shading.lightFollowsCamera = open.file.light ? open.file.light->followsCamera : chosen.lightFollowsCamera;
        shading.lightDirection = open.file.light ? open.file.light->direction : chosen.lightDirection;
        viewer_->setShading(shading);
        hasSceneLight_ = open.file.light.has_value();
    }
    cancelSaving();
    if (pick_.valid()) pick_.wait(), pick_ = {};
    measurement_.clear();
    finest_ = std::make_shared<ScenePick>();
    for (const OpenedScene::Part& part : open.parts) finest_->add(part.open.reader, *part.open.dataset, part.placement);
    VCP_TRY(viewer_->open(open.placed(), open.surfaces, camera, nameOf(inputs)));
    if (!open.surfaces.warnings.empty()) note(open.surfaces.warnings.front());
    shown_ = rememberedName(inputs.front());
    for (const std::string& input : inputs) user_.remember(input);
    return {};
}

Result<NextStep> ViewSession::update(double now) {
    takeOpened();
    takePicked();
    goOnSaving();
    auto next = viewer_->update(now);
    if (!next) return next;
    if (opening_) next->waitSeconds = std::min(next->waitSeconds, kOpeningPollSeconds);
    if (saving_) next->waitSeconds = saving_->picture->isWaiting() ? std::min(next->waitSeconds, kPickPollSeconds) : 0;
    if (pick_.valid()) next->waitSeconds = std::min(next->waitSeconds, kPickPollSeconds);
    return next;
}

void ViewSession::act(ViewerAction action) {
    viewer_->act(action);
    if (const std::string why = viewer_->whyWithout(action); !why.empty()) note(why);
}

void ViewSession::showFeedback(bool show) {
    showsFeedback_ = show;
    viewer_->renderer().keepFeedback(show);
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
    if (const auto hit = viewer_->hitAt(pixel); hit && hit->onSurface) return note("mesostructure is not measured: it has no certified error");
    // A cap is the section plane itself: its points are exact.
    if (const auto cap = viewer_->capAt(pixel)) {
        measurement_.add({*cap, 0, viewer_->status().levels - 1});
        return;
    }
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

void ViewSession::savePicture(glm::ivec2 size) {
    if (saving_ || !viewer_->isOpen()) return;
    namespace fs = std::filesystem;
    int number = 1;
    std::error_code failed;
    while (number < kMostExports && fs::exists(fmt::format("picture-{}.png", number), failed)) ++number;
    Saving saving;
    saving.path = fmt::format("picture-{}.png", number);
    auto view = viewer_->renderer().addView();
    if (!view) return say(view.error().line());
    auto png = PngRows::create(saving.path, static_cast<uint32_t>(size.x), static_cast<uint32_t>(size.y));
    if (!png) return say(png.error().line());
    saving.view = *std::move(view);
    saving.png = *std::move(png);
    saving.picture = std::make_unique<TiledPicture>(*saving.view, viewer_->pictureOf(size), TiledPictureOptions{.tile = kSavedTile, .progress = {}, .problem = [this](const Error& problem) { say(problem.line()); }},
                                                    [rows = saving.png.get()](const PictureBand& band) { return rows->add(band.picture.rgba); });
    saving_ = std::move(saving);
}

std::optional<double> ViewSession::savingFraction() const { return saving_ ? std::optional(saving_->picture->fraction()) : std::nullopt; }

void ViewSession::cancelSaving() {
    if (saving_) note(saving_->path + ": cancelled, nothing is written");
    saving_.reset();
}

void ViewSession::goOnSaving() {
    if (!saving_) return;
    if (saving_->turnsBefore > 0) {
        --saving_->turnsBefore;
        return;
    }
    auto done = saving_->picture->step();
    if (done && !*done) return;
    if (done)
        if (const auto finished = saving_->png->finish(); !finished) done = finished.error();
    std::error_code failed;
    if (done) note(fmt::format("written: {} in {}", saving_->path, std::filesystem::current_path(failed).string()));
    else say(done.error().line());
    saving_.reset();
}

void ViewSession::collectSettings() {
    const Shading& shading = viewer_->shading();
    user_.shadows = shading.shadows;
    user_.occlusion = shading.occlusionRays > 0;
    user_.backgroundTop = shading.backgroundTop;
    user_.backgroundBottom = shading.backgroundBottom;
    user_.errorPixels = viewer_->errorPixels();
    user_.budgetBytes = viewer_->status().budgetBytes;
    if (viewer_->isOpen()) user_.up = viewer_->camera().up;
}

}  // namespace vcp
