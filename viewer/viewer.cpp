#include "viewer/viewer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/pixel_samples.h"
#include "viewer/asset/share_out.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

// The camera counts as moving for so long after it last did.
constexpr double kRestSeconds = 0.15;

// While pages arrive: how often they are looked for, and how often at most the picture is drawn anew. On a software
// device drawing takes the processors from the loader, so it is done only a part of the time.
constexpr double kLoadingPollSeconds = 0.01;
constexpr double kRefineSeconds = 0.1;
constexpr double kRefineFrames = 3;

constexpr double kStepPollSeconds = 0.004;
// What is not measured is said to be less than all.
constexpr double kAlmostMeasured = 0.999;

constexpr double kZoomPerNotch = 0.85;
constexpr double kSectionPerNotch = 0.01;  // part of the bounding box's diagonal
constexpr double kFarthestSection = 4;     // the most that a drag moves a plane, in diagonals
constexpr double kFlySeconds = 4;          // time that flying over the dataset's diagonal takes, at speed 1
constexpr double kLongestFlyStep = 0.1;    // in seconds: a delay must not become a leap
constexpr double kFlySpeedPerNotch = 1.25;
// A dataset smaller than this part of the picture's height is far enough away.
constexpr double kSmallestInView = 1e-3;

ShadingMode next(ShadingMode mode) {
    return mode == ShadingMode::Wireframe ? ShadingMode::Lit : static_cast<ShadingMode>(int(mode) + 1);
}

/// Shortens a long name in its middle.
std::string shortened(const std::string& name, size_t most) {
    constexpr size_t kLeast = 8;
    if (name.size() <= std::max(most, kLeast)) return name;
    const size_t half = (std::max(most, kLeast) - 2) / 2;
    return name.substr(0, half) + ".." + name.substr(name.size() - half);
}

/// Returns a part of the way that starts and ends slowly.
double eased(double part) { return part * part * (3 - 2 * part); }

bool sameView(const OrbitCamera& a, const OrbitCamera& b) {
    return a.position == b.position && a.orientation == b.orientation && a.focusDistance == b.focusDistance &&
           a.projection == b.projection && a.fovY == b.fovY;
}

}  // namespace

std::string remeshedText(const FrameStats& stats) {
    if (stats.missingHeights > 0)
        return "from coarser heights where " + formatCount(stats.missingHeights, "tile", "tiles") + " are not there";
    if (stats.remeshedPixels == 0 && stats.uncertifiedPatches == 0) return {};
    const std::string beyond = formatCount(stats.uncertifiedPatches, "patch", "patches") + " may be farther off";
    if (stats.remeshedPixels == 0) return beyond;
    const std::string within = "within " + formatPixels(stats.remeshedPixels) + " px";
    return stats.uncertifiedPatches > 0 ? within + ", " + beyond : within;
}

std::string formatPixels(double pixels) {
    return pixels < 10 ? fmt::format("{:.2g}", pixels) : fmt::format("{:.0f}", pixels);
}

/// Says what errs most in a picture, and by how many pixels.
static std::string errorText(const UpdateResult& update) {
    const bool isOfColour = detailLimitOf(update) == DetailLimit::Colour;
    return fmt::format("{} {} px", isOfColour ? "colour" : "error", formatPixels(refinedPixels(update)));
}

std::string statusLine(const ViewerStatus& status, size_t most) {
    const std::string device = status.device + (status.software ? " (software)" : "");
    if (status.name.empty()) return device.substr(0, most);
    // The most important parts come first: a narrow window has no room for the rest.
    std::vector<std::string> parts{shortened(status.name, most / 3), textOf(status.detail)};
    if (status.measuredPart < 1) parts.back() = fmt::format("measuring heights, {:.0f} %", 100 * status.measuredPart);
    if (!status.without.empty()) parts.push_back(status.without);
    if (status.update.drawable && status.levels > 0) {
        const auto [coarsest, finest] = std::pair(status.update.coarsestLevel, status.update.finestLevel);
        const std::string levels =
            coarsest == finest ? fmt::format("level {}", finest) : fmt::format("levels {} to {}", coarsest, finest);
        parts.push_back(fmt::format("{} (finest {})", levels, status.levels - 1));
        if (coarsest + 1 < status.levels) parts.push_back(errorText(status.update));
    }
    if (status.reduction > 1) parts.push_back(fmt::format("1/{} size", status.reduction));
    parts.push_back(fmt::format("{:.0f} ms", status.frame.msFrame));
    if (status.levels > 0) parts.push_back(formatCount(status.triangles, "triangle"));
    if (status.frame.surfaceBytes > 0) parts.push_back("mesostructure " + formatBytes(status.frame.surfaceBytes));
    if (status.update.drawable && status.levels > 0)
        parts.push_back(
            fmt::format("{} of {}", formatBytes(status.update.residentBytes), formatBytes(status.budgetBytes)));
    parts.push_back(device);
    std::string line = parts.front();
    for (size_t i = 1; i < parts.size() && line.size() + 3 + parts[i].size() <= most; ++i) line += " | " + parts[i];
    return line;
}

Result<std::unique_ptr<Viewer>> Viewer::create(const ViewerOptions& options) {
    VCP_TRY_ASSIGN(auto renderer, Renderer::create(options.renderer));
    return std::unique_ptr<Viewer>(new Viewer(options, std::move(renderer)));
}

std::unique_ptr<Viewer> Viewer::on(std::unique_ptr<Renderer> view, const ViewerOptions& options) {
    return std::unique_ptr<Viewer>(new Viewer(options, std::move(view)));
}

Viewer::Viewer(const ViewerOptions& options, std::unique_ptr<Renderer> renderer)
    : options_(options),
      renderer_(std::move(renderer)),
      shading_(options.shading),
      sections_(options.sections),
      sectionCaps_(options.sectionCaps),
      movingSize_(options.movingFrameMs),
      movingOcclusion_(options.movingFrameMs) {
    status_.device = renderer_->device().name;
    status_.software = renderer_->device().software;
    status_.budgetBytes = options.renderer.budgetBytes;
}

Result<void> Viewer::open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source,
                          const OrbitCamera& camera, std::string name) {
    std::vector<PlacedDataset> one;
    one.push_back({std::move(dataset), std::move(source), {}});
    return open(std::move(one), {}, camera, std::move(name));
}

Result<void> Viewer::open(std::vector<PlacedDataset> datasets, const MesoScene& surfaces, const OrbitCamera& camera,
                          std::string name) {
    if (datasets.empty() && surfaces.surfaces.empty())
        return Error{.code = ErrorCode::Usage, .message = "there is nothing to open"};
    VCP_TRY(renderer_->open(datasets, surfaces.surfaces));
    show(datasets, surfaces, camera, std::move(name));
    return {};
}

void Viewer::show(const std::vector<PlacedDataset>& datasets, const MesoScene& surfaces, const OrbitCamera& camera,
                  std::string name) {
    dataset_ = datasets.empty() ? nullptr : datasets.front().dataset;
    isOpen_ = hasBounds_ = true;
    isPaper_ = !datasets.empty() && surfaces.surfaces.empty();
    hasChannels_ = hasColourErrors_ = false;
    bounds_ = surfaces.bounds;
    status_.triangles = status_.levels = 0;
    for (const PlacedDataset& each : datasets) {
        const FileHeader& header = each.dataset->header;
        bounds_ = bounds_.joined(placedBox({{header.boundsMin[0], header.boundsMin[1], header.boundsMin[2]},
                                            {header.boundsMax[0], header.boundsMax[1], header.boundsMax[2]}},
                                           each.placement));
        isPaper_ = isPaper_ && header.method == Method::Paper;
        hasChannels_ = hasChannels_ || (header.flags & kFlagChannels) != 0;
        hasColourErrors_ = hasColourErrors_ || (header.flags & kFlagColourErrors) != 0;
        status_.triangles += header.triangles;
        status_.levels = std::max(status_.levels, header.levels);
    }
    camera_ = home_ = seen_ = camera;
    drawn_.reset();
    hasSettled_ = false;
    drag_ = Drag::None;
    move_.reset();
    sectionDrag_.reset();
    sectionAnchors_.clear();
    motion_ = SurfaceMotion(surfaces.paths);
    hidden_.clear();
    looks_.clear();
    flySpeed_ = 1;
    status_.name = std::move(name);
    status_.update = {};
    status_.detail = Detail::Loading;
    status_.problem.clear();
}

Result<void> Viewer::setBudget(uint64_t bytes) {
    VCP_TRY(renderer_->setBudgets(bytes, options_.renderer.ramBytes));
    status_.budgetBytes = bytes;
    return {};
}

void Viewer::foresee(const Box& bounds, const OrbitCamera& camera) {
    hasBounds_ = true;
    bounds_ = bounds;
    camera_ = camera;
}

void Viewer::resize(glm::ivec2 size) {
    mostSamples_ = kMostSamples;
    size_ = glm::clamp(size, glm::ivec2(0), glm::ivec2(16384));
}

std::optional<PixelHit> Viewer::hitAt(glm::dvec2 pixel) {
    if (!drawn_ || !hasSize()) return std::nullopt;
    // The last picture may be smaller than the window it is shown in.
    const auto hit = renderer_->pickAt(pixel, glm::dvec2(size_));
    return hit ? *hit : std::nullopt;
}

std::optional<glm::dvec3> Viewer::pointAt(glm::dvec2 pixel) {
    const auto hit = hitAt(pixel);
    return hit ? std::optional(hit->position) : std::nullopt;
}

std::optional<glm::dvec3> Viewer::capAt(glm::dvec2 pixel) {
    const auto hit = hitAt(pixel);
    if (!hit || !hit->onCap) return std::nullopt;
    // The ray enters what is kept through the last of the planes that it crosses towards it.
    const CameraRay ray = camera_.rayThrough(pixel, size_);
    double enter = 0;
    for (const SectionPlane& plane : sections_) {
        const double along = glm::dot(plane.normal, ray.direction);
        if (along > 0) enter = std::max(enter, (plane.offset - glm::dot(plane.normal, ray.origin)) / along);
    }
    return ray.origin + ray.direction * enter;
}

glm::dvec3 Viewer::pointOfInterest(glm::dvec2 pixel) {
    const auto hit = pointAt(pixel);
    if (hit && camera_.depthOf(*hit) > 0) {
        // The hit is known to a pixel of the picture; the hand is on the cursor's own ray, at the hit's depth.
        const CameraRay ray = camera_.rayThrough(pixel, size_);
        const double along = glm::dot(ray.direction, camera_.forwardVector());
        return ray.origin + ray.direction * (camera_.depthOf(*hit) / along);
    }
    const double depth = camera_.depthOf(bounds_.centre());
    const CameraRay ray = camera_.rayThrough(pixel, size_);
    const double along = glm::dot(ray.direction, camera_.forwardVector());
    return ray.origin + ray.direction * ((depth > 0 ? depth : camera_.focusDistance) / along);
}

void Viewer::press(MouseButton button, glm::dvec2 pixel, Modifiers modifiers) {
    if (drag_ != Drag::None || !hasSize() || !hasBounds_) return;
    move_.reset();
    dragButton_ = button;
    cursor_ = pixel;
    const bool left = button == MouseButton::Left;
    if (left && !modifiers.shift && !modifiers.control && gripSection(pixel)) return;
    drag_ = !left || modifiers.shift ? Drag::Pan
            : modifiers.control      ? Drag::Light
            : isFlying_              ? Drag::Head
                                     : Drag::Orbit;
    const bool onSurface = drag_ == Drag::Pan || pointAt(pixel);
    pivot_ = onSurface ? pointOfInterest(pixel) : bounds_.centre();
}

void Viewer::move(glm::dvec2 pixel) {
    const glm::dvec2 by = pixel - cursor_;
    // A drag over the picture's height is half a turn; what is under the cursor moves with it.
    const double perPixel = std::numbers::pi / std::max(1, size_.y);
    const double headPerPixel = camera_.fovY / std::max(1, size_.y);
    switch (drag_) {
        case Drag::None:
            break;
        case Drag::Section:
            dragSection(pixel);
            break;
        case Drag::Orbit:
            camera_.orbit(pivot_, -by.x * perPixel, -by.y * perPixel);
            break;
        case Drag::Pan:
            camera_.pan(cursor_, pixel, camera_.depthOf(pivot_), size_);
            break;
        case Drag::Light:
            turnLight(by * perPixel);
            break;
        case Drag::Head:
            camera_.turnHead(by.x * headPerPixel, by.y * headPerPixel);
            break;
    }
    cursor_ = pixel;
}

void Viewer::release(MouseButton button) {
    if (button != dragButton_) return;
    drag_ = Drag::None;
    sectionDrag_.reset();
}

void Viewer::setSections(std::vector<SectionPlane> planes) {
    sections_ = std::move(planes);
    if (std::exchange(sectionDrag_, std::nullopt)) drag_ = Drag::None;
    sectionAnchors_.clear();
}

std::vector<SectionHandle> Viewer::sectionHandles() const {
    std::vector<SectionHandle> handles;
    if (handleScale_ <= 0 || !isOpen_ || !hasSize()) return handles;
    for (size_t i = 0; i < sections_.size(); ++i) {
        const glm::dvec3 anchor =
            onPlane(sections_[i], i < sectionAnchors_.size() ? sectionAnchors_[i] : bounds_.centre());
        if (auto handle = sectionHandle(sections_[i], i, anchor, camera_, size_, handleScale_))
            handles.push_back(*std::move(handle));
    }
    return handles;
}

SectionGrab Viewer::sectionGrab() const {
    if (sectionDrag_) return sectionDrag_->grab();
    return drag_ == Drag::None ? grabAt(sectionHandles(), cursor_, handleScale_) : SectionGrab{};
}

bool Viewer::gripSection(glm::dvec2 pixel) {
    const std::vector<SectionHandle> handles = sectionHandles();
    const SectionGrab grab = grabAt(handles, pixel, handleScale_);
    if (grab.grip == SectionGrip::None) return false;
    const auto handle = std::find_if(handles.begin(), handles.end(),
                                     [&](const SectionHandle& each) { return each.plane == grab.plane; });
    sectionAnchors_.resize(std::max(sectionAnchors_.size(), sections_.size()), bounds_.centre());
    sectionAnchors_[handle->plane] = handle->anchor;
    sectionDrag_.emplace(*handle, grab.grip, sections_[handle->plane], pixel, camera_, size_, handleScale_);
    drag_ = Drag::Section;
    return true;
}

void Viewer::dragSection(glm::dvec2 pixel) {
    const size_t plane = sectionDrag_->grab().plane;
    sections_[plane] = sectionDrag_->at(pixel, kFarthestSection * bounds_.diagonal());
}

bool Viewer::cancelSectionDrag() {
    if (!sectionDrag_) return false;
    sections_[sectionDrag_->grab().plane] = sectionDrag_->before();
    sectionDrag_.reset();
    drag_ = Drag::None;
    return true;
}

void Viewer::scroll(glm::dvec2 pixel, double steps, bool shift) {
    if (!hasSize() || !hasBounds_ || steps == 0) return;
    if (shift && !sections_.empty()) return moveSections(steps);
    move_.reset();
    if (isFlying_) {
        flySpeed_ = std::clamp(flySpeed_ * std::pow(kFlySpeedPerNotch, steps), 1e-6, 1e3);
        return;
    }
    const double factor = std::pow(kZoomPerNotch, std::clamp(steps, -20.0, 20.0));
    if (factor > 1 && kSmallestInView * camera_.viewHeight() > bounds_.diagonal()) return;
    camera_.zoomAbout(pointOfInterest(pixel), factor);
}

void Viewer::moveTo(const OrbitCamera& camera) {
    if (!isOpen_) return;
    move_.reset();
    if (options_.moveSeconds <= 0)
        camera_ = camera;
    else if (!sameView(camera_, camera) || camera_.up != camera.up)
        move_ = {camera_, camera, std::numeric_limits<double>::quiet_NaN()};
}

void Viewer::look(View view) {
    OrbitCamera there = camera_;
    there.look(view, bounds_, size_, covered_);
    moveTo(there);
}

void Viewer::centreOn(glm::dvec2 pixel) {
    const auto point = pointAt(pixel);
    if (!point) return;
    OrbitCamera there = camera_;
    there.centreOn(*point);
    moveTo(there);
}

void Viewer::turnLight(glm::dvec2 by) {
    if (!areLightsOn(shading_)) {
        shading_.environment->turn += float(glm::degrees(by.x));
        return;
    }
    const glm::dquat camera = shading_.lightFollowsCamera ? glm::dquat(1, 0, 0, 0) : camera_.orientation;
    const glm::dquat turn = glm::angleAxis(by.x, glm::dvec3(0, 1, 0)) * glm::angleAxis(by.y, glm::dvec3(1, 0, 0));
    const glm::dvec3 direction = camera * (turn * (glm::conjugate(camera) * glm::dvec3(shading_.lightDirection)));
    shading_.lightDirection = glm::vec3(glm::normalize(direction));
}

void Viewer::advanceCamera(double now) {
    if (move_) {
        if (std::isnan(move_->beganAt)) move_->beganAt = now;
        const double part = (now - move_->beganAt) / options_.moveSeconds;
        camera_ = between(move_->from, move_->to, eased(std::clamp(part, 0.0, 1.0)));
        if (part >= 1) move_.reset();
    } else if (isFlown()) {
        const double step = std::min(now - now_, kLongestFlyStep) * flySpeed_ * bounds_.diagonal() / kFlySeconds;
        camera_.position +=
            camera_.orientation * (glm::dvec3(flyDirection_.x, flyDirection_.y, -flyDirection_.z) * step);
    }
}

void Viewer::toggleLight() {
    // The light stays where it is at this moment: only what it is tied to changes.
    const glm::dquat turn = shading_.lightFollowsCamera ? camera_.orientation : glm::conjugate(camera_.orientation);
    shading_.lightDirection = glm::vec3(turn * glm::dvec3(shading_.lightDirection));
    shading_.lightFollowsCamera = !shading_.lightFollowsCamera;
}

void Viewer::toggleProjection() {
    move_.reset();
    camera_.projection =
        camera_.projection == Projection::Perspective ? Projection::Orthographic : Projection::Perspective;
}

void Viewer::toggleSection() {
    if (sections_.empty()) {
        const glm::dvec3 ahead = camera_.forwardVector();
        setSections({{ahead, glm::dot(ahead, bounds_.centre())}});
        if (sectionCaps_ == Caps::None) sectionCaps_ = Caps::Closed;
    } else {
        setSections({});
    }
}

void Viewer::moveSections(double steps) {
    const double by = kSectionPerNotch * bounds_.diagonal() * std::clamp(steps, -20.0, 20.0);
    for (SectionPlane& plane : sections_) plane.offset += by * glm::length(plane.normal);
}

std::string Viewer::whyWithout(ViewerAction action) const {
    if (action == ViewerAction::ToggleShadows && !areLightsOn(shading_)) return "surroundings alone cast no shadows";
    if (action == ViewerAction::TogglePlay && isOpen_ && !motion_.isThere()) return "nothing moves in this scene";
    if (!isPaper_) return {};
    if (action == ViewerAction::ToggleShadows) return "files of the method paper are drawn without shadows";
    if (action == ViewerAction::ToggleOcclusion) return "files of the method paper are drawn without ambient occlusion";
    if (action == ViewerAction::ToggleSection && !sections_.empty())
        return "sections of files of the method paper have no caps";
    return {};
}

void Viewer::act(ViewerAction action) {
    if (!isOpen_ || !hasSize()) return;
    switch (action) {
        case ViewerAction::Fit: {
            OrbitCamera there = camera_;
            there.fit(bounds_, size_, covered_);
            moveTo(there);
            break;
        }
        case ViewerAction::Reset:
            moveTo(home_);
            break;
        case ViewerAction::ToggleLight:
            toggleLight();
            break;
        case ViewerAction::ToggleShadows:
            shading_.shadows = !shading_.shadows;
            break;
        case ViewerAction::ToggleOcclusion:
            shading_.occlusionRays = shading_.occlusionRays > 0 ? 0 : kUsualOcclusionRays;
            break;
        case ViewerAction::ToggleSection:
            toggleSection();
            break;
        case ViewerAction::NextShading:
            shading_.mode = next(shading_.mode);
            break;
        case ViewerAction::ToggleProjection:
            toggleProjection();
            break;
        case ViewerAction::ToggleColour:
            shading_.mode = shading_.mode == ShadingMode::Clay ? ShadingMode::Lit : ShadingMode::Clay;
            break;
        case ViewerAction::ToggleUpAxis: {
            OrbitCamera there = camera_;
            there.standUp(camera_.up == UpAxis::Y ? UpAxis::Z : UpAxis::Y);
            moveTo(there);
            break;
        }
        case ViewerAction::ToggleFly:
            isFlying_ = !isFlying_;
            break;
        case ViewerAction::TogglePlay:
            motion_.play(!motion_.isPlaying());
            break;
        case ViewerAction::ViewFront:
            look(View::Front);
            break;
        case ViewerAction::ViewRight:
            look(View::Right);
            break;
        case ViewerAction::ViewTop:
            look(View::Top);
            break;
        case ViewerAction::ViewIsometric:
            look(View::Isometric);
            break;
    }
}

bool Viewer::isMoving(double now) const { return now - movedAt_ < kRestSeconds; }

int Viewer::reductionAt(double now) {
    if (!isMoving(now)) movingSize_.rest();
    // A view that holds still for a moment is not drawn again, coarser, because its picture took long.
    return isMoving(now) ? movingSize_.next(now <= movedAt_) : 1;
}

void Viewer::advanceMotion(double now) {
    // What is drawn step by step is finished first.
    if (!motion_.isPlaying() || !drawn_ || renderer_->isUnfinished()) return;
    motion_.advance(now - now_);
    movedAt_ = now;
}

FrameRequest Viewer::requestWith(int reduction) const {
    FrameRequest request;
    request.camera = camera_.current();
    request.width = uint32_t(std::max(1, size_.x / reduction));
    request.height = uint32_t(std::max(1, size_.y / reduction));
    request.errorPixels = options_.errorPixels;
    request.shading = shading_;
    request.colourError = colourErrorIn(shading_.mode, options_.colourError);
    if (request.shading.environment) request.shading.environment->up = directionOf(camera_.up);
    // The first pictures of a scene come without, so that there is something to look at.
    const bool isFirst = options_.framesAhead && isOpen_ && !hasSettled_;
    if ((isMoving(now_) && !movingOcclusion_.keeps()) || isFirst) request.shading.occlusionRays = 0;
    request.sections = sections_;
    request.sectionCaps = sectionCaps_;
    request.march = options_.march;
    request.hidden = hidden_;
    request.looks = looks_;
    request.surfacesMoved = motion_.surfacesMoved();
    return request;
}

DatasetLook Viewer::lookOf(uint32_t dataset) const {
    const auto at = std::ranges::find(looks_, dataset, &DatasetLook::dataset);
    return at != looks_.end() ? *at : DatasetLook{.dataset = dataset, .colour = {}};
}

void Viewer::setLook(const DatasetLook& look) {
    std::erase_if(looks_, [&](const DatasetLook& each) { return each.dataset == look.dataset; });
    if (look != DatasetLook{.dataset = look.dataset, .colour = {}}) looks_.push_back(look);
}

FrameRequest Viewer::pictureOf(glm::ivec2 size) const {
    FrameRequest request = requestWith(1);
    request.shading.occlusionRays = shading_.occlusionRays;
    request.width = uint32_t(size.x);
    request.height = uint32_t(size.y);
    return request;
}

bool Viewer::refinementIsDue(double now) const {
    if (!pagesChanged_) return false;
    if (status_.update.settled || status_.update.awaitsRays || !drawn_) return true;
    return now - drawnAt_ >= std::max(kRefineSeconds, kRefineFrames * 1e-3 * status_.frame.msFrame);
}

Result<NextStep> Viewer::update(double now) {
    if (isOpen_) {
        advanceCamera(now);
        advanceMotion(now);
    }
    now_ = now;
    if (!hasSize()) return NextStep{};
    if (drawn_ && (!sameView(camera_, seen_) || (sectionDrag_ && sections_ != request_.sections))) movedAt_ = now;
    seen_ = camera_;
    requestReduction_ = reductionAt(now);
    request_ = requestWith(requestReduction_);
    status_.drawnPart = renderer_->finishedPart();
    // Pages are taken in when the picture is finished: it is of those that were there when it was begun.
    if (goesOnDrawing()) return NextStep{!renderer_->isBusy(), kStepPollSeconds};
    VCP_TRY_ASSIGN(auto update, renderer_->update(request_));
    pagesChanged_ = pagesChanged_ || update.changed;
    if (!update.problems.empty()) status_.problem = update.problems.back().line();
    status_.detail = detailOf(update, request_.errorPixels);
    hasSettled_ = hasSettled_ || update.settled;
    status_.update = std::move(update);
    if (options_.framesAhead && renderer_->lastDone()) takeStats(*renderer_->lastDone());
    return measuredFirst(nextStep(now));
}

/// Measures heights for a while where a new picture is to be drawn, which waits until all are measured.
Result<NextStep> Viewer::measuredFirst(NextStep next) {
    status_.measuredPart = 1;
    if (givenUp_ != request_) givenUp_.reset();
    if (givenUp_) next.draw = false;
    if (!next.draw || addsSample_) return next;
    using Clock = std::chrono::steady_clock;
    const auto until = Clock::now() + std::chrono::duration<double, std::milli>(options_.measuringMs);
    double part = 0;
    int asked = 0;
    const auto chosen = renderer_->chooseCells(request_, [&](size_t count, const auto& fill) {
        return shareOut(count, fill, [&](double done) {
            part = done;
            // The first question comes before anything is measured.
            return asked++ == 0 || Clock::now() < until;
        });
    });
    if (chosen) return next;
    if (chosen.error().code != ErrorCode::Cancelled) return chosen.error();
    status_.measuredPart = std::min(part, kAlmostMeasured);
    status_.update.settled = false;
    return NextStep{.draw = false, .waitSeconds = 0};
}

bool Viewer::cancelMeasuring() {
    if (status_.measuredPart == 1) return false;
    givenUp_ = request_;
    status_.measuredPart = 1;
    return true;
}

bool Viewer::goesOnDrawing() const { return renderer_->isUnfinished() && request_ == begun_; }

/// Whether the last update's request leaves something out because the camera moves.
bool Viewer::isCheaper() const {
    return requestReduction_ > 1 || request_.shading.occlusionRays != shading_.occlusionRays;
}

bool Viewer::isAtRest() const { return status_.update.settled && !isCheaper() && !isUnderWay(); }

uint32_t Viewer::mostSamples() const { return std::min(mostSamples_, samplesOf(request_, options_.samples)); }

bool Viewer::wantsSamples() const {
    return isOpen_ && drawn_ == request_ && !pagesChanged_ && isAtRest() && status_.samples < mostSamples();
}

NextStep Viewer::nextStep(double now) {
    NextStep next;
    // Without a dataset, and where its coarsest page cannot be read, the background is shown.
    const bool canDraw = status_.update.drawable || !status_.problem.empty() || !isOpen_;
    const bool raysAreAsked = status_.update.awaitsRays && !renderer_->isDrawing();
    const bool isNew = !drawn_ || *drawn_ != request_ || refinementIsDue(now) || raysAreAsked;
    addsSample_ = !isNew && !isMoving(now) && wantsSamples();
    next.draw = canDraw && (isNew || addsSample_);
    const bool samplesFollow =
        isNew ? canDraw && isOpen_ && isAtRest() && samplesOf(request_, options_.samples) > 1 : wantsSamples();
    if (!status_.update.settled) next.waitSeconds = kLoadingPollSeconds;
    if (isCheaper() || samplesFollow)
        next.waitSeconds = std::min(next.waitSeconds, std::max(0.0, movedAt_ + kRestSeconds - now));
    if (isUnderWay()) next.waitSeconds = 0;
    // What a frame in flight tells is taken in by the next update.
    if (renderer_->isDrawing()) next.waitSeconds = std::min(next.waitSeconds, kLoadingPollSeconds);
    return next;
}

Result<bool> Viewer::waitForFrame() {
    if (!options_.framesAhead || !renderer_->isBusy()) return false;
    VCP_TRY(renderer_->waitForFrame());
    return true;
}

/// Draws a part of a sample. Where a device cannot add any to so large a picture, it stays as it is.
Result<bool> Viewer::drawSample() {
    const auto samples = renderer_->refineAhead();
    if (!samples && samples.error().code != ErrorCode::Limit) return samples.error();
    if (!samples) mostSamples_ = status_.samples;
    if (samples && *samples == 0) drawn_.reset();
    if (!samples || *samples <= status_.samples) return false;
    status_.samples = *samples;
    ++framesDrawn_;
    return true;
}

Result<bool> Viewer::draw() {
    if (goesOnDrawing()) {
        VCP_TRY_ASSIGN(const bool isLast, renderer_->continueFrame());
        if (isLast) finishDraw();
        pagesChanged_ = !isLast && !renderer_->isUnfinished();  // then it is begun anew
        return isLast;
    }
    if (addsSample_) return drawSample();
    if (options_.framesAhead) {
        const glm::dvec2 cursor = cursor_ * glm::dvec2(request_.width, request_.height) / glm::dvec2(size_);
        const bool isInside = cursor.x >= 0 && cursor.y >= 0 && cursor.x < request_.width && cursor.y < request_.height;
        const PicturePixel pixel{uint32_t(std::max(cursor.x, 0.0)), uint32_t(std::max(cursor.y, 0.0))};
        VCP_TRY(renderer_->renderAhead(request_, isInside ? std::optional(pixel) : std::nullopt));
        begun_ = request_;
        pagesChanged_ = false;
        if (renderer_->isUnfinished()) return false;
    } else {
        VCP_TRY(renderer_->render(request_));
    }
    finishDraw();
    return true;
}

/// Notes that there is a new picture.
void Viewer::finishDraw() {
    if (renderer_->lastDone()) takeStats(*renderer_->lastDone());
    status_.drawnPart = 1;
    status_.reduction = requestReduction_;
    status_.samples = 1;
    const bool wantsLight = request_.shading.shadows || shading_.occlusionRays > 0 ||
                            (request_.sectionCaps != Caps::None && !request_.sections.empty());
    status_.without = isPaper_ && wantsLight ? "method paper: no shadows, occlusion, caps" : "";
    ++framesDrawn_;
    drawn_ = request_;
    drawnAt_ = now_;
    pagesChanged_ = false;
}

/// Takes a frame's statistics for the status, and for the size of frames while the camera moves.
void Viewer::takeStats(const DoneFrame& done) {
    status_.frame = done.stats;
    status_.device = castBy(renderer_->device(), done.stats.onHost);
    // The first frame also compiles: it says nothing about the next.
    if (done.number == 1) return;
    const double toFull = double(size_.x) * size_.y / double(done.stats.rays);
    const bool hasOcclusion = done.request.shading.occlusionRays > 0;
    if (hasOcclusion) movingOcclusion_.take(toFull * done.stats.msFrame);
    // What occlusion took of a frame is known of a device's only.
    if (hasOcclusion && done.stats.onHost) return;
    const double light = hasOcclusion ? done.stats.msLight : 0;
    movingSize_.take(std::max(1, int(std::lround(double(size_.x) / done.request.width))),
                     toFull * (done.stats.msFrame - light));
}

}  // namespace vcp
