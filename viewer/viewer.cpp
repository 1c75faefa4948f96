#include "viewer/viewer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "viewer/option_values.h"

namespace vcp {

namespace {

// The camera counts as moving for so long after it last did.
constexpr double kRestSeconds = 0.15;

// While pages arrive: how often they are looked for, and how often at most the picture is drawn anew. Drawing
// takes the processors from the loader where the device is software, hence a part of the time only.
constexpr double kLoadingPollSeconds = 0.01;
constexpr double kRefineSeconds = 0.1;
constexpr double kRefineFrames = 3;

constexpr int kLargestReduction = 4;
constexpr double kZoomPerNotch = 0.85;
constexpr double kSectionPerNotch = 0.01;  // of the bounding box's diagonal
constexpr uint32_t kOcclusionRays = 8;
// A dataset smaller than this part of the picture's height is far enough away.
constexpr double kSmallestInView = 1e-3;

ShadingMode next(ShadingMode mode) {
    return mode == ShadingMode::Error ? ShadingMode::Lit : static_cast<ShadingMode>(static_cast<int>(mode) + 1);
}

bool sameView(const OrbitCamera& a, const OrbitCamera& b) {
    return a.position == b.position && a.orientation == b.orientation && a.focusDistance == b.focusDistance &&
           a.projection == b.projection && a.fovY == b.fovY;
}

}  // namespace

std::string statusLine(const ViewerStatus& status) {
    std::string line;
    if (!status.problem.empty()) line += "! " + status.problem + " | ";
    line += fmt::format("{} | {} triangles | {}", status.name, formatCount(status.triangles), status.update.settled ? "settled" : "loading");
    // What matters most comes first: a narrow window cuts the line off.
    if (status.update.drawable) {
        const auto [coarsest, finest] = std::pair(status.update.coarsestLevel, status.update.finestLevel);
        const std::string levels = coarsest == finest ? fmt::format("level {}", finest) : fmt::format("levels {} to {}", coarsest, finest);
        line += fmt::format(" | {} (finest {})", levels, status.levels - 1);
        if (coarsest + 1 < status.levels) line += fmt::format(" | error {:.2g} px", status.update.errorPixels);
    }
    if (status.reduction > 1) line += fmt::format(" | 1/{} size", status.reduction);
    line += fmt::format(" | {:.0f} ms | {}{}", status.frame.msFrame, status.device, status.software ? " (software)" : "");
    if (status.update.drawable) line += fmt::format(" | {} of {}", formatBytes(status.update.residentBytes), formatBytes(status.budgetBytes));
    return line;
}

Result<std::unique_ptr<Viewer>> Viewer::create(const ViewerOptions& options) {
    auto renderer = Renderer::create(options.renderer);
    if (!renderer) return renderer.error();
    return std::unique_ptr<Viewer>(new Viewer(options, *std::move(renderer)));
}

Viewer::Viewer(const ViewerOptions& options, std::unique_ptr<Renderer> renderer)
    : options_(options), renderer_(std::move(renderer)), shading_(options.shading), sections_(options.sections), sectionCaps_(options.sectionCaps) {
    status_.device = renderer_->device().name;
    status_.software = renderer_->device().software;
    status_.budgetBytes = options.renderer.budgetBytes;
}

Result<void> Viewer::open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source,
                          const OrbitCamera& camera, std::string name) {
    VCP_TRY(renderer_->open(dataset, std::move(source)));
    dataset_ = std::move(dataset);
    const FileHeader& header = dataset_->header;
    bounds_ = {{header.boundsMin[0], header.boundsMin[1], header.boundsMin[2]},
               {header.boundsMax[0], header.boundsMax[1], header.boundsMax[2]}};
    camera_ = home_ = seen_ = camera;
    drawn_.reset();
    drag_ = Drag::None;
    status_.name = std::move(name);
    status_.triangles = header.triangles;
    status_.levels = header.levels;
    status_.update = {};
    status_.problem.clear();
    return {};
}

void Viewer::resize(glm::ivec2 size) { size_ = glm::clamp(size, glm::ivec2(0), glm::ivec2(16384)); }

std::optional<glm::dvec3> Viewer::pointAt(glm::dvec2 pixel) {
    if (!drawn_ || !hasSize()) return std::nullopt;
    // The last picture may be smaller than the window it is shown in.
    const glm::dvec2 at = pixel * glm::dvec2(drawn_->width, drawn_->height) / glm::dvec2(size_);
    if (at.x < 0 || at.y < 0 || at.x >= drawn_->width || at.y >= drawn_->height) return std::nullopt;
    const auto hit = renderer_->pick(static_cast<uint32_t>(at.x), static_cast<uint32_t>(at.y));
    if (!hit || !*hit) return std::nullopt;
    return (*hit)->position;
}

glm::dvec3 Viewer::pointOfInterest(glm::dvec2 pixel) {
    const auto hit = pointAt(pixel);
    if (hit && camera_.depthOf(*hit) > 0) {
        // The hit is known to the picture's pixel; the cursor's own ray at its depth is where the hand is.
        const CameraRay ray = camera_.rayThrough(pixel, size_);
        const double along = glm::dot(ray.direction, camera_.forwardVector());
        return ray.origin + ray.direction * (camera_.depthOf(*hit) / along);
    }
    const double depth = camera_.depthOf(bounds_.centre());
    const CameraRay ray = camera_.rayThrough(pixel, size_);
    const double along = glm::dot(ray.direction, camera_.forwardVector());
    return ray.origin + ray.direction * ((depth > 0 ? depth : camera_.focusDistance) / along);
}

void Viewer::press(MouseButton button, glm::dvec2 pixel, bool shift) {
    if (drag_ != Drag::None || !hasSize() || !dataset_) return;
    dragButton_ = button;
    cursor_ = pixel;
    drag_ = button == MouseButton::Left && !shift ? Drag::Orbit : Drag::Pan;
    const bool onSurface = drag_ == Drag::Pan || pointAt(pixel);
    pivot_ = onSurface ? pointOfInterest(pixel) : bounds_.centre();
}

void Viewer::move(glm::dvec2 pixel) {
    const glm::dvec2 by = pixel - cursor_;
    if (drag_ == Drag::Orbit) {
        // A drag over the picture's height is half a turn; what is under the cursor goes where it goes.
        const double perPixel = std::numbers::pi / std::max(1, size_.y);
        camera_.orbit(pivot_, -by.x * perPixel, -by.y * perPixel);
    } else if (drag_ == Drag::Pan) {
        camera_.pan(cursor_, pixel, camera_.depthOf(pivot_), size_);
    }
    cursor_ = pixel;
}

void Viewer::release(MouseButton button) {
    if (button == dragButton_) drag_ = Drag::None;
}

void Viewer::scroll(glm::dvec2 pixel, double steps, bool shift) {
    if (!hasSize() || !dataset_ || steps == 0) return;
    if (shift && !sections_.empty()) return moveSections(steps);
    const double factor = std::pow(kZoomPerNotch, std::clamp(steps, -20.0, 20.0));
    if (factor > 1 && kSmallestInView * camera_.viewHeight() > bounds_.diagonal()) return;
    camera_.zoomAbout(pointOfInterest(pixel), factor);
}

void Viewer::look(View view) { camera_.look(view, bounds_, size_); }

void Viewer::toggleLight() {
    // The light stays where it is at this moment: only what it is tied to changes.
    const glm::dquat turn = shading_.lightFollowsCamera ? camera_.orientation : glm::conjugate(camera_.orientation);
    shading_.lightDirection = glm::vec3(turn * glm::dvec3(shading_.lightDirection));
    shading_.lightFollowsCamera = !shading_.lightFollowsCamera;
}

void Viewer::toggleProjection() {
    camera_.projection =
        camera_.projection == Projection::Perspective ? Projection::Orthographic : Projection::Perspective;
}

void Viewer::toggleSection() {
    if (sections_.empty()) {
        const glm::dvec3 ahead = camera_.forwardVector();
        sections_ = {{ahead, glm::dot(ahead, bounds_.centre())}};
        sectionCaps_ = true;
    } else {
        sections_.clear();
    }
}

void Viewer::moveSections(double steps) {
    const double by = kSectionPerNotch * bounds_.diagonal() * std::clamp(steps, -20.0, 20.0);
    for (SectionPlane& plane : sections_) plane.offset += by * glm::length(plane.normal);
}

void Viewer::act(ViewerAction action) {
    if (!dataset_ || !hasSize()) return;
    switch (action) {
        case ViewerAction::Fit: camera_.fit(bounds_, size_); break;
        case ViewerAction::Reset: camera_ = home_; break;
        case ViewerAction::ToggleLight: toggleLight(); break;
        case ViewerAction::ToggleShadows: shading_.shadows = !shading_.shadows; break;
        case ViewerAction::ToggleOcclusion: shading_.occlusionRays = shading_.occlusionRays > 0 ? 0 : kOcclusionRays; break;
        case ViewerAction::ToggleSection: toggleSection(); break;
        case ViewerAction::NextShading: shading_.mode = next(shading_.mode); break;
        case ViewerAction::ToggleProjection: toggleProjection(); break;
        case ViewerAction::ViewFront: look(View::Front); break;
        case ViewerAction::ViewRight: look(View::Right); break;
        case ViewerAction::ViewTop: look(View::Top); break;
        case ViewerAction::ViewIsometric: look(View::Isometric); break;
    }
}

bool Viewer::isMoving(double now) const { return now - movedAt_ < kRestSeconds; }

int Viewer::reductionAt(double now) const {
    if (options_.movingFrameMs <= 0 || fullFrameMs_ <= options_.movingFrameMs || !isMoving(now)) return 1;
    const double wanted = std::ceil(std::sqrt(fullFrameMs_ / options_.movingFrameMs));
    return static_cast<int>(std::min<double>(wanted, kLargestReduction));
}

FrameRequest Viewer::requestWith(int reduction) const {
    FrameRequest request;
    request.camera = camera_.current();
    request.width = static_cast<uint32_t>(std::max(1, size_.x / reduction));
    request.height = static_cast<uint32_t>(std::max(1, size_.y / reduction));
    request.errorPixels = options_.errorPixels;
    request.shading = shading_;
    if (isMoving(now_)) request.shading.occlusionRays = 0;
    request.sections = sections_;
    request.sectionCaps = sectionCaps_;
    request.march = options_.march;
    return request;
}

bool Viewer::refinementIsDue(double now) const {
    if (!pagesChanged_) return false;
    if (status_.update.settled || !drawn_) return true;
    return now - drawnAt_ >= std::max(kRefineSeconds, kRefineFrames * 1e-3 * status_.frame.msFrame);
}

Result<NextStep> Viewer::update(double now) {
    now_ = now;
    if (!hasSize() || !dataset_) return NextStep{};
    if (drawn_ && !sameView(camera_, seen_)) movedAt_ = now;
    seen_ = camera_;
    requestReduction_ = reductionAt(now);
    request_ = requestWith(requestReduction_);
    auto update = renderer_->update(request_);
    if (!update) return update.error();
    pagesChanged_ = pagesChanged_ || update->changed;
    if (!update->problems.empty()) status_.problem = update->problems.back().line();
    status_.update = *std::move(update);
    return nextStep(now);
}

NextStep Viewer::nextStep(double now) const {
    NextStep next;
    // A dataset whose coarsest page cannot be read shows the background, and says why.
    const bool canDraw = status_.update.drawable || !status_.problem.empty();
    next.draw = canDraw && (!drawn_ || *drawn_ != request_ || refinementIsDue(now));
    if (!status_.update.settled) next.waitSeconds = kLoadingPollSeconds;
    const bool isCheaper = requestReduction_ > 1 || request_.shading.occlusionRays != shading_.occlusionRays;
    if (isCheaper)
        next.waitSeconds = std::min(next.waitSeconds, std::max(0.0, movedAt_ + kRestSeconds - now));
    return next;
}

Result<void> Viewer::draw() {
    auto stats = renderer_->render(request_);
    if (!stats) return stats.error();
    status_.frame = *stats;
    status_.reduction = requestReduction_;
    // The first frame also compiles; it says nothing about the next.
    if (requestReduction_ == 1 && framesDrawn_ > 0)
        fullFrameMs_ = stats->msFrame - (request_.shading.occlusionRays > 0 ? stats->msLight : 0);
    ++framesDrawn_;
    drawn_ = request_;
    drawnAt_ = now_;
    pagesChanged_ = false;
    return {};
}

}  // namespace vcp
