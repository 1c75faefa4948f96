#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <thread>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/picture.h"
#include "viewer/key_map.h"
#include "viewer/scene/environment.h"
#include "viewer/widget/handles.h"
#include "viewer/widget/window_surface.h"

namespace vcp::widget {

namespace {

constexpr uint32_t kLargestSide = 16384;
// A view without a size yet is fitted to a picture of this one.
constexpr glm::ivec2 kUsualSize(1280, 720);
constexpr double kPollSeconds = 0.1;

uint32_t usualSamples(bool hasWindow) { return hasWindow ? kMostSamples : kUsualSamples; }

Result<std::unique_ptr<vcp_view>> createView(vcp_context& context, const vcp_view_options& given) {
    VCP_TRY_ASSIGN(auto surface, surfaceSource(given));
    if (surface && !context.hasWindows) return wrong("the context was made without windows");
    if (given.width > kLargestSide || given.height > kLargestSide)
        return wrong("a view has at most 16384 pixels a side");
    if (!(given.moving_frame_ms >= 0) || !(given.move_seconds >= 0)) return wrong("a time is below 0 or not a number");
    VCP_TRY_ASSIGN(auto renderer, context.renderer->addView(surface));
    ViewerOptions options;
    options.renderer.budgetBytes = context.gpuBytes;
    options.renderer.ramBytes = context.ramBytes;
    options.movingFrameMs = given.moving_frame_ms;
    options.moveSeconds = given.move_seconds;
    options.samples = usualSamples(surface.has_value());
    auto made = std::make_unique<vcp_view>();
    made->context = &context;
    made->hasWindow = surface.has_value();
    made->up = given.z_is_up != 0 ? UpAxis::Z : UpAxis::Y;
    made->viewer = Viewer::on(std::move(renderer), options);
    made->viewer->resize({given.width, given.height});
    if (context.open) made->showScene();
    context.views.push_back(made.get());
    return made;
}

void tellOfUpdate(vcp_view& view) {
    const UpdateResult& update = view.viewer->status().update;
    vcp_context& context = *view.context;
    for (const Error& problem : update.problems) context.log(VCP_LOG_WARNING, problem.line());
    if (update.deviceLosses != view.losses) context.log(VCP_LOG_WARNING, "the device was lost and made anew");
    view.losses = update.deviceLosses;
    if (update.changed)
        for (vcp_view* other : context.views)
            if (other != &view) other->redrawIsNeeded();
    const bool isSettled = context.open && update.settled && update.drawable;
    const bool isNews = isSettled && !view.wasSettled;
    view.wasSettled = isSettled;
    if (isNews && context.callbacks.settled) context.callbacks.settled(context.callbacks.user, &view);
}

Result<void> update(vcp_view& view) {
    view.viewer->fly(view.fly);
    VCP_TRY_ASSIGN(view.next, view.viewer->update(view.context->now()));
    view.isUpdated = true;
    tellOfUpdate(view);
    return {};
}

Result<void> render(vcp_view& view) {
    if (!view.isUpdated) VCP_TRY(update(view));
    bool isNew = true;  // what is shown is shown again where nothing is drawn
    if (view.next.draw) {
        VCP_TRY_ASSIGN(isNew, view.viewer->draw());
    }
    view.next.draw = false;
    const bool hasNewLines = std::exchange(view.hasNewLines, false);
    isNew = isNew || hasNewLines;
    const glm::ivec2 size = view.viewer->size();
    if (!isNew || !view.hasWindow || size.x == 0 || size.y == 0) return {};
    return view.viewer->renderer().present(uint32_t(size.x), uint32_t(size.y));
}

Result<void> settle(vcp_view& view, double seconds) {
    if (!(seconds >= 0)) return wrong("a time to wait that is below 0 or not a number");
    const double begin = view.context->now();
    bool isLate = false;
    while (!isLate) {
        VCP_TRY(update(view));
        const Viewer& viewer = *view.viewer;
        if (viewer.status().update.settled && std::isinf(view.next.waitSeconds)) break;
        // Then what is drawn stays and gets its samples, or its rays say what they hit.
        if (viewer.isAtRest() || viewer.status().update.awaitsRays) VCP_TRY(render(view));
        const double left = begin + seconds - view.context->now();
        isLate = left <= 0;
        if (viewer.isAtRest() && view.next.waitSeconds <= 0) continue;
        const std::chrono::milliseconds wait(int(1000 * std::clamp(left, 0.0, kPollSeconds)));
        if (!view.viewer->status().update.settled)
            view.viewer->renderer().waitForPage(wait);
        else
            std::this_thread::sleep_for(
                std::min(wait, std::chrono::milliseconds(int(1000 * std::min(view.next.waitSeconds, kPollSeconds)))));
    }
    VCP_TRY(render(view));
    if (isLate)
        return Error{.code = ErrorCode::Cancelled, .message = fmt::format("not settled within {} seconds", seconds)};
    return {};
}

Result<void> readFrame(vcp_view& view, vcp_frame* out) {
    VCP_TRY_ASSIGN(auto frame, taken(out));
    if (!out) return wrong("there is no frame to write to");
    VCP_TRY_ASSIGN(const auto picture, view.viewer->renderer().readPicture());
    frame.width = picture.width;
    frame.height = picture.height;
    VCP_TRY(give(out, frame));
    const size_t pixels = size_t{picture.width} * picture.height;
    if ((frame.rgba && frame.rgba_size < 4 * pixels) || (frame.depth && frame.depth_size < pixels))
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("too little room for {} x {} pixels", picture.width, picture.height)};
    if (frame.rgba) std::memcpy(frame.rgba, picture.rgba.data(), picture.rgba.size());
    if (!frame.depth) return {};
    VCP_TRY_ASSIGN(const auto depth, view.viewer->renderer().readDepth());
    std::copy(depth.begin(), depth.end(), frame.depth);
    return {};
}

Result<void> savePng(vcp_view& view, const char* path) {
    if (!path || *path == '\0' || std::string_view(path) == "-") return wrong("there is no path to write to");
    VCP_TRY_ASSIGN(const auto picture, view.viewer->renderer().readPicture());
    return writePng(picture, path);
}

/// Refuses numbers of datasets that are not there.
Result<void> checkDataset(const vcp_view& view, uint32_t dataset) {
    const size_t datasets = view.context->open ? view.context->open->parts.size() : 0;
    if (dataset < datasets) return {};
    return wrong(fmt::format("there is no dataset {}: {} are open", dataset, datasets));
}

Result<void> setVisible(vcp_view& view, uint32_t dataset, bool isVisible) {
    VCP_TRY(checkDataset(view, dataset));
    std::vector<uint32_t> hidden = view.viewer->hidden();
    std::erase(hidden, dataset);
    if (!isVisible) hidden.push_back(dataset);
    view.viewer->setHidden(std::move(hidden));
    return {};
}

Result<void> copyToImage(vcp_view& view, const vcp_host_image* given) {
    if (!given) return wrong("there is no image");
    VCP_TRY_ASSIGN(const auto image, taken(given));
    ImageTarget target;
    // A handle is a pointer or a number, depending on the machine.
    std::memcpy(&target.image, &image.image, sizeof(target.image));
    std::memcpy(&target.wait, &image.wait, sizeof(target.wait));
    std::memcpy(&target.signal, &image.signal, sizeof(target.signal));
    target.width = image.width;
    target.height = image.height;
    if (image.layout_after != 0) target.layoutAfter = static_cast<VkImageLayout>(image.layout_after);
    return view.viewer->renderer().copyPicture(target);
}

Result<void> pick(vcp_view& view, double x, double y, vcp_pick* out) {
    if (!view.context->finest) return wrong("nothing is open");
    const glm::ivec2 size = view.viewer->size();
    vcp_pick picked{};
    if (x >= 0 && y >= 0 && x < size.x && y < size.y) {
        const CameraRay through = view.viewer->camera().rayThrough({x, y}, size);
        const Ray ray{through.origin, through.direction};
        const std::vector<SectionPlane>& sections = view.viewer->sections();
        const auto surfaces = view.viewer->renderer().surfaces();
        VCP_TRY_ASSIGN(const auto hit,
                       view.context->finest->cast(ray, sections, view.viewer->hidden(),
                                                  pickOnSurfaces(surfaces, ray.origin, ray.direction, sections,
                                                                 view.viewer->motion().surfacesMoved())));
        if (hit) {
            picked.hit = 1;
            for (int i = 0; i < 3; ++i) picked.position[i] = hit->position[i], picked.normal[i] = hit->normal[i];
            picked.distance = hit->t;
            picked.error = hit->certifiedError;
            picked.level = hit->level;
            picked.dataset = hit->onSurface ? VCP_NO_DATASET : uint32_t(hit->dataset);
        }
    }
    return give(out, picked);
}

bool isFinite(const double* values, size_t count) {
    return std::all_of(values, values + count, [](double value) { return std::isfinite(value); });
}

bool isFinite(const float* values, size_t count) {
    return std::all_of(values, values + count, [](float value) { return std::isfinite(value); });
}

glm::dvec3 vectorFrom(const double* values) { return {values[0], values[1], values[2]}; }
glm::vec3 vectorFrom(const float* values) { return {values[0], values[1], values[2]}; }

vcp_camera cameraOf(const OrbitCamera& camera) {
    vcp_camera out{};
    out.orthographic = camera.projection == Projection::Orthographic ? 1 : 0;
    for (int i = 0; i < 3; ++i) {
        out.position[i] = camera.position[i];
        out.target[i] = camera.focus()[i];
        out.up[i] = camera.upVector()[i];
    }
    out.fov_y = camera.fovY;
    return out;
}

Result<OrbitCamera> cameraFrom(const vcp_camera* given, const OrbitCamera& before) {
    if (!given) return wrong("there is no camera");
    VCP_TRY_ASSIGN(const auto wanted, taken(given));
    if (!isFinite(wanted.position, 3) || !isFinite(wanted.target, 3) || !isFinite(wanted.up, 3))
        return wrong("a number of the camera is not finite");
    OrbitCamera camera = before;
    camera.position = vectorFrom(wanted.position);
    const glm::dvec3 ahead = vectorFrom(wanted.target) - camera.position;
    glm::dvec3 up = vectorFrom(wanted.up);
    if (up == glm::dvec3(0)) up = before.up == UpAxis::Z ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
    camera.focusDistance = glm::length(ahead);
    if (!(camera.focusDistance > 0) || !std::isfinite(camera.focusDistance))
        return wrong("the camera's target is not away from its position");
    if (!(glm::length(glm::cross(up, ahead)) > 1e-9 * glm::length(up) * camera.focusDistance))
        return wrong("the camera's up is along its view");
    camera.orientation = facing(ahead, up);
    camera.projection = wanted.orthographic != 0 ? Projection::Orthographic : Projection::Perspective;
    camera.fovY = wanted.fov_y == 0 ? std::numbers::pi / 4 : wanted.fov_y;
    if (!(camera.fovY >= 1e-5 && camera.fovY <= 3.12)) return wrong("fov_y is not between 1e-5 and 3.12");
    return camera;
}

vcp_look lookOf(const Viewer& viewer) {
    const Shading& shading = viewer.shading();
    vcp_look look{};
    look.struct_size = sizeof(look);
    look.shading = static_cast<vcp_shading>(shading.mode);
    look.error_pixels = viewer.errorPixels();
    look.shadows = shading.shadows ? 1 : 0;
    look.occlusion_rays = shading.occlusionRays;
    look.occlusion_radius = shading.occlusionRadius;
    look.light_in_world = shading.lightFollowsCamera ? 0 : 1;
    look.transparent = shading.transparent ? 1 : 0;
    look.samples = viewer.samples();
    look.section_caps = uint32_t(viewer.sectionCaps());
    look.colour_error = viewer.colourError();
    look.plain = shading.channels ? 0 : 1;
    for (int i = 0; i < 3; ++i) {
        look.light[i] = shading.lightDirection[i];
        look.background_top[i] = shading.backgroundTop[i];
        look.background_bottom[i] = shading.backgroundBottom[i];
    }
    for (const SectionPlane& plane : viewer.sections()) {
        double* to = look.sections[look.section_count++];
        for (int i = 0; i < 3; ++i) to[i] = plane.normal[i];
        to[3] = plane.offset;
    }
    return look;
}

/// Puts the usual in place of what is zero.
void fillIn(vcp_look& look, bool hasWindow) {
    const Shading usual;
    const auto isZero = [](const float* values) { return vectorFrom(values) == glm::vec3(0); };
    if (look.error_pixels == 0) look.error_pixels = ViewerOptions{}.errorPixels;
    if (look.colour_error == 0) look.colour_error = ViewerOptions{}.colourError;
    if (look.samples == 0) look.samples = usualSamples(hasWindow);
    const bool hasBackground = !isZero(look.background_top) || !isZero(look.background_bottom);
    const bool hasLight = !isZero(look.light);
    for (int i = 0; i < 3; ++i) {
        if (!hasLight) look.light[i] = usual.lightDirection[i];
        if (hasBackground) continue;
        look.background_top[i] = usual.backgroundTop[i];
        look.background_bottom[i] = usual.backgroundBottom[i];
    }
}

Result<void> checkLook(const vcp_look& look) {
    if (look.shading < VCP_SHADING_LIT || look.shading > VCP_SHADING_WIREFRAME)
        return wrong("there is no such shading");
    if (!(look.error_pixels > 0) || !std::isfinite(look.error_pixels)) return wrong("error_pixels is not above 0");
    if (!(look.colour_error > 0) || !std::isfinite(look.colour_error)) return wrong("colour_error is not above 0");
    if (look.occlusion_rays > kMostOcclusionRays) return wrong("more than 64 occlusion rays");
    if (!(look.occlusion_radius >= 0) || !std::isfinite(look.occlusion_radius))
        return wrong("occlusion_radius is below 0 or not finite");
    if (look.samples < 1 || look.samples > kMostSamples) return wrong("samples is not 1 to 64");
    if (!isFinite(look.light, 3) || vectorFrom(look.light) == glm::vec3(0)) return wrong("the light has no direction");
    if (!isFinite(look.background_top, 3) || !isFinite(look.background_bottom, 3))
        return wrong("the background is not finite");
    if (look.section_count > kMostSections) return wrong("more than 6 section planes");
    for (uint32_t i = 0; i < look.section_count; ++i)
        if (!isFinite(look.sections[i], 4) || vectorFrom(look.sections[i]) == glm::dvec3(0))
            return wrong("a section plane has no normal, or is not finite");
    return {};
}

Result<void> setEnvironment(vcp_view& view, const char* source, float turn, float strength) {
    Shading shading = view.viewer->shading();
    shading.environment.reset();
    if (source != nullptr) {
        if (!std::isfinite(turn)) return wrong("the turn is not finite");
        if (!(strength >= 0 && strength <= kStrongestEnvironment)) return wrong("the strength is not 0 to 10");
        VCP_TRY_ASSIGN(shading.environment, openEnvironment({source, turn, strength}));
    }
    view.viewer->setShading(shading);
    return {};
}

Result<void> setLook(vcp_view& view, const vcp_look* given) {
    if (!given) return wrong("there is no look");
    Viewer& viewer = *view.viewer;
    VCP_TRY_ASSIGN(auto look, taken(given, lookOf(viewer)));
    fillIn(look, view.hasWindow);
    VCP_TRY(checkLook(look));
    Shading shading = viewer.shading();
    shading.mode = static_cast<ShadingMode>(look.shading);
    shading.shadows = look.shadows != 0;
    shading.occlusionRays = look.occlusion_rays;
    shading.occlusionRadius = look.occlusion_radius;
    shading.lightFollowsCamera = look.light_in_world == 0;
    shading.transparent = look.transparent != 0;
    shading.channels = look.plain == 0;
    shading.lightDirection = vectorFrom(look.light);
    shading.backgroundTop = vectorFrom(look.background_top);
    shading.backgroundBottom = vectorFrom(look.background_bottom);
    std::vector<SectionPlane> sections;
    for (uint32_t i = 0; i < look.section_count; ++i)
        sections.push_back({vectorFrom(look.sections[i]), look.sections[i][3]});
    viewer.setShading(shading);
    viewer.setErrorPixels(look.error_pixels);
    viewer.setColourError(look.colour_error);
    viewer.setSamples(look.samples);
    viewer.setSections(std::move(sections));
    viewer.setSectionCaps(vcp::Caps(std::min(look.section_caps, 2u)));
    return {};
}

vcp_stats statsOf(const Viewer& viewer) {
    const ViewerStatus& status = viewer.status();
    const UpdateResult& update = status.update;
    vcp_stats stats{};
    stats.settled = update.settled ? 1 : 0;
    stats.drawable = update.drawable ? 1 : 0;
    stats.relaxed = update.relaxed ? 1 : 0;
    stats.reduction = uint32_t(status.reduction);
    stats.device_losses = update.deviceLosses;
    stats.frames = viewer.framesDrawn();
    stats.samples = status.samples;
    stats.detail = uint32_t(status.detail);
    stats.processor_rays = status.frame.onHost ? 1 : 0;
    stats.frame_ms = status.frame.msFrame;
    stats.error_pixels = update.errorPixels;
    stats.colour_pixels = update.colourPixels;
    stats.colour_limits = detailLimitOf(update) == DetailLimit::Colour ? 1 : 0;
    stats.rays = status.frame.rays;
    stats.hit_pixels = status.frame.hitPixels;
    stats.resident_bytes = update.residentBytes;
    stats.pool_bytes = status.frame.poolBytes;
    stats.bytes_read = update.bytesRead;
    stats.read_failures = update.failures;
    stats.pages_resident = update.pagesResident;
    stats.pages_drawn = update.pagesInCut;
    stats.pages_wanted = update.pagesWanted;
    stats.pages_missing = update.pagesMissing;
    stats.coarsest_level = update.coarsestLevel;
    stats.finest_level = update.finestLevel;
    return stats;
}

/// Runs a call that may change what the view shows: call() returns a Result<void>.
template <class Call>
vcp_status changing(vcp_view* view, Call call) noexcept {
    return inTurn(view, [&](vcp_view& v) -> Result<void> {
        VCP_TRY(call(v));
        v.redrawIsNeeded();
        return {};
    });
}

vcp_status toCamera(vcp_view* view, const vcp_camera* camera, void (Viewer::*go)(const OrbitCamera&)) noexcept {
    return changing(view, [&](vcp_view& v) -> Result<void> {
        VCP_TRY_ASSIGN(const auto wanted, cameraFrom(camera, v.viewer->camera()));
        (v.viewer.get()->*go)(wanted);
        return {};
    });
}

Result<glm::dvec2> cursorAt(vcp_view& view, double x, double y) {
    if (!std::isfinite(x) || !std::isfinite(y)) return wrong("the cursor is nowhere");
    view.cursor = {x, y};
    return view.cursor;
}

Result<void> act(vcp_view& view, vcp_action action) {
    if (action == VCP_CENTRE) {
        view.viewer->centreOn(view.cursor);
        return {};
    }
    if (action < VCP_FIT || action > VCP_VIEW_ISOMETRIC) return wrong("there is no such action");
    view.viewer->act(static_cast<ViewerAction>(action));
    if (!view.viewer->isFlying()) view.fly = glm::dvec3(0);
    return {};
}

void pressKey(vcp_view& view, uint32_t key, bool isPressed) {
    if (view.viewer->isFlying() && holdFlyKey(view.fly, key, isPressed)) return;
    const auto action = actionOf(key);
    if (!isPressed || !action) return;
    view.viewer->act(*action);
    if (!view.viewer->isFlying()) view.fly = glm::dvec3(0);
}

}  // namespace

static_assert(VCP_VIEW_ISOMETRIC == int(ViewerAction::ViewIsometric) &&
              VCP_TOGGLE_FLY == int(ViewerAction::ToggleFly) &&
              VCP_TOGGLE_SECTION == int(ViewerAction::ToggleSection) &&
              VCP_NEXT_SHADING == int(ViewerAction::NextShading));
static_assert(VCP_SHADING_WIREFRAME == int(ShadingMode::Wireframe) && VCP_SHADING_STEPS == int(ShadingMode::Steps));
static_assert(VCP_RIGHT == int(MouseButton::Right) && VCP_MIDDLE == int(MouseButton::Middle));

}  // namespace vcp::widget

using namespace vcp::widget;

void vcp_view::showScene() {
    const vcp::OpenedScene& scene = *context->open;
    const glm::ivec2 size = viewer->size();
    vcp::OrbitCamera camera;
    camera.up = up;
    camera.look(vcp::View::Fit, scene.bounds(), size.x > 0 && size.y > 0 ? size : kUsualSize);
    viewer->show(scene.placed(), scene.surfaces, scene.file.camera.value_or(camera), context->name);
    viewer->setLooks(looksOf(scene.file));
    // The lights and planes of one scene do not apply to the next.
    vcp::Shading shading = viewer->shading(), usual = vcp::Shading();
    if (!std::exchange(hasSceneLight, !scene.file.lights.empty())) setLights(usual, lightsOf(shading));
    setSceneLight(shading, scene, usual);
    viewer->setShading(shading);
    if (std::exchange(hasSceneSections, !scene.file.sections.empty()) || hasSceneSections) {
        viewer->setSections(scene.file.sections);
        viewer->setSectionCaps(scene.file.sectionCaps);
    }
    wasSettled = false;
    fly = glm::dvec3(0);
}

extern "C" {

vcp_status vcp_view_create(vcp_context* context, const vcp_view_options* given, vcp_view** view) {
    if (view) *view = nullptr;
    return inTurn(context, [&]() -> vcp::Result<void> {
        if (!view) return wrong("there is nowhere to put the view");
        VCP_TRY_ASSIGN(const auto options, taken(given));
        auto made = createView(*context, options);
        copyText(options.error_text, options.error_text_size, made ? "" : made.error().line());
        if (!made) return made.error();
        *view = made->release();
        return {};
    });
}

vcp_status vcp_view_destroy(vcp_view* view) {
    if (!view) return VCP_OK;
    vcp_context& context = *view->context;
    Turn turn(context);
    if (!turn.isTaken()) return VCP_BUSY;
    std::erase(context.views, view);
    delete view;
    return VCP_OK;
}

const char* vcp_view_last_error(const vcp_view* view) { return view ? view->lastError.c_str() : "there is no view"; }

vcp_status vcp_view_resize(vcp_view* view, uint32_t width, uint32_t height) {
    return changing(view, [&](vcp_view& v) -> vcp::Result<void> {
        if (width > kLargestSide || height > kLargestSide) return wrong("a view has at most 16384 pixels a side");
        v.viewer->resize({width, height});
        return {};
    });
}

vcp_status vcp_view_mouse_press(vcp_view* view, vcp_button button, double x, double y, uint32_t modifiers) {
    return changing(view, [&](vcp_view& v) -> vcp::Result<void> {
        VCP_TRY_ASSIGN(const auto at, cursorAt(v, x, y));
        if (button < VCP_LEFT || button > VCP_RIGHT) return wrong("there is no such button");
        v.viewer->press(static_cast<vcp::MouseButton>(button), at,
                        {(modifiers & VCP_SHIFT) != 0, (modifiers & VCP_CONTROL) != 0});
        return {};
    });
}

vcp_status vcp_view_mouse_move(vcp_view* view, double x, double y) {
    return inTurn(view, [&](vcp_view& v) -> vcp::Result<void> {
        VCP_TRY_ASSIGN(const auto at, cursorAt(v, x, y));
        const vcp::Camera camera = v.viewer->camera().current();
        const vcp::Shading shading = v.viewer->shading();
        v.viewer->move(at);
        if (v.viewer->camera().current() != camera || v.viewer->shading() != shading) v.redrawIsNeeded();
        return {};
    });
}

vcp_status vcp_view_mouse_release(vcp_view* view, vcp_button button) {
    return changing(view, [&](vcp_view& v) -> vcp::Result<void> {
        if (button < VCP_LEFT || button > VCP_RIGHT) return wrong("there is no such button");
        v.viewer->release(static_cast<vcp::MouseButton>(button));
        return {};
    });
}

vcp_status vcp_view_mouse_scroll(vcp_view* view, double x, double y, double notches, uint32_t modifiers) {
    return changing(view, [&](vcp_view& v) -> vcp::Result<void> {
        VCP_TRY_ASSIGN(const auto at, cursorAt(v, x, y));
        if (!std::isfinite(notches)) return wrong("the wheel turned by what is not a number");
        v.viewer->scroll(at, notches, (modifiers & VCP_SHIFT) != 0);
        return {};
    });
}

vcp_status vcp_view_act(vcp_view* view, vcp_action action) {
    return changing(view, [&](vcp_view& v) { return act(v, action); });
}

vcp_status vcp_view_key(vcp_view* view, uint32_t key, uint32_t pressed) {
    return changing(view, [&](vcp_view& v) -> vcp::Result<void> {
        pressKey(v, key, pressed != 0);
        return {};
    });
}

vcp_status vcp_view_get_camera(vcp_view* view, vcp_camera* camera) {
    return inTurn(view, [&](vcp_view& v) { return give(camera, cameraOf(v.viewer->camera())); });
}

vcp_status vcp_view_set_camera(vcp_view* view, const vcp_camera* camera) {
    return toCamera(view, camera, &vcp::Viewer::setCamera);
}

vcp_status vcp_view_move_camera(vcp_view* view, const vcp_camera* camera) {
    return toCamera(view, camera, &vcp::Viewer::moveTo);
}

vcp_status vcp_view_get_look(vcp_view* view, vcp_look* look) {
    return inTurn(view, [&](vcp_view& v) { return give(look, lookOf(*v.viewer)); });
}

vcp_status vcp_view_set_look(vcp_view* view, const vcp_look* look) {
    return changing(view, [&](vcp_view& v) { return setLook(v, look); });
}

vcp_status vcp_view_set_environment(vcp_view* view, const char* source, float turn_degrees, float strength) {
    return changing(view, [&](vcp_view& v) { return setEnvironment(v, source, turn_degrees, strength); });
}

vcp_status vcp_view_set_visible(vcp_view* view, uint32_t dataset, uint32_t visible) {
    return changing(view, [&](vcp_view& v) { return setVisible(v, dataset, visible != 0); });
}

vcp_status vcp_view_is_visible(vcp_view* view, uint32_t dataset, uint32_t* visible) {
    return inTurn(view, [&](vcp_view& v) -> vcp::Result<void> {
        if (!visible) return wrong("there is nowhere to put the answer");
        VCP_TRY(checkDataset(v, dataset));
        const std::vector<uint32_t>& hidden = v.viewer->hidden();
        *visible = std::find(hidden.begin(), hidden.end(), dataset) == hidden.end() ? 1 : 0;
        return {};
    });
}

vcp_status vcp_view_set_lines(vcp_view* view, const vcp_line* lines, uint32_t count) {
    return changing(view, [&](vcp_view& v) { return setLines(v, lines, count); });
}

vcp_status vcp_view_save_png(vcp_view* view, const char* path) {
    return inTurn(view, [&](vcp_view& v) { return savePng(v, path); });
}

vcp_status vcp_view_update(vcp_view* view, vcp_step* step) {
    return inTurn(view, [&](vcp_view& v) -> vcp::Result<void> {
        if (const auto size = structSize(step); !size) return size.error();
        VCP_TRY(update(v));
        vcp_step next{};
        next.draw = v.next.draw || v.hasNewLines ? 1 : 0;
        next.settled = v.viewer->status().update.settled ? 1 : 0;
        next.wait_seconds = v.next.waitSeconds;
        return give(step, next);
    });
}

vcp_status vcp_view_render(vcp_view* view) {
    return inTurn(view, [&](vcp_view& v) { return render(v); });
}

vcp_status vcp_view_settle(vcp_view* view, double seconds) {
    return inTurn(view, [&](vcp_view& v) { return settle(v, seconds); });
}

vcp_status vcp_view_read(vcp_view* view, vcp_frame* frame) {
    return inTurn(view, [&](vcp_view& v) { return readFrame(v, frame); });
}

vcp_status vcp_view_copy_to_image(vcp_view* view, const vcp_host_image* image) {
    return inTurn(view, [&](vcp_view& v) { return copyToImage(v, image); });
}

vcp_status vcp_view_pick(vcp_view* view, double x, double y, vcp_pick* out) {
    return inTurn(view, [&](vcp_view& v) { return pick(v, x, y, out); });
}

vcp_status vcp_view_stats(vcp_view* view, vcp_stats* stats) {
    return inTurn(view, [&](vcp_view& v) { return give(stats, statsOf(*v.viewer)); });
}
}
