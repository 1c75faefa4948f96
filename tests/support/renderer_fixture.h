// A renderer for tests, with validation layers on: every test ends with no message.
#pragma once

#include "tests/support/test_scene.h"

namespace vcp::test {

class RendererFixture : public testing::Test {
protected:
    void start(RendererOptions options = {}) {
        options.validation = true;
        auto made = Renderer::create(options);
        ASSERT_TRUE(made) << made.error().line();
        renderer_ = std::move(*made);
    }
    void show(const Scene& scene) {
        const auto opened = renderer_->open(scene.dataset, scene.source);
        ASSERT_TRUE(opened) << opened.error().line();
    }
    /// Settles and draws.
    FrameStats draw(const FrameRequest& request) {
        const auto update = renderer_->settle(request);
        EXPECT_TRUE(update) << update.error().line();
        const auto stats = renderer_->render(request);
        EXPECT_TRUE(stats) << stats.error().line();
        return *stats;
    }
    void TearDown() override {
        if (!renderer_) return;
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }
    std::unique_ptr<Renderer> renderer_;
};

inline FrameRequest requestOf(const Camera& camera, uint32_t width = 160, uint32_t height = 120) {
    FrameRequest request;
    request.camera = camera;
    request.width = width;
    request.height = height;
    request.errorPixels = 0.2;
    return request;
}

}  // namespace vcp::test
