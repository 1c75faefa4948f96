// A window of GLFW: glfw_host FILE.vcp [--frames N], N after it is settled. Drag to orbit, wheel to zoom, keys as in
// `vcp view`.
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include <vcp/vcp.hpp>

namespace {

int32_t createSurface(void* window, VkInstance instance, uint64_t* surface) {
    VkSurfaceKHR made = VK_NULL_HANDLE;
    const VkResult result = glfwCreateWindowSurface(instance, static_cast<GLFWwindow*>(window), nullptr, &made);
    *surface = uint64_t(made);
    return result;
}

vcp::widget::View& viewOf(GLFWwindow* window) {
    return *static_cast<vcp::widget::View*>(glfwGetWindowUserPointer(window));
}

// Returns the cursor in pixels of the framebuffer, which need not be those of the window.
void cursor(GLFWwindow* window, double& x, double& y) {
    int w = 1, h = 1, fw = 1, fh = 1;
    glfwGetCursorPos(window, &x, &y);
    glfwGetWindowSize(window, &w, &h);
    glfwGetFramebufferSize(window, &fw, &fh);
    x *= double(fw) / std::max(w, 1);
    y *= double(fh) / std::max(h, 1);
}

uint32_t modifiers(int mods) {
    return ((mods & GLFW_MOD_SHIFT) ? VCP_SHIFT : 0) | ((mods & GLFW_MOD_CONTROL) ? VCP_CONTROL : 0);
}

// An exception of a callback waits here: GLFW is C, so no exception may pass through it.
std::exception_ptr thrown;

template <class F>
void guarded(GLFWwindow* window, F call) {
    try {
        call(viewOf(window));
    } catch (...) {
        thrown = std::current_exception();
        glfwSetWindowShouldClose(window, GLFW_TRUE);
    }
}

void listen(GLFWwindow* window) {
    glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int x, int y) {
        guarded(w, [=](vcp::widget::View& view) { view.resize(uint32_t(x), uint32_t(y)); });
    });
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
        cursor(w, x, y);
        guarded(w, [=](vcp::widget::View& view) { view.move(x, y); });
    });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double notches) {
        double x, y;
        cursor(w, x, y);
        guarded(w, [=](vcp::widget::View& view) { view.scroll(x, y, notches); });
    });
    glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int mods) {
        const vcp_button which = button == GLFW_MOUSE_BUTTON_LEFT    ? VCP_LEFT
                                 : button == GLFW_MOUSE_BUTTON_RIGHT ? VCP_RIGHT
                                                                     : VCP_MIDDLE;
        double x, y;
        cursor(w, x, y);
        guarded(w, [=](vcp::widget::View& view) {
            action == GLFW_PRESS ? view.press(which, x, y, modifiers(mods)) : view.release(which);
        });
    });
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int) {
        if (key == GLFW_KEY_ESCAPE)
            glfwSetWindowShouldClose(w, GLFW_TRUE);
        else if (action != GLFW_REPEAT)
            guarded(w, [=](vcp::widget::View& view) { view.key(uint32_t(key), action == GLFW_PRESS); });
    });
}

void run(GLFWwindow* window, const char* file, int frames) {
    vcp_context_options options = vcp::widget::sized<vcp_context_options>();
    options.windows = 1;
    vcp::widget::Context context(options);
    context.open(file);

    vcp_view_options how = vcp::widget::sized<vcp_view_options>();
    int width, height;
    glfwGetFramebufferSize(window, &width, &height);
    how.width = uint32_t(width);
    how.height = uint32_t(height);
    how.window_system = VCP_WINDOW_CALLBACK;
    how.create_surface = createSurface;
    how.create_surface_user = window;
    how.moving_frame_ms = 50;
    how.move_seconds = 0.3;
    vcp::widget::View view(context, how);
    glfwSetWindowUserPointer(window, &view);
    listen(window);

    for (int settled = 0; !glfwWindowShouldClose(window) && (frames < 0 || settled < frames);) {
        const vcp_step step = view.update();
        view.render();  // shows the last picture again where nothing changed
        if (step.settled) ++settled;
        glfwWaitEventsTimeout(frames >= 0 ? 0.01 : std::clamp(step.wait_seconds, 0.001, 1.0));
    }
    if (thrown) std::rethrow_exception(thrown);
    const vcp_stats stats = view.stats();
    std::printf("%llu frames, %llu pixels show the surface\n", (unsigned long long)stats.frames,
                (unsigned long long)stats.hit_pixels);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) return std::fprintf(stderr, "usage: glfw_host FILE.vcp [--frames N]\n"), EXIT_FAILURE;
    const int frames = argc > 3 && std::string(argv[2]) == "--frames" ? std::atoi(argv[3]) : -1;
    if (!glfwInit()) return std::fprintf(stderr, "no display\n"), EXIT_FAILURE;
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    GLFWwindow* window = glfwCreateWindow(640, 480, "vcp in GLFW", nullptr, nullptr);
    int status = window ? EXIT_SUCCESS : EXIT_FAILURE;
    try {
        if (window) run(window, argv[1], frames);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        status = EXIT_FAILURE;
    }
    if (window) glfwDestroyWindow(window);
    glfwTerminate();
    return status;
}
