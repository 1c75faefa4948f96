#include "viewer/window/view_session.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/exponential.hpp>

#include "octree/io/output_file.h"
#include "viewer/annotation/picture_canvas.h"
#include "viewer/camera/camera_path.h"
#include "viewer/scene/environment.h"
#include "viewer/window/free_name.h"
#include "viewer/window/theme.h"
#include "viewer/window/thumbnails.h"

namespace vcp {

namespace {

// The seconds between looks at the work of other threads.
constexpr double kOpeningPollSeconds = 0.1;
constexpr double kPickPollSeconds = 0.01;
constexpr double kNoteSeconds = 8;
constexpr const char* kErrorUnknown =
    "not measured: nothing is known of the error of this surface's method (see docs/mesostructure.md)";

constexpr uint32_t kSavedTile = 512;  // small, so that the window stays live between tiles

/// Returns what is shown as a scene names it: a mesh as such, not what was built of it. What no scene can name has no
/// name.
SceneFile savedScene(SceneFile scene, const std::vector<std::string>& inputs) {
    const auto kind = kindOf(inputs);
    if (kind && *kind == InputKind::Meshes) scene.datasets.front().file = inputs.size() == 1 ? inputs.front() : "";
    return scene;
}

}  // namespace

void applyRemembered(RenderSettings& render, const UserSettings& user, const GivenSettings& given) {
    if (!given.errorPixels) render.errorPixels = user.errorPixels;
    if (!given.budget) render.budgetBytes = user.budgetBytes;
    if (!given.shadows) render.shading.shadows = user.shadows;
    if (!given.occlusion && user.occlusion) render.shading.occlusionRays = kUsualOcclusionRays;
    render.usualUp = user.up;
}

Result<std::unique_ptr<ViewSession>> ViewSession::create(const SessionOptions& options,
                                                         std::optional<SurfaceSource> surface) {
    ViewerOptions viewerOptions;
    viewerOptions.renderer = options.render.rendererOptions();
    // Colours are kept, since any shading may be chosen later.
    viewerOptions.renderer.colour = true;
    viewerOptions.renderer.surface = std::move(surface);
    viewerOptions.errorPixels = options.render.errorPixels;
    viewerOptions.colourError = options.render.colourError;
    viewerOptions.shading = options.render.shading;
    viewerOptions.shading.backgroundTop = options.user.backgroundTop;
    viewerOptions.shading.backgroundBottom = options.user.backgroundBottom;
    viewerOptions.sectionCaps = options.render.caps;
    viewerOptions.march = options.render.march;
    viewerOptions.framesAhead = true;
    VCP_TRY_ASSIGN(auto viewer, Viewer::create(viewerOptions));
    return std::unique_ptr<ViewSession>(new ViewSession(options, std::move(viewer)));
}

ViewSession::ViewSession(const SessionOptions& options, std::unique_ptr<Viewer> viewer)
    : options_(options), user_(options.user), viewer_(std::move(viewer)), seenLooks_(looks()) {
    takeSurroundings(options.render.environment);
    note("");
    useThemesBackground();
}

ViewSession::~ViewSession() {
    cancelSaving();
    endPick();
}

/// Ends the pick: a server may take long, and a cast may be about to read again.
void ViewSession::endPick() {
    while (pick_.valid() && pick_.wait_for(std::chrono::milliseconds(10)) != std::future_status::ready)
        finest_->interrupt();
    pick_ = {};
}

void ViewSession::open(std::vector<std::string> inputs) {
    if (inputs.empty()) return;
    dismissProblem();
    if (inputs.size() == 1 && isEnvironmentName(inputs.front())) return surround(inputs.front());
    opening_.reset();
    preview_ = {};
    framed_.reset();
    BuildOptions build = options_.build;
    build.progress = options_.makeProgress ? options_.makeProgress() : nullptr;
    opening_ = std::make_unique<SceneOpening>(std::move(inputs), std::move(build), options_.render.source);
}

void ViewSession::takeOpened() {
    if (!opening_ || !opening_->isDone()) return;
    auto opened = opening_->take();
    std::vector<std::string> inputs = opening_->inputs();
    opening_.reset();
    const std::vector<LeftOut> leftOut = opened ? opened->leftOut : std::vector<LeftOut>();
    for (const LeftOut& each : leftOut) std::erase(inputs, each.input);
    const auto shown = opened ? show(*std::move(opened), inputs) : Result<void>(opened.error());
    if (!shown && shown.error().code == ErrorCode::Cancelled)
        note("cancelled");
    else if (!shown)
        say(shown.error().line());
    else if (!leftOut.empty())
        say(leftOut.front().why.line() +
            (leftOut.size() > 1 ? fmt::format(" (and {} more not shown)", leftOut.size() - 1) : ""));
}

/// Opens a scene in the viewer; where that cannot be, what was shown before stays.
Result<void> ViewSession::openInViewer(const OpenedScene& open, const OrbitCamera& camera, std::string name) {
    const auto opened = viewer_->open(open.placed(), open.surfaces, camera, std::move(name));
    if (opened || shown_.empty()) return opened;
    if (compared_)
        endComparison();
    else
        VCP_TRY(replaceDatasets(open_.placed()));
    return opened;
}

Result<void> ViewSession::show(OpenedScene open, const std::vector<std::string>& inputs) {
    const glm::ivec2 size = glm::max(viewer_->size(), glm::ivec2(1));
    OrbitCamera camera;
    camera.up = options_.render.upFor(open);
    camera.look(View::Fit, open.bounds(), size, viewer_->covered());
    // The command line's settings apply only to what it opens.
    const bool isFirst = !wasShown_;
    const bool takesOwn = !isFirst || options_.render.isFit();
    if (isFirst) {
        const auto asked = options_.render.cameraFor(open.bounds(), camera.up, size, viewer_->covered());
        if (asked)
            camera = *asked;
        else
            say(asked.error().line());
    }
    if (takesOwn && open.file.camera) camera = *open.file.camera;
    if (isFirst && isPreviewMoved()) camera = viewer_->camera();
    cancelSaving();
    VCP_TRY(openInViewer(open, camera, nameOf(inputs)));
    wasShown_ = true;
    viewer_->setSections(isFirst ? options_.render.sectionPlanes(open.bounds()) : std::vector<SectionPlane>());
    const bool hasOwnSections = viewer_->sections().empty() && !open.file.sections.empty();
    if (hasOwnSections) viewer_->setSections(open.file.sections);
    viewer_->setSectionCaps(std::max(options_.render.caps, hasOwnSections ? open.file.sectionCaps : Caps::None));
    // The light of one scene does not apply to the next.
    if (std::exchange(hasSceneLight_, hasOwnLight(open)) || hasSceneLight_) {
        Shading shading = viewer_->shading();
        setSceneLight(shading, open, options_.render.shading);
        viewer_->setShading(shading);
        takeSurroundings(open.file.environment.value_or(options_.render.environment));
    }
    compared_.reset();
    endPick();
    measurement_.clear();
    finest_ = std::make_shared<ScenePick>();
    scans_.clear();
    for (const OpenedScene::Part& part : open.parts) {
        finest_->add(part.open.reader, *part.open.dataset, part.placement);
        scans_.push_back({.reader = part.open.reader, .placement = part.placement, .plane = {}, .unit = {}});
    }
    viewer_->setLooks(looksOf(open.file));
    if (!open.surfaces.warnings.empty()) note(open.surfaces.warnings.front());
    subject_ = open.legendSubject();
    layers_.clear();
    for (size_t i = 0; i < open.parts.size(); ++i) {
        // What a mesh was built into is called as the mesh.
        const bool isNamed = open.parts.size() > 1 && i < open.file.datasets.size();
        layers_.push_back({isNamed ? nameOf({open.file.datasets[i].file}) : nameOf(inputs),
                           open.parts[i].open.dataset->header.triangles});
    }
    for (const MesoSurfaceDescription& surface : open.file.surfaces) layers_.push_back({nameOf({surface.base}), 0});
    shown_ = rememberedName(inputs.front());
    scene_ = savedScene(open.file, inputs);
    const auto kept = user_.annotations.find(shown_);
    points_ = kept != user_.annotations.end() ? kept->second : open.file.annotations;
    newPoint_.reset();
    home_ = camera;
    open_ = std::move(open);
    for (const std::string& input : inputs) {
        changes_.opened.push_back(rememberedName(input));
        user_.remember(changes_.opened.back());
    }
    return {};
}

/// Shows what was read of the mesh, where nothing else is shown.
void ViewSession::takePreview(double now) {
    if (!opening_ || viewer_->isOpen() || !preview_.update(opening_->sample(), now)) return;
    if (isPreviewMoved()) return;
    OrbitCamera camera;
    camera.up = options_.render.upFor(preview_.bounds());
    camera.look(View::Fit, preview_.bounds(), glm::max(viewer_->size(), glm::ivec2(1)), viewer_->covered());
    viewer_->foresee(preview_.bounds(), camera);
    framed_ = viewer_->camera().current();
}

Result<NextStep> ViewSession::update(double now) {
    takeOpened();
    takePreview(now);
    takePicked();
    goOnSaving();
    takeCut();
    takeCompared();
    noteChanges();
    // What is saved or built has the processors and the device for itself.
    viewer_->setSamples(saving_ || opening_ || comparing_ ? 1 : options_.samples);
    auto next = viewer_->update(now);
    if (!next) return next;
    if (!note_.empty()) {
        if (std::isnan(notedAt_)) notedAt_ = now;
        const double left = notedAt_ + kNoteSeconds - now;
        if (left <= 0) note("");
        next->waitSeconds = std::min(next->waitSeconds, std::max(left, 0.0));
    }
    if (opening_) next->waitSeconds = std::min(next->waitSeconds, kOpeningPollSeconds);
    if (saving_) next->waitSeconds = saving_->pictures->isWaiting() ? std::min(next->waitSeconds, kPickPollSeconds) : 0;
    if (cut_ || comparing_) next->waitSeconds = std::min(next->waitSeconds, kOpeningPollSeconds);
    if (pick_.valid()) next->waitSeconds = std::min(next->waitSeconds, kPickPollSeconds);
    return next;
}

void ViewSession::act(ViewerAction action) {
    if (action == ViewerAction::ToggleUpAxis && viewer_->isOpen())
        takeUp(viewer_->camera().up == UpAxis::Y ? UpAxis::Z : UpAxis::Y);
    viewer_->act(action);
    if (const std::string why = viewer_->whyWithout(action); !why.empty()) note(why);
}

/// Has the axis remembered for scans whose shape does not say which it is. A camera of a scene or a bookmark brings its
/// own, which is not by hand.
void ViewSession::takeUp(UpAxis up) {
    if (options_.render.up) options_.render.up = up;
    if (open_.surfaces.surfaces.empty() && upOf(open_.bounds())) return;
    changes_.up = options_.render.usualUp = up;
}

void ViewSession::toggleWireframe() {
    Shading shading = viewer_->shading();
    const bool isWired = shading.mode == ShadingMode::Wireframe;
    if (!isWired) unwired_ = shading.mode;
    shading.mode = isWired ? unwired_ : ShadingMode::Wireframe;
    viewer_->setShading(shading);
}

void ViewSession::note(std::string text) {
    note_ = std::move(text);
    notedAt_ = std::numeric_limits<double>::quiet_NaN();
}

void ViewSession::keepThumbnail() {
    if (shown_.empty() || compared_ || !viewer_->isOpen() || !viewer_->status().update.drawable ||
        viewer_->framesDrawn() == 0)
        return;
    const auto picture = viewer_->renderer().readPicture();
    if (!picture || picture->rgba.empty()) return;
    const double part = double(picture->width) / std::max(1, viewer_->size().x);
    const PictureMargins& covered = viewer_->covered();
    const auto thumbnails = Thumbnails::inCache();
    if (!thumbnails) return;
    // A cache that cannot be written is no reason to trouble anyone.
    (void)thumbnails->keep(shown_, thumbnailOf(*picture, {covered.left * part, covered.right * part, covered.top * part,
                                                          covered.bottom * part}));
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
    user_.bookmarks[shown_][number] = changes_.bookmarks[shown_][number] = viewer_->camera();
    note(fmt::format("bookmark {} kept; Shift+{} goes back to it", number, number));
}

void ViewSession::goToBookmark(int number) {
    const auto* kept = bookmarks();
    const auto bookmark = kept ? kept->find(number) : std::map<int, OrbitCamera>::const_iterator{};
    if (!kept || bookmark == kept->end())
        return note(fmt::format("there is no bookmark {}; Ctrl+{} makes one", number, number));
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

void ViewSession::clickAt(glm::dvec2 pixel) {
    if (!finest_ || pick_.valid() || clicks_ == Clicks::Nothing) return;
    const auto surfaces = viewer_->renderer().surfaces();
    if (const auto seen = viewer_->hitAt(pixel); seen && seen->onSurface) {
        if (clicks_ == Clicks::Annotate) return annotate(seen->position);
        // It may be the one that is seen, and rays do not find it.
        const auto isRemeshed = [](const MesoSurface& surface) { return surface.remeshed.surface != nullptr; };
        if (std::any_of(surfaces.begin(), surfaces.end(), isRemeshed)) return note(kErrorUnknown);
    }
    // A cap is the section plane itself: its points are exact.
    if (const auto cap = viewer_->capAt(pixel)) {
        if (clicks_ == Clicks::Annotate) return annotate(*cap);
        measurement_.add({*cap, 0, viewer_->status().levels - 1});
        return;
    }
    const CameraRay through = viewer_->camera().rayThrough(pixel, viewer_->size());
    const Ray ray{through.origin, through.direction};
    pickedFor_ = clicks_;
    const std::vector<SectionPlane> sections = viewer_->sections();
    const auto onSurface =
        pickOnSurfaces(surfaces, ray.origin, ray.direction, sections, viewer_->motion().surfacesMoved());
    pick_ = std::async(std::launch::async, [finest = finest_, ray, sections, hidden = viewer_->hidden(), onSurface] {
        return finest->cast(ray, sections, hidden, onSurface);
    });
}

void ViewSession::takePicked() {
    if (!pick_.valid() || pick_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    const Picked picked = pick_.get();
    if (!picked) return say(picked.error().line());
    if (!*picked) return note("there is no surface under the cursor");
    if (pickedFor_ == Clicks::Annotate) return annotate((*picked)->position);
    const SceneHit& hit = **picked;
    if (!hit.onSurface) return measurement_.add({hit.position, hit.certifiedError, hit.level});
    if (!std::isfinite(hit.certifiedError)) return note(kErrorUnknown);
    measurement_.add({hit.position, hit.certifiedError, {}});
}

void ViewSession::annotate(glm::dvec3 position) {
    if (points_.size() >= kMostAnnotations)
        return note(fmt::format("there are {} annotations, as many as may be", points_.size()));
    newPoint_ = points_.size();
    points_.push_back({position, fmt::format("Point {}", points_.size() + 1)});
    clicks_ = Clicks::Nothing;
    keepPoints();
}

void ViewSession::changePoint(size_t index, std::string title, std::string text) {
    points_.at(index).title = std::move(title);
    points_.at(index).text = std::move(text);
    keepPoints();
}

void ViewSession::removePoint(size_t index) {
    points_.erase(points_.begin() + ptrdiff_t(index));
    newPoint_.reset();
    keepPoints();
}

/// Has what was changed by hand remembered for the file.
void ViewSession::keepPoints() { user_.annotations[shown_] = changes_.annotations[shown_] = points_; }

void ViewSession::goToPoint(size_t index) {
    OrbitCamera camera = viewer_->camera();
    camera.centreOn(points_.at(index).position);
    viewer_->moveTo(camera);
}

void ViewSession::surround(const std::string& source) {
    dismissProblem();
    Shading shading = viewer_->shading();
    const auto before = std::exchange(shading.environment, std::nullopt);
    if (!source.empty()) {
        // Others keep turn and strength.
        const EnvironmentChoice choice{source, before ? before->turn : 0.0f, before ? before->strength : 1.0f};
        const auto light = openEnvironment(choice);
        if (!light) return say(light.error().line());
        shading.environment = *light;
        takeSurroundings(choice);
    }
    viewer_->setShading(shading);
    // What is opened next keeps them, where it has no light of its own.
    options_.render.shading.environment = shading.environment;
    options_.render.environment = {source};
}

void ViewSession::takeSurroundings(const EnvironmentChoice& choice) {
    environment_ = choice.source;
    if (!choice.source.empty() && choice.isFile()) environmentFile_ = choice.source;
}

void ViewSession::saveScene() {
    if (!viewer_->isOpen()) return;
    if (std::ranges::any_of(scene_.datasets, [](const SceneDataset& each) { return each.file.empty(); }))
        return note("several meshes are shown as one: build a .vcp of them, which a scene can name");
    SceneFile scene = scene_;
    const Shading& shading = viewer_->shading();
    scene.lights.clear();
    if (areLightsOn(shading)) scene.lights = lightsOf(shading);
    scene.environment.reset();
    if (const auto& light = shading.environment)
        scene.environment = EnvironmentChoice{environment_, light->turn, light->strength};
    scene.camera = viewer_->camera();
    scene.sections = viewer_->sections();
    scene.sectionCaps = viewer_->sectionCaps();
    scene.annotations = points_;
    for (size_t i = 0; i < scene.datasets.size(); ++i) {
        const DatasetLook look =
            compared_ && compared_->shown.dataset == i ? compared_->look : viewer_->lookOf(uint32_t(i));
        scene.datasets[i].opacity = look.opacity;
        scene.datasets[i].colour.reset();
        if (look.colour) scene.datasets[i].colour = glm::pow(*look.colour, glm::vec3(1 / 2.2f));
    }
    const auto nameOf = [](int number) { return fmt::format("scene-{}.json", number); };
    const std::string name = nameOf(freeNumber([&](int i) { return isThere(nameOf(i)); }));
    const auto written = writeFile(name, OutputKind::JsonText, std::string_view(sceneToJson(scene)));
    if (!written) return say(written.error().line());
    note(fmt::format("written: {} in {}", name, workingFolder()));
}

Annotations ViewSession::annotations() const {
    LegendSubject shown{{}, subject_.hasRelief};
    for (size_t i = 0; i < subject_.levels.size(); ++i)
        if (!std::ranges::count(viewer_->hidden(), uint32_t(i))) shown.levels.push_back(subject_.levels[i]);
    Annotations all{
        .legends = legendsOf(viewer_->shading().mode, shown), .hasScaleBar = true, .lines = {}, .unit = unit()};
    const ShadingMode mode = viewer_->shading().mode;
    if (compared_ && (mode == ShadingMode::Lit || mode == ShadingMode::Unlit))
        all.legends.push_back(distanceLegend(compared_->shown.range, compared_->shown.measured->compared.b, unit()));
    all.lines = annotatedLines(measurement_, unit());
    all.points = points_;
    return all;
}

void ViewSession::exportMeasurement() {
    if (measurement_.empty()) return note("nothing is measured yet: D, then click");
    const auto nameOf = [](int number) { return fmt::format("measurement-{}", number); };
    const std::string name =
        nameOf(freeNumber([&](int i) { return isThere(nameOf(i) + ".csv") || isThere(nameOf(i) + ".json"); }));
    const auto table = writeFile(name + ".csv", OutputKind::Text, std::string_view(measurementCsv(measurement_)));
    const auto json =
        writeFile(name + ".json", OutputKind::JsonText, std::string_view(measurementJson(measurement_, unit())));
    if (!table || !json) return say((table ? json : table).error().line());
    writtenMeasurement_ = measurementCsv(measurement_);
    note(fmt::format("written: {}.csv and .json in {}", name, workingFolder()));
}

void ViewSession::savePicture(const PictureChoice& choice) {
    if (saving() || !viewer_->isOpen()) return;
    const auto filesOf = [&](int number) {
        PictureFiles files{fmt::format("picture-{}.png", number), {}, {}};
        if (choice.depth) files.depth = fmt::format("picture-{}-depth.pfm", number);
        return files;
    };
    const PictureFiles files = filesOf(freeNumber(
        [&](int i) { return isThere(filesOf(i).picture) || isThere(fmt::format("picture-{}-depth.pfm", i)); }));
    beginSaving(choice, files.picture, files, {viewer_->camera()}, false);
}

void ViewSession::saveTurntable(const PictureChoice& choice, int pictures) {
    if (saving() || !viewer_->isOpen()) return;
    saveSequence(choice, "turntable", turntable(viewer_->camera(), viewer_->bounds().centre(), pictures));
}

void ViewSession::savePath(const PictureChoice& choice, int pictures) {
    if (saving() || !viewer_->isOpen()) return;
    std::vector<OrbitCamera> keys;
    if (const auto* kept = bookmarks())
        for (const auto& [number, camera] : *kept) keys.push_back(camera);
    if (keys.size() < 2) return note("a path goes through bookmarks: keep two or more, with Ctrl+1, Ctrl+2, ...");
    saveSequence(choice, "path", cameraPath(keys, pictures));
}

void ViewSession::saveSequence(const PictureChoice& choice, const std::string& name,
                               const std::vector<OrbitCamera>& cameras) {
    const auto nameOf = [&](int number) {
        return std::filesystem::path(fmt::format("{}-{}{}", name, number, choice.video ? ".mp4" : ""));
    };
    const std::filesystem::path folder = nameOf(freeNumber([&](int i) { return isThere(nameOf(i)); }));
    if (choice.video) return beginSaving(choice, folder, {folder, {}, {}}, cameras, false);
    std::error_code failed;
    if (!std::filesystem::create_directory(folder, failed))
        return say(fmt::format("{}: no such folder can be made in {}", folder.string(), workingFolder()));
    PictureFiles files{folder / "picture.png", {}, {}};
    if (choice.depth) files.depth = folder / "depth.pfm";
    beginSaving(choice, folder, files, cameras, true);
}

void ViewSession::beginSaving(const PictureChoice& choice, std::filesystem::path name, PictureFiles files,
                              const std::vector<OrbitCamera>& cameras, bool isFolder) {
    auto view = viewer_->renderer().addView();
    if (!view) {
        std::error_code failed;
        if (isFolder) std::filesystem::remove(name, failed);
        return say(view.error().line());
    }
    FrameRequest request = viewer_->pictureOf(choice.size);
    request.shading.transparent = choice.transparent && !isVideoPath(files.picture);
    PictureSequenceOptions options{.request = request,
                                   .cameras = {},
                                   .files = std::move(files),
                                   .isNumbered = isFolder,
                                   .tile = kSavedTile,
                                   .samples = std::min(options_.samples, kUsualSamples),
                                   .problem = [this](const Error& problem) { say(problem.line()); }};
    std::vector<AnnotatedView> views;
    for (const OrbitCamera& camera : cameras) {
        options.cameras.push_back(camera.current());
        views.push_back(annotatedPicture(camera.current(), camera.viewHeight(), glm::uvec2(choice.size)));
    }
    if (choice.annotated) options.paintOver = annotationPainter(annotations(), std::move(views), isDark());
    auto pictures = std::make_unique<PictureSequence>(**view, std::move(options));
    saving_ = Saving{std::move(name), *std::move(view), std::move(pictures), isFolder};
}

void ViewSession::saveCut(const std::string& extension) {
    if (saving()) return;
    if (viewer_->sections().empty()) return note("cut it open first");
    std::vector<size_t> shown;
    const std::vector<uint32_t>& hidden = viewer_->hidden();
    for (size_t i = 0; i < scans_.size(); ++i)
        if (std::find(hidden.begin(), hidden.end(), uint32_t(i)) == hidden.end()) shown.push_back(i);
    if (shown.size() != 1) return note("a cut is drawn of one scan: hide the others");
    const auto nameOf = [&](int number) { return std::filesystem::path(fmt::format("cut-{}{}", number, extension)); };
    CutDrawing::Subject subject = scans_[shown.front()];
    subject.plane = viewer_->sections().front();
    // A scan that is placed larger or smaller has units of its own.
    if (subject.placement.scale == 1) subject.unit = unit();
    cut_ =
        std::make_unique<CutDrawing>(std::move(subject), nameOf(freeNumber([&](int i) { return isThere(nameOf(i)); })));
}

void ViewSession::takeCut() {
    if (!cut_ || !cut_->isDone()) return;
    const auto figures = cut_->take();
    const std::string name = cut_->output().string();
    cut_.reset();
    if (!figures) return say(figures.error().line());
    note(fmt::format("written: {} in {}: {}, {} long", name, workingFolder(), formatCount(figures->lines, "line"),
                     lengthText(figures->length, unit())));
}

std::optional<ViewSession::SavingProgress> ViewSession::saving() const {
    if (cut_) return SavingProgress{cut_->output().string(), cut_->fraction(), 0, 1};
    if (comparing_) return SavingProgress{{}, comparing_->fraction(), 0, 1};
    if (!saving_) return std::nullopt;
    const PictureSequence& pictures = *saving_->pictures;
    return SavingProgress{saving_->name.string(), pictures.fraction(), pictures.finished(), pictures.pictures()};
}

/// Ends saving; says in words which files there are.
std::string ViewSession::endSaving() {
    Saving saving = *std::exchange(saving_, std::nullopt);
    const auto [finished, pictures] = std::pair(saving.pictures->finished(), saving.pictures->pictures());
    saving.pictures.reset();  // a half-written file goes with it
    if (saving.isFolder ? finished == 0 : finished < pictures) {
        std::error_code failed;
        if (saving.isFolder) std::filesystem::remove(saving.name, failed);
        return fmt::format("{}: nothing is written", saving.name.string());
    }
    return fmt::format("written: {}{} in {}",
                       saving.isFolder ? fmt::format("{} of {} pictures, ", finished, pictures) : "",
                       saving.name.string(), workingFolder());
}

void ViewSession::cancelSaving() {
    if (saving_) note("cancelled; " + endSaving());
    if (cut_) note(fmt::format("cancelled; {}: nothing is written", cut_->output().string()));
    cut_.reset();
    if (comparing_) note("cancelled; nothing is compared");
    comparing_.reset();
}

void ViewSession::goOnSaving() {
    if (!saving_) return;
    if (saving_->turnsBefore > 0) {
        --saving_->turnsBefore;
        return;
    }
    const auto done = saving_->pictures->step();
    if (done && !*done) return;
    if (!done) say(done.error().line());
    note(endSaving());
}

const SettingsChanges& ViewSession::changes() {
    noteChanges();
    return changes_;
}

void ViewSession::togglePanel() {
    user_.panel = !user_.panel;
    changes_.panel = user_.panel;
}

void ViewSession::setTheme(ThemeChoice theme) {
    user_.theme = theme;
    changes_.theme = theme;
    noteChanges();
    useThemesBackground();
}

void ViewSession::followDesktop(std::optional<bool> isDark) {
    if (desktopIsDark_ == isDark) return;
    desktopIsDark_ = isDark;
    noteChanges();
    useThemesBackground();
}

bool ViewSession::isDark() const { return vcp::isDark(user_.theme, desktopIsDark_); }

void ViewSession::useThemesBackground() {
    if (user_.hasBackground || changes_.backgroundTop || changes_.backgroundBottom) return;
    const Background background = backgroundOf(isDark());
    Shading shading = viewer_->shading();
    shading.backgroundTop = background.top;
    shading.backgroundBottom = background.bottom;
    viewer_->setShading(shading);
    seenLooks_ = looks();
}

ViewSession::Looks ViewSession::looks() const {
    const Shading& shading = viewer_->shading();
    return {shading.shadows,       shading.occlusionRays > 0, viewer_->errorPixels(), viewer_->status().budgetBytes,
            shading.backgroundTop, shading.backgroundBottom};
}

/// Notes changes by hand: what options and scenes set is in the last update already, so what differs from it is by
/// hand.
void ViewSession::noteChanges() {
    const Looks now = looks();
    const auto compare = [](const auto& value, const auto& before, auto& changed) {
        if (value != before) changed = value;
    };
    compare(now.shadows, seenLooks_.shadows, changes_.shadows);
    compare(now.occlusion, seenLooks_.occlusion, changes_.occlusion);
    compare(now.errorPixels, seenLooks_.errorPixels, changes_.errorPixels);
    compare(now.budgetBytes, seenLooks_.budgetBytes, changes_.budgetBytes);
    compare(now.backgroundTop, seenLooks_.backgroundTop, changes_.backgroundTop);
    compare(now.backgroundBottom, seenLooks_.backgroundBottom, changes_.backgroundBottom);
    seenLooks_ = now;
}

}  // namespace vcp
