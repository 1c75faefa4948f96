// Images on the device: pictures by the shaders against those by the host, whose filter is held against its definition.
#include <gtest/gtest.h>

#include "tests/support/built_walls.h"
#include "tests/support/host_comparison.h"
#include "tests/support/renderer_fixture.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

/// Walls with images that have details of every size.
class ImageTest : public test::RendererFixture, public testing::WithParamInterface<PageAccess> {
protected:
    void SetUp() override {
        const auto texel = [](uint32_t x, uint32_t y) {
            return (x * 5 + y * 3) % 256 | ((x / 8 + y / 8) % 2 == 0 ? 200u : 30u) << 8 | (x * y % 256) << 16;
        };
        walls_ = test::builtWalls(folder_.path(), texel, texel);
        ASSERT_TRUE(walls_.dataset);
    }

    /// From afar, from near, along the floor, so near that a texel is many pixels wide, and without perspective.
    static std::vector<Camera> cameras() {
        std::vector<Camera> cameras;
        const auto look = [&](glm::dvec3 eye, glm::dvec3 at) {
            Camera camera;
            camera.eye = eye;
            camera.forward = glm::normalize(at - eye);
            camera.up = {0, 0, 1};
            camera.verticalFov = 0.7;
            cameras.push_back(camera);
        };
        look({9, 8, 7}, {2, 1, 1});
        look({40, 35, 30}, {2, 1, 1});
        look({3, 2.5, 1.5}, {1.5, 0.5, 0.5});
        look({3.9, 2.9, 0.05}, {0.5, 0.3, 0});
        look({1.1, 0.9, 0.1}, {1, 0.8, 0});
        look({9, 8, 7}, {2, 1, 1});
        cameras.back().projection = Projection::Orthographic;
        cameras.back().orthographicHeight = 5;
        return cameras;
    }

    static FrameRequest unlit(const Camera& camera) {
        FrameRequest request = test::requestOf(camera);
        request.shading.mode = ShadingMode::Unlit;
        return request;
    }

    /// Returns the bytes of a settled picture; none where the device was lost as it was read.
    static std::vector<uint8_t> shown(Renderer& renderer, const FrameRequest& request) {
        EXPECT_TRUE(renderer.drawSettled(request));
        const auto picture = renderer.readPicture();
        return picture ? picture->rgba : std::vector<uint8_t>();
    }

    /// Draws as the device does and as the host does. Returns how many pixels differ in colour, and their mean
    /// difference in the steps of a channel.
    std::pair<uint64_t, double> apart(Renderer& device, HostRenderer& host, const FrameRequest& request) {
        const test::Planes one = test::drawnBy(device, request), other = test::drawnBy(host, request);
        uint64_t hits = 0, far = 0;
        double sum = 0;
        for (size_t i = 0; i < one.depth.size(); ++i) {
            if (!std::isfinite(one.depth[i]) || !std::isfinite(other.depth[i])) continue;
            ++hits;
            const int channels = test::channelsApart(one.picture, other.picture, i);
            sum += channels;
            far += channels > 12 ? 1 : 0;
        }
        EXPECT_GT(hits, 100u);
        return {far, sum / double(std::max<uint64_t>(hits, 1))};
    }

    TestFolder folder_{"vcp_image_test"};
    PlacedDataset walls_;
};

TEST_P(ImageTest, PicturesAreThoseOfTheHost) {
    RendererOptions options;
    options.access = GetParam();
    start(options);
    const auto host = HostRenderer::create({});
    ASSERT_TRUE(host);
    ASSERT_TRUE(renderer_->open({walls_}));
    ASSERT_TRUE((*host)->open({walls_}, {}));
    for (const Camera& camera : cameras()) {
        SCOPED_TRACE(glm::length(camera.eye));
        const auto [far, mean] = apart(*renderer_, **host, unlit(camera));
        // The host finds footprints once for a stretch of a triangle, and pixels at its edges may see another wall.
        EXPECT_LE(far, 60u);
        EXPECT_LT(mean, 0.8);
    }
}

TEST_P(ImageTest, AreNotOfOtherColours) {
    RendererOptions options;
    options.access = GetParam();
    start(options);
    RendererOptions without;
    without.colour = false;
    const auto host = HostRenderer::create(without);
    ASSERT_TRUE(host);
    ASSERT_TRUE(renderer_->open({walls_}));
    ASSERT_TRUE((*host)->open({walls_}, {}));
    EXPECT_GT(apart(*renderer_, **host, unlit(cameras()[2])).second, 20);
}

TEST_P(ImageTest, CoarserOnesDoWhereTheBudgetIsSmall) {
    RendererOptions options;
    options.access = GetParam();
    options.budgetBytes = (uint64_t{1} << 20) + 30000;
    start(options);
    const auto host = HostRenderer::create({});
    ASSERT_TRUE(host);
    ASSERT_TRUE(renderer_->open({walls_}));
    ASSERT_TRUE((*host)->open({walls_}, {}));
    EXPECT_LT(apart(*renderer_, **host, unlit(cameras()[1])).second, 0.8) << "from afar";
    const double near = apart(*renderer_, **host, unlit(cameras()[2])).second;
    EXPECT_GT(near, 3) << "30,000 bytes do not hold the finest level of the floor";
    EXPECT_LT(near, 50);
}

TEST_P(ImageTest, ALostDeviceOfMemoryOfItsOwnShowsThemAgain) {
    RendererOptions options;
    options.access = GetParam();
    start(options);
    ASSERT_TRUE(renderer_->open({walls_}));
    const FrameRequest request = unlit(cameras()[2]);
    const std::vector<uint8_t> expected = shown(*renderer_, request);
    options.faults.separateMemory = true;
    options.faults.lostAtSubmission = 6;
    start(options);
    ASSERT_TRUE(renderer_->open({walls_}));
    uint32_t losses = 0;
    for (int i = 0; i < 20 && losses == 0; ++i) {
        static_cast<void>(shown(*renderer_, request));
        losses = renderer_->update(request)->deviceLosses;
    }
    EXPECT_EQ(losses, 1u);
    EXPECT_EQ(shown(*renderer_, request), expected);
}

TEST_P(ImageTest, TheProcessorShowsThemForASoftwareDevice) {
    RendererOptions options;
    options.access = GetParam();
    options.hostRays = true;
    start(options);
    if (!renderer_->device().software) GTEST_SKIP() << "of software devices";
    const auto host = HostRenderer::create({});
    ASSERT_TRUE(host);
    ASSERT_TRUE(renderer_->open({walls_}));
    ASSERT_TRUE((*host)->open({walls_}, {}));
    const FrameRequest request = unlit(cameras()[2]);
    EXPECT_EQ(test::drawnBy(*renderer_, request).picture.rgba, test::drawnBy(**host, request).picture.rgba);
}

INSTANTIATE_TEST_SUITE_P(Access, ImageTest, testing::Values(PageAccess::TexelBuffer, PageAccess::StorageBuffer),
                         [](const auto& access) {
                             return access.param == PageAccess::TexelBuffer ? "texels" : "storage";
                         });

}  // namespace
}  // namespace vcp
