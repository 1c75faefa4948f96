#include "viewer/window/window.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <utility>

#define GLFW_INCLUDE_NONE
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>
#include <imgui.h>

#include "render/vulkan/library.h"
#include "viewer/key_map.h"
#include "viewer/window/desktop_theme.h"
#include "viewer/window/interface.h"
#include "viewer/window/interface_painter.h"
#include "viewer/window/thumbnails.h"

namespace vcp {

namespace {

constexpr double kDoubleClickSeconds = 0.4;
// An answer of the desktop that takes longer than the device's start comes later.
constexpr std::chrono::milliseconds kThemeAwaited{200};
constexpr double kAnswerAwaited = 0.05;  // in seconds; see wait()
constexpr double kClickPixels = 4;       // a press that moves less is a click

Error displayError(const std::string& what) {
    const char* why = nullptr;
    glfwGetError(&why);
    return {ErrorCode::Device,
            what + (why ? std::string(": ") + why : "") + "; `vcp render` makes a picture without a window"};
}

/// Keeps GLFW for as long as it lives, and its one window.
class WindowSystem {
public:
    WindowSystem() = default;
    WindowSystem(const WindowSystem&) = delete;
    WindowSystem& operator=(const WindowSystem&) = delete;
    ~WindowSystem() {
        if (window_) glfwDestroyWindow(window_);
        if (started_) glfwTerminate();
    }

    /// `asked`: the window's size, where it was asked for; else it is `usual`, or less where the screen is smaller.
    Result<void> open(std::optional<glm::ivec2> asked, glm::ivec2 usual, const std::string& title) {
        if (!glfwInit()) return displayError("no display to open a window on");
        started_ = true;
        VCP_TRY(openVulkanLibrary());
        if (!glfwVulkanSupported()) return displayError("Vulkan cannot draw into windows here");
        glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
        glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
        // The name of the entry in the desktop's menu.
        glfwWindowHintString(GLFW_X11_CLASS_NAME, "vcp");
        glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "vcp");
        const glm::ivec2 size = asked ? *asked : onScreen(usual);
        window_ = glfwCreateWindow(size.x, size.y, title.c_str(), nullptr, nullptr);
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

    /// Returns the window's size as open() takes it.
    [[nodiscard]] glm::ivec2 size() const {
        glm::ivec2 window(0), framebuffer(0);
        glm::vec2 scale(1);
        glfwGetWindowSize(window_, &window.x, &window.y);
        glfwGetFramebufferSize(window_, &framebuffer.x, &framebuffer.y);
        glfwGetWindowContentScale(window_, &scale.x, &scale.y);
        return unscaledSize(window, framebuffer, scale);
    }

    [[nodiscard]] float contentScale() const {
        float x = 1, y = 1;
        glfwGetWindowContentScale(window_, &x, &y);
        return y;
    }

private:
    static glm::ivec2 onScreen(glm::ivec2 size) {
        GLFWmonitor* monitor = glfwGetPrimaryMonitor();
        if (!monitor) return size;
        glm::ivec2 corner(0), room(0);
        glm::vec2 scale(1);
        glfwGetMonitorWorkarea(monitor, &corner.x, &corner.y, &room.x, &room.y);
        glfwGetMonitorContentScale(monitor, &scale.x, &scale.y);
        return fittingSize(size, room, scale);
    }

    bool started_ = false;
    GLFWwindow* window_ = nullptr;
};

template <class Value>
bool isReady(const std::future<Value>& future, std::chrono::milliseconds most = {}) {
    return future.wait_for(most) == std::future_status::ready;
}

/// The session in its window, which the callbacks reach.
class ViewWindow {
public:
    ViewWindow(const WindowSystem& system, ViewSession& session, std::unique_ptr<InterfacePainter> painter,
               std::map<std::string, size_t> thumbnails, std::future<std::optional<bool>> desktop,
               const WindowOptions& options)
        : system_(&system),
          window_(system.window()),
          session_(&session),
          painter_(std::move(painter)),
          interface_(session, host(std::move(thumbnails))),
          options_(&options),
          desktop_(std::move(desktop)) {
        session.viewer().renderer().onDeviceLoss([this] { painter_.reset(); });
        glfwSetWindowUserPointer(window_, this);
        glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int x, int y) { of(w).resize({x, y}); });
        glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w).mustPresent_ = true; });
        glfwSetMouseButtonCallback(window_,
                                   [](GLFWwindow* w, int b, int action, int mods) { of(w).button(b, action, mods); });
        glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) { of(w).moveCursor({x, y}); });
        glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double steps) { of(w).scroll(steps); });
        glfwSetKeyCallback(window_,
                           [](GLFWwindow* w, int key, int, int action, int mods) { of(w).key(key, action, mods); });
        glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned codepoint) { of(w).type(codepoint); });
        glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int hasFocus) {
            of(w).letGo();
            // The desktop's settings may have changed meanwhile.
            if (hasFocus == GLFW_TRUE && !of(w).desktop_.valid())
                of(w).desktop_ = std::async(std::launch::async, askDesktop);
        });
        glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
            of(w).open({paths, paths + count});
        });
        glfwSetWindowContentScaleCallback(window_, [](GLFWwindow* w, float, float) { of(w).isRescaled_ = true; });
        int width = 0, height = 0;
        glfwGetFramebufferSize(window_, &width, &height);
        resize({width, height});
        layOut();
        glfwGetCursorPos(window_, &cursor_.x, &cursor_.y);
    }

    /// Runs until the window is closed.
    Result<WindowReport> run(std::chrono::steady_clock::time_point start) {
        const auto seconds = [start] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        };
        WindowReport report;
        std::optional<glm::ivec2> shownSize;
        while (!glfwWindowShouldClose(window_)) {
            // While something is built, Ctrl-C must clean up; the loop wakes often enough then.
            if (!session_->opening())
                catching_.reset();
            else if (!catching_ && options_->catchInterrupts)
                catching_ = options_->catchInterrupts();
            Viewer& viewer = session_->viewer();
            VCP_TRY_ASSIGN(auto next, session_->update(seconds()));
            if (next.draw) {
                VCP_TRY_ASSIGN(const auto waited, viewer.waitForFrame());
                // The frame is to show what was done up to now.
                if (waited) {
                    glfwPollEvents();
                    VCP_TRY_ASSIGN(next, session_->update(seconds()));
                }
            }
            showTitle();
            bool isNew = false;
            if (next.draw) {
                VCP_TRY_ASSIGN(isNew, viewer.draw());
            }
            if (!painter_) VCP_TRY(makePainter());
            VCP_TRY(present(isNew));
            if (!report.windowSeconds) report.windowSeconds = seconds();
            const bool isShown =
                viewer.isOpen() && (viewer.status().frame.pagesInCut > 0 || viewer.status().frame.surfaceBytes > 0);
            if (session_->preview() != nullptr && !report.previewSeconds) report.previewSeconds = seconds();
            if (isShown && !report.firstPictureSeconds) report.firstPictureSeconds = seconds();
            if (isShown && viewer.status().update.settled && !report.settledSeconds) report.settledSeconds = seconds();
            wait(next);
            // By now the window system has given the window its size.
            if (!shownSize) shownSize = system_->size();
            if (options_->interrupted && options_->interrupted()) break;
        }
        report.framesDrawn = session_->viewer().framesDrawn();
        report.status = session_->viewer().status();
        report.problem = session_->problem();
        if (const glm::ivec2 size = system_->size(); shownSize && size != *shownSize) session_->keepWindowSize(size);
        report.changes = session_->changes();
        session_->keepThumbnail();
        return report;
    }

private:
    static ViewWindow& of(GLFWwindow* window) { return *static_cast<ViewWindow*>(glfwGetWindowUserPointer(window)); }

    InterfaceHost host(std::map<std::string, size_t> thumbnails) {
        return {[this](const std::string& text) { glfwSetClipboardString(window_, text.c_str()); },
                [this] {
                    const char* text = glfwGetClipboardString(window_);
                    return std::string(text ? text : "");
                },
                [this](std::vector<std::string> files) { open(std::move(files)); }, std::move(thumbnails)};
    }

    /// The window is called what it shows.
    void showTitle() {
        const std::string& name = session_->viewer().status().name;
        if (!name.empty() && name != title_) glfwSetWindowTitle(window_, (title_ = name).c_str());
    }

    void open(std::vector<std::string> files) {
        session_->keepThumbnail();
        session_->open(std::move(files));
    }

    /// How panels look in the window as it is.
    [[nodiscard]] InterfacePainter::Options painterOptions() const {
        return {layoutScale(system_->contentScale(), framebuffer_.x, framebuffer_.y), session_->isDark()};
    }

    /// Makes the painter anew, on the device that replaces a lost one.
    Result<void> makePainter() {
        VCP_TRY_ASSIGN(const auto drawing, session_->viewer().renderer().windowDrawing());
        VCP_TRY_ASSIGN(painter_, InterfacePainter::create(drawing, painterOptions()));
        mustPresent_ = true;
        return {};
    }

    void resize(glm::ivec2 size) {
        framebuffer_ = size;
        isRescaled_ = true;
        session_->viewer().resize(size);
        mustPresent_ = true;
    }

    /// Cursor positions are in the window's units; pixels may be smaller.
    [[nodiscard]] glm::dvec2 pixelAt(glm::dvec2 cursor) const {
        int width = 1, height = 1;
        glfwGetWindowSize(window_, &width, &height);
        return cursor * glm::dvec2(framebuffer_) / glm::max(glm::dvec2(width, height), glm::dvec2(1));
    }

    /// Lays the panels out anew: after every event, so that quick clicks are not lost between frames.
    void layOut() {
        if (framebuffer_.x == 0 || framebuffer_.y == 0) return;
        painter_->begin(framebuffer_);
        session_->viewer().showSectionHandles(double(painter_->look().scale));
        interface_.layOut(framebuffer_, painter_->look());
        mustPresent_ = painter_->end() || mustPresent_;
    }

    void moveCursor(glm::dvec2 cursor) {
        cursor_ = cursor;
        const glm::dvec2 pixel = pixelAt(cursor);
        ImGui::GetIO().MousePos = ImVec2(float(pixel.x), float(pixel.y));
        if (glm::distance(pixel, pressedAt_) > kClickPixels) isClick_ = false;
        session_->viewer().move(pixel);
        if (!isDragging_) layOut();
    }

    void button(int glfwButton, int action, int mods) {
        if (glfwButton > GLFW_MOUSE_BUTTON_MIDDLE) return;
        const glm::dvec2 pixel = pixelAt(cursor_);
        moveCursor(cursor_);
        const bool isPress = action == GLFW_PRESS;
        const bool isPanels = ImGui::GetIO().WantCaptureMouse && !isDragging_;
        if (isPress) session_->note("");
        if (isPanels || !isPress) ImGui::GetIO().MouseDown[glfwButton] = isPress;
        layOut();
        const MouseButton which = glfwButton == GLFW_MOUSE_BUTTON_LEFT    ? MouseButton::Left
                                  : glfwButton == GLFW_MOUSE_BUTTON_RIGHT ? MouseButton::Right
                                                                          : MouseButton::Middle;
        if (isPress && !isPanels)
            press(which, pixel, {(mods & GLFW_MOD_SHIFT) != 0, (mods & GLFW_MOD_CONTROL) != 0});
        else if (!isPress)
            release(which, pixel);
    }

    void press(MouseButton which, glm::dvec2 pixel, Modifiers modifiers) {
        const double now = glfwGetTime();
        const bool plain = which == MouseButton::Left && !modifiers.shift && !modifiers.control;
        const bool again =
            plain && now - pressedTime_ < kDoubleClickSeconds && glm::distance(pixel, pressedAt_) <= kClickPixels;
        pressedAt_ = pixel;
        pressedTime_ = again ? 0 : now;
        isClick_ = plain;
        isDragging_ = true;
        session_->viewer().press(which, pixel, modifiers);
        if (again && session_->clicks() == ViewSession::Clicks::Nothing) session_->viewer().centreOn(pixel);
    }

    void release(MouseButton which, glm::dvec2 pixel) {
        session_->viewer().release(which);
        if (!std::exchange(isDragging_, false)) return;
        if (!isClick_ || which != MouseButton::Left) return;
        if (session_->clicks() != ViewSession::Clicks::Nothing)
            session_->clickAt(pixel);
        else
            interface_.openPointAt(pixel);
    }

    void scroll(double steps) {
        const bool shift = glfwGetKey(window_, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                           glfwGetKey(window_, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
        if (ImGui::GetIO().WantCaptureMouse) {
            ImGui::GetIO().MouseWheel += float(steps);
            layOut();
        } else {
            session_->viewer().scroll(pixelAt(cursor_), steps, shift);
        }
    }

    void letGo() {
        held_ = {};
        session_->viewer().fly({});
    }

    void key(int key, int action, int mods) {
        if (action == GLFW_REPEAT && !interface_.takesText()) return;
        const bool isFlying = session_->viewer().isFlying() && !interface_.takesText();
        const bool mayFly = (mods & GLFW_MOD_CONTROL) == 0 && (isFlying || action == GLFW_RELEASE);
        if (mayFly && holdFlyKey(held_, uint32_t(key), action == GLFW_PRESS)) {
            session_->viewer().fly(session_->viewer().isFlying() ? held_ : glm::dvec3(0));
            return;
        }
        if (action == GLFW_RELEASE) return;
        session_->note("");
        opensPage_ = false;
        isAskedToClose_ = isAskedToClose_ && key == GLFW_KEY_ESCAPE;
        if (interface_.takesText()) {
            pageKey(key, mods);
            return layOut();
        }
        const bool isDigit = key >= GLFW_KEY_1 && key <= GLFW_KEY_9;
        if (isDigit && (mods & GLFW_MOD_CONTROL) != 0)
            session_->keepBookmark(key - GLFW_KEY_0);
        else if (isDigit && (mods & GLFW_MOD_SHIFT) != 0)
            session_->goToBookmark(key - GLFW_KEY_0);
        else if ((mods & GLFW_MOD_CONTROL) != 0)
            controlKey(key);
        else
            plainKey(key);
        opensPage_ = interface_.takesText();
    }

    void type(uint32_t codepoint) {
        // The key that opened a page is not typed into it.
        if (!interface_.takesText() || std::exchange(opensPage_, false)) return;
        interface_.type(codepoint);
        layOut();
    }

    /// A page that takes text has the keys; what they type comes to type().
    void pageKey(int key, int mods) {
        if (key == GLFW_KEY_ESCAPE) interface_.closePage();
        if (key == GLFW_KEY_F1) interface_.toggleHelp();
        if (key == GLFW_KEY_BACKSPACE) interface_.eraseTyped();
        if (key == GLFW_KEY_ENTER || key == GLFW_KEY_TAB) interface_.enterTyped();
        if ((mods & GLFW_MOD_CONTROL) == 0) return;
        if (key == GLFW_KEY_A) interface_.markTyped();
        if (key == GLFW_KEY_V) interface_.pasteTyped();
        if (key == GLFW_KEY_Q) glfwSetWindowShouldClose(window_, GLFW_TRUE);
    }

    void controlKey(int key) {
        if (key == GLFW_KEY_O) interface_.openFileList();
        if (key == GLFW_KEY_C) interface_.copyCamera();
        if (key == GLFW_KEY_V) interface_.pasteCamera();
        if (key == GLFW_KEY_E) session_->exportMeasurement();
        if (key == GLFW_KEY_S) interface_.savePicture();
        if (key == GLFW_KEY_T) interface_.saveTurntable();
        if (key == GLFW_KEY_B) interface_.savePath();
        if (key == GLFW_KEY_Q) glfwSetWindowShouldClose(window_, GLFW_TRUE);
    }

    void plainKey(int key) {
        switch (key) {
            case GLFW_KEY_ESCAPE:
                escape();
                break;
            case GLFW_KEY_F1:
                interface_.toggleHelp();
                break;
            case GLFW_KEY_TAB:
                togglePanel();
                break;
            case GLFW_KEY_D:
                session_->toggleClicks(ViewSession::Clicks::Measure);
                break;
            case GLFW_KEY_N:
                session_->toggleClicks(ViewSession::Clicks::Annotate);
                break;
            case GLFW_KEY_K:
                interface_.toggleComparison();
                break;
            case GLFW_KEY_W:
                session_->toggleWireframe();
                break;
            case GLFW_KEY_ENTER:
                session_->measurement().finishLine();
                break;
            case GLFW_KEY_BACKSPACE:
                session_->measurement().takeBack();
                break;
            case GLFW_KEY_HOME:
                session_->act(ViewerAction::Reset);
                break;
            case GLFW_KEY_G:
                toggleFly();
                break;
            case GLFW_KEY_B:
                session_->showsPages = !session_->showsPages;
                break;
            case GLFW_KEY_I:
                session_->showFeedback(!session_->showsFeedback());
                break;
            default:
                // GLFW names keys by the capitals on them.
                if (const auto action = actionOf(uint32_t(key))) session_->act(*action);
        }
    }

    void togglePanel() {
        session_->togglePanel();
        layOut();  // what is fitted next must keep clear of the panels
    }

    void toggleFly() {
        letGo();
        session_->act(ViewerAction::ToggleFly);
    }

    void escape() {
        if (session_->viewer().cancelSectionDrag()) return;
        if (session_->opening())
            session_->opening()->cancel();
        else if (session_->saving())
            session_->cancelSaving();
        else if (session_->viewer().cancelMeasuring())
            session_->note("cancelled: the picture is drawn where the camera moves on");
        else if (session_->viewer().isFlying())
            toggleFly();
        else if (session_->clicks() != ViewSession::Clicks::Nothing)
            session_->setClicks(ViewSession::Clicks::Nothing);
        else if (session_->hasUnwrittenMeasurement() && !std::exchange(isAskedToClose_, true))
            session_->note("what is measured is not written: Ctrl+E writes it, Esc closes without");
        else
            glfwSetWindowShouldClose(window_, GLFW_TRUE);
    }

    /// Shows the last picture and the panels when either is new or the window was uncovered.
    Result<void> present(bool drawn) {
        if (desktop_.valid() && isReady(desktop_)) session_->followDesktop(desktop_.get());
        if (std::exchange(isRescaled_, false) || darkShown_ != session_->isDark()) {
            darkShown_ = session_->isDark();
            VCP_TRY(painter_->setOptions(painterOptions()));
        }
        layOut();
        const bool hasPicture = session_->viewer().framesDrawn() > 0 || session_->viewer().renderer().isUnfinished();
        if (!hasPicture || framebuffer_.x == 0 || framebuffer_.y == 0) return {};
        if (!drawn && !mustPresent_) return {};
        mustPresent_ = false;
        return session_->viewer().renderer().present(uint32_t(framebuffer_.x), uint32_t(framebuffer_.y),
                                                     painter_->drawOver());
    }

    void wait(const NextStep& next) {
        // Some panels take a second layout to find their size.
        layOut();
        // No event says that the desktop has answered.
        const double seconds = desktop_.valid() ? std::min(next.waitSeconds, kAnswerAwaited) : next.waitSeconds;
        if (mustPresent_ || seconds <= 0)
            glfwPollEvents();
        else if (std::isinf(seconds))
            glfwWaitEvents();
        else
            glfwWaitEventsTimeout(seconds);
    }

    const WindowSystem* system_;
    GLFWwindow* window_;
    ViewSession* session_;
    std::unique_ptr<InterfacePainter> painter_;
    Interface interface_;
    const WindowOptions* options_;
    std::shared_ptr<void> catching_;
    glm::ivec2 framebuffer_{0};
    // The cursor at the current event: queried later, it would have moved on, and a quick drag would be lost.
    glm::dvec2 cursor_{0};
    glm::dvec2 pressedAt_{0};
    double pressedTime_ = 0;
    bool isClick_ = false, isDragging_ = false;
    bool opensPage_ = false;       // the last key did: its character is not typed into the page
    bool isAskedToClose_ = false;  // and the last key was Esc
    glm::dvec3 held_{0};
    std::string title_;  ///< of the window, once something is shown
    bool mustPresent_ = true, isRescaled_ = false;
    bool darkShown_ = true;
    std::future<std::optional<bool>> desktop_;  ///< what it asks for, while it is asked
};

}  // namespace

Result<WindowReport> showWindow(const WindowOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    const std::vector<std::string>& inputs = options.session.inputs;
    WindowSystem system;
    VCP_TRY(system.open(options.size, options.session.user.windowSize, inputs.empty() ? "vcp" : nameOf(inputs)));
    std::future<std::optional<bool>> desktop = std::async(std::launch::async, askDesktop);
    VCP_TRY_ASSIGN(auto session, ViewSession::create(options.session, system.surfaceSource()));
    if (isReady(desktop, kThemeAwaited)) session->followDesktop(desktop.get());
    session->open(inputs);
    VCP_TRY_ASSIGN(const auto drawing, session->viewer().renderer().windowDrawing());
    // Only the welcome page shows thumbnails.
    std::map<std::string, size_t> thumbnails;
    std::vector<Picture> pictures;
    const auto kept = inputs.empty() ? Thumbnails::inCache() : Result<Thumbnails>(Error::cancelled());
    for (const std::string& file : kept ? session->user().recent : std::vector<std::string>{})
        if (auto picture = kept->read(file)) {
            thumbnails[file] = pictures.size();
            pictures.push_back(*std::move(picture));
        }
    const InterfacePainter::Options look{layoutScale(system.contentScale(), 1 << 14, 1 << 14), session->isDark()};
    VCP_TRY_ASSIGN(auto painter, InterfacePainter::create(drawing, look, std::move(pictures)));
    return ViewWindow(system, *session, std::move(painter), std::move(thumbnails), std::move(desktop), options)
        .run(start);
}

}  // namespace vcp
