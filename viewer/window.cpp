#include "viewer/window.h"

#include <chrono>
#include <cmath>

#define GLFW_INCLUDE_NONE
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include "viewer/text_strip.h"

namespace vcp {

namespace {

Error displayError(const std::string& what) {
    const char* why = nullptr;
    glfwGetError(&why);
    return {ErrorCode::Device, what + (why ? std::string(": ") + why : "") + "; `vcp render` makes a picture without a window"};
}

/// GLFW for as long as it lives, and its one window.
class WindowSystem {
public:
    WindowSystem() = default;
    WindowSystem(const WindowSystem&) = delete;
    WindowSystem& operator=(const WindowSystem&) = delete;
    ~WindowSystem() {
        if (window_) glfwDestroyWindow(window_);
        if (started_) glfwTerminate();
    }

    Result<void> open(const WindowOptions& options) {
        if (!glfwInit()) return displayError("no display to open a window on");
        started_ = true;
        if (!glfwVulkanSupported()) return displayError("Vulkan cannot draw into windows here");
        glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
        glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
        window_ = glfwCreateWindow(options.size.x, options.size.y, options.title.c_str(), nullptr, nullptr);
        if (!window_) return displayError("the window cannot be opened");
        return {};
    }

    [[nodiscard]] GLFWwindow* window() const { return window_; }

    [[nodiscard]] SurfaceSource surfaceSource() const {
        SurfaceSource source;
        uint32_t count = 0;
        const char** names = glfwGetRequiredInstanceExtensions(&count);
        source.instanceExtensions.assign(names, names + count);
        source.createSurface = [window = window_](VkInstance instance, VkSurfaceKHR* surface) {
            return glfwCreateWindowSurface(instance, window, nullptr, surface);
        };
        return source;
    }

private:
    bool started_ = false;
    GLFWwindow* window_ = nullptr;
};

/// The viewer in its window: what the callbacks reach.
class ViewWindow {
public:
    ViewWindow(GLFWwindow* window, Viewer& viewer) : window_(window), viewer_(&viewer), strip_(contentScale()) {
        glfwSetWindowUserPointer(window_, this);
        glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int x, int y) { of(w).resize({x, y}); });
        glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w).mustPresent_ = true; });
        glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int b, int action, int mods) { of(w).button(b, action, mods); });
        glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) { of(w).moveCursor({x, y}); });
        glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double steps) { of(w).scroll(steps); });
        glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int) { of(w).key(key, action); });
        glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* w, float, float) { of(w).rescale(); });
        int width = 0, height = 0;
        glfwGetFramebufferSize(window_, &width, &height);
        resize({width, height});
        glfwGetCursorPos(window_, &cursor_.x, &cursor_.y);
    }

    /// Until the window is closed.
    Result<WindowReport> run(std::chrono::steady_clock::time_point start) {
        const auto seconds = [start] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        };
        WindowReport report;
        while (!glfwWindowShouldClose(window_)) {
            const auto next = viewer_->update(seconds());
            if (!next) return next.error();
            if (next->draw) VCP_TRY(viewer_->draw());
            VCP_TRY(present(next->draw));
            if (next->draw && !report.firstPictureSeconds) report.firstPictureSeconds = seconds();
            const bool settled = viewer_->framesDrawn() > 0 && viewer_->status().update.settled;
            if (settled && !report.settledSeconds) report.settledSeconds = seconds();
            wait(*next);
        }
        report.framesDrawn = viewer_->framesDrawn();
        report.status = viewer_->status();
        return report;
    }

private:
    static ViewWindow& of(GLFWwindow* window) { return *static_cast<ViewWindow*>(glfwGetWindowUserPointer(window)); }

    [[nodiscard]] float contentScale() const {
        float x = 1, y = 1;
        glfwGetWindowContentScale(window_, &x, &y);
        return y;
    }

    void rescale() {
        strip_ = TextStrip(contentScale());
        mustPresent_ = true;
    }

    void resize(glm::ivec2 size) {
        framebuffer_ = size;
        viewer_->resize(size);
        mustPresent_ = true;
    }

    /// Cursor positions are in the window's units; pixels may be smaller.
    [[nodiscard]] glm::dvec2 pixelAt(glm::dvec2 cursor) const {
        int width = 1, height = 1;
        glfwGetWindowSize(window_, &width, &height);
        return cursor * glm::dvec2(framebuffer_) / glm::max(glm::dvec2(width, height), glm::dvec2(1));
    }

    void moveCursor(glm::dvec2 cursor) {
        cursor_ = cursor;
        viewer_->move(pixelAt(cursor));
    }

    void button(int glfwButton, int action, int mods) {
        if (glfwButton > GLFW_MOUSE_BUTTON_MIDDLE) return;
        const MouseButton which = glfwButton == GLFW_MOUSE_BUTTON_LEFT    ? MouseButton::Left
                                  : glfwButton == GLFW_MOUSE_BUTTON_RIGHT ? MouseButton::Right
                                                                          : MouseButton::Middle;
        if (action == GLFW_PRESS)
            viewer_->press(which, pixelAt(cursor_), (mods & GLFW_MOD_SHIFT) != 0);
        else
            viewer_->release(which);
    }

    void scroll(double steps) {
        const bool shift = glfwGetKey(window_, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS || glfwGetKey(window_, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
        viewer_->scroll(pixelAt(cursor_), steps, shift);
    }

    void key(int key, int action) {
        if (action != GLFW_PRESS) return;
        switch (key) {
            case GLFW_KEY_ESCAPE:
            case GLFW_KEY_Q: glfwSetWindowShouldClose(window_, GLFW_TRUE); break;
            case GLFW_KEY_F: viewer_->act(ViewerAction::Fit); break;
            case GLFW_KEY_R:
            case GLFW_KEY_HOME: viewer_->act(ViewerAction::Reset); break;
            case GLFW_KEY_L: viewer_->act(ViewerAction::ToggleLight); break;
            case GLFW_KEY_S: viewer_->act(ViewerAction::ToggleShadows); break;
            case GLFW_KEY_O: viewer_->act(ViewerAction::ToggleOcclusion); break;
            case GLFW_KEY_X: viewer_->act(ViewerAction::ToggleSection); break;
            case GLFW_KEY_M: viewer_->act(ViewerAction::NextShading); break;
            case GLFW_KEY_P: viewer_->act(ViewerAction::ToggleProjection); break;
            case GLFW_KEY_1: viewer_->act(ViewerAction::ViewFront); break;
            case GLFW_KEY_3: viewer_->act(ViewerAction::ViewRight); break;
            case GLFW_KEY_7: viewer_->act(ViewerAction::ViewTop); break;
            case GLFW_KEY_9: viewer_->act(ViewerAction::ViewIsometric); break;
            default: break;
        }
    }

    /// Shows the last picture and the status line when either is new or the window was uncovered.
    Result<void> present(bool drawn) {
        if (viewer_->framesDrawn() == 0 || framebuffer_.x == 0 || framebuffer_.y == 0) return {};
        std::string status = statusLine(viewer_->status());
        if (!drawn && !mustPresent_ && status == shownStatus_) return {};
        const Strip strip = strip_.draw(status, framebuffer_.x);
        Picture overlay{static_cast<uint32_t>(strip.width), static_cast<uint32_t>(strip.height), {}};
        const auto bytes = std::as_bytes(std::span(strip.pixels));
        overlay.rgba.resize(bytes.size());
        std::memcpy(overlay.rgba.data(), bytes.data(), bytes.size());
        VCP_TRY(viewer_->renderer().present(static_cast<uint32_t>(framebuffer_.x), static_cast<uint32_t>(framebuffer_.y), &overlay));
        shownStatus_ = std::move(status);
        mustPresent_ = false;
        return {};
    }

    static void wait(const NextStep& next) {
        if (std::isinf(next.waitSeconds))
            glfwWaitEvents();
        else if (next.waitSeconds > 0)
            glfwWaitEventsTimeout(next.waitSeconds);
        else
            glfwPollEvents();
    }

    GLFWwindow* window_;
    Viewer* viewer_;
    TextStrip strip_;
    glm::ivec2 framebuffer_{0};
    // Where the cursor was at the event in hand: asked for, it would be where it is by now, and a quick drag be lost.
    glm::dvec2 cursor_{0};
    std::string shownStatus_;
    bool mustPresent_ = true;
};

}  // namespace

Result<WindowReport> showWindow(const OpenDataset& open, const RenderSettings& settings, const WindowOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    WindowSystem system;
    VCP_TRY(system.open(options));
    glm::ivec2 size(0);
    glfwGetFramebufferSize(system.window(), &size.x, &size.y);
    const auto camera = settings.cameraFor(open.bounds(), size);
    if (!camera) return camera.error();

    ViewerOptions viewerOptions;
    viewerOptions.renderer = settings.rendererOptions(open);
    viewerOptions.renderer.surface = system.surfaceSource();
    viewerOptions.errorPixels = settings.errorPixels;
    viewerOptions.shading = settings.shadingChosen();
    viewerOptions.sections = settings.sectionPlanes(open.bounds());
    viewerOptions.sectionCaps = settings.caps;
    viewerOptions.march = settings.march;
    auto viewer = Viewer::create(viewerOptions);
    if (!viewer) return viewer.error();
    VCP_TRY((*viewer)->open(open.dataset, open.source, *camera, options.title));
    return ViewWindow(system.window(), **viewer).run(start);
}

}  // namespace vcp
