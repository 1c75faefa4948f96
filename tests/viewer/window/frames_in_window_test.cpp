// Frames in flight in a real window, with validation layers on; skipped where there is no display.
#include <cmath>

#include <gtest/gtest.h>

#define GLFW_INCLUDE_NONE
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

using test::Scene;

class FramesInWindow : public test::RendererFixture {
protected:
    void SetUp() override {
        hasDisplay_ = glfwInit() == GLFW_TRUE && glfwVulkanSupported() == GLFW_TRUE;
        if (!hasDisplay_) GTEST_SKIP() << "there is no display";
        glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    }
    void TearDown() override {
        RendererFixture::TearDown();
        renderer_.reset();
        glfwTerminate();
    }
    static SurfaceSource surfaceOf(GLFWwindow* window) {
        SurfaceSource source;
        uint32_t count = 0;
        const char** names = glfwGetRequiredInstanceExtensions(&count);
        source.instanceExtensions.assign(names, names + count);
        source.createSurface = [window](VkInstance instance, VkSurfaceKHR* surface) {
            return glfwCreateWindowSurface(instance, window, nullptr, surface);
        };
        return source;
    }
    static FrameRequest requestOf(const Scene& scene, int n, uint32_t part) {
        const double angle = 0.2618 * n;
        const Camera camera =
            fitCamera(scene.boxMin, scene.boxMax, {std::cos(angle), -0.4, std::sin(angle)}, {0, 1, 0}, 0.6, 1.5);
        return test::requestOf(camera, 192 / part, 128 / part);
    }
    void drawAhead(const FrameRequest& request) {
        EXPECT_TRUE(renderer_->waitForFrame());
        EXPECT_TRUE(renderer_->update(request));
        EXPECT_TRUE(renderer_->renderAhead(request));
    }

    bool hasDisplay_ = false;
};

// Pictures of two sizes, as while a camera moves, in a window that is resized, and that goes with all in flight.
TEST_F(FramesInWindow, AreResizedAndClosed) {
    const Scene scene = test::sphereScene();
    for (const bool isSeparate : {false, true}) {
        SCOPED_TRACE(isSeparate);
        glm::ivec2 size(200, 150);
        GLFWwindow* const windows[] = {glfwCreateWindow(size.x, size.y, "first", nullptr, nullptr),
                                       glfwCreateWindow(size.x, size.y, "second", nullptr, nullptr)};
        ASSERT_TRUE(windows[0] && windows[1]);
        const auto present = [&] {
            glfwPollEvents();
            const auto shown = renderer_->present(uint32_t(size.x), uint32_t(size.y));
            EXPECT_TRUE(shown) << shown.error().line();
        };
        RendererOptions options;
        options.surface = surfaceOf(windows[0]);
        options.faults.separateMemory = options.faults.separateCopies = isSeparate;
        start(options);
        show(scene);
        draw(requestOf(scene, 0, 1));
        present();
        for (int step = 0; step < 24; ++step) {
            if (step % 8 == 7) {
                size += 40;
                glfwSetWindowSize(windows[0], size.x, size.y);
            }
            drawAhead(requestOf(scene, step, uint32_t(step / 3 % 2 + 1)));  // moving: at a half
            present();
            present();  // as when only panels change
        }
        auto second = renderer_->addView(surfaceOf(windows[1]));
        ASSERT_TRUE(second) << second.error().line();
        drawAhead(requestOf(scene, 5, 1));
        present();
        renderer_ = std::move(*second);
        glfwDestroyWindow(windows[0]);
        drawAhead(requestOf(scene, 6, 1));
        present();
        drawAhead(requestOf(scene, 7, 1));
        present();
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
        renderer_.reset();
        glfwDestroyWindow(windows[1]);
    }
}

// What presents of the frame before the last, and nothing else, may make a frame of the window wait.
TEST_F(FramesInWindow, AMovingFrameWaitsOnceAtMost) {
    const Scene scene = test::sphereScene();
    GLFWwindow* const window = glfwCreateWindow(200, 150, "moving", nullptr, nullptr);
    ASSERT_TRUE(window);
    RendererOptions options;
    options.surface = surfaceOf(window);
    options.faults.separateMemory = true;
    start(options);
    show(scene);
    for (int step = 0; step < 12; ++step) draw(requestOf(scene, step, 1));
    for (int step = 0; step < 12; ++step) {
        const FrameRequest request = requestOf(scene, step, 1);
        const auto updated = renderer_->update(request);
        ASSERT_TRUE(updated);
        EXPECT_EQ(updated->hostWaits, 0u);
        ASSERT_TRUE(renderer_->renderAhead(request));
        ASSERT_TRUE(renderer_->present(200, 150));
        const FrameStats& stats = renderer_->lastDone()->stats;
        EXPECT_LE(stats.hostWaits, 1u);
        EXPECT_LE(stats.submissions, 2u) << "one that draws and one that presents";
        glfwPollEvents();
    }
    for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    renderer_.reset();
    glfwDestroyWindow(window);
}

}  // namespace
}  // namespace vcp
