// Channels of materials in pictures: by the host against what is known of a floor, and by shaders against the host.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/built_floor.h"
#include "tests/support/host_comparison.h"
#include "tests/support/renderer_fixture.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

using test::ChannelledFloor, test::normalTexel;

const test::TexelAt kWhite = [](uint32_t, uint32_t) { return 0xffffffu; };

/// Straight from above, with y up in the picture.
Camera above() {
    Camera camera;
    camera.eye = {2, 1.5, 5};
    camera.forward = {0, 0, -1};
    camera.up = {0, 1, 0};
    camera.verticalFov = 0.5;
    return camera;
}

/// A light from one side that lies low, in the world's axes.
FrameRequest lit(const Camera& camera, glm::vec3 light) {
    FrameRequest request = test::requestOf(camera);
    request.shading.lightFollowsCamera = false;
    request.shading.lightDirection = light;
    return request;
}

class ChannelPictures : public test::RendererFixture {
protected:
    /// Returns the picture of a floor by the host.
    [[nodiscard]] test::Planes shown(const ChannelledFloor& floor, const FrameRequest& request) const {
        const auto host = HostRenderer::create({});
        EXPECT_TRUE(host && (*host)->open({test::builtFloor(floor, folder_.path())}, {}));
        return test::drawnBy(**host, request);
    }
    /// Returns a channel in the middle of such a picture, 0 to 255.
    [[nodiscard]] int middle(const ChannelledFloor& floor, const FrameRequest& request, size_t channel = 1) const {
        const test::Planes planes = shown(floor, request);
        const size_t pixel = size_t{request.height / 2} * request.width + request.width / 2;
        return planes.picture.rgba[4 * pixel + channel];
    }

    TestFolder folder_{"vcp_channels"};
};

/// A floor all of which leans, not metal and matt.
ChannelledFloor leaning(double right, double up) {
    ChannelledFloor floor;
    floor.colour = [](uint32_t, uint32_t) { return 0xa0a0a0u; };
    floor.normals = [=](uint32_t, uint32_t) { return normalTexel(right, up, 0.8); };
    floor.metalness = 0;
    return floor;
}

TEST_F(ChannelPictures, NormalsLeanTowardsTheLightAsTheirImageDoes) {
    const FrameRequest fromRight = lit(above(), {1, 0, 0.4f}), fromAbove = lit(above(), {0, 1, 0.4f});
    const int flat = middle(leaning(0, 0), fromRight);
    EXPECT_GT(middle(leaning(0.6, 0), fromRight), flat + 30);
    EXPECT_LT(middle(leaning(-0.6, 0), fromRight), flat - 30);
    // What leans up sees more of the sky.
    EXPECT_NEAR(middle(leaning(0, 0.6), fromRight), middle(leaning(0, -0.6), fromRight), 20);
    EXPECT_GT(middle(leaning(0, 0.6), fromAbove), flat + 30) << "green is up";
    EXPECT_LT(middle(leaning(0, -0.6), fromAbove), flat - 30);
    // The image is mirrored: its right is on the left.
    ChannelledFloor mirrored = leaning(0.6, 0);
    mirrored.isMirrored = true;
    EXPECT_LT(middle(mirrored, fromRight), flat - 30);
    mirrored = leaning(0, 0.6);
    mirrored.isMirrored = true;
    EXPECT_GT(middle(mirrored, fromAbove), flat + 30);
    // The mesh is turned by a quarter about z: the image's right is up.
    ChannelledFloor turned = leaning(0.6, 0);
    turned.node = R"(,"rotation":[0,0,0.70710678,0.70710678],"translation":[3.5,-0.5,0])";
    EXPECT_GT(middle(turned, fromAbove), flat + 30);
    EXPECT_NEAR(middle(turned, fromRight), flat, 12);
}

TEST_F(ChannelPictures, WithoutChannelsPicturesAreAsEver) {
    ChannelledFloor floor = leaning(0.6, 0);
    FrameRequest request = lit(above(), {1, 0, 0.4f});
    const test::Planes with = shown(floor, request);
    request.shading.channels = false;
    const test::Planes off = shown(floor, request);
    floor.normals = nullptr;
    request.shading.channels = true;
    EXPECT_TRUE(off.picture.rgba == shown(floor, request).picture.rgba);
    EXPECT_FALSE(with.picture.rgba == off.picture.rgba);
    // Other ways of shading show none.
    floor = leaning(0.6, 0);
    for (const ShadingMode mode : {ShadingMode::Unlit, ShadingMode::Clay, ShadingMode::Normals}) {
        request.shading.mode = mode;
        request.shading.channels = true;
        const test::Planes one = shown(floor, request);
        request.shading.channels = false;
        EXPECT_TRUE(one.picture.rgba == shown(floor, request).picture.rgba);
    }
}

TEST_F(ChannelPictures, EmissionIsSeenInTheDark) {
    ChannelledFloor floor;
    floor.colour = [](uint32_t, uint32_t) { return 0u; };
    floor.emission = [](uint32_t, uint32_t) { return 0x4080c0u; };
    floor.metalness = 1;
    FrameRequest request = test::requestOf(above());
    request.shading.lightStrength = 0;
    EXPECT_NEAR(middle(floor, request, 0), 0xc0, 2);
    EXPECT_NEAR(middle(floor, request, 1), 0x80, 2);
    EXPECT_NEAR(middle(floor, request, 2), 0x40, 2);
}

TEST_F(ChannelPictures, SmoothSurfacesHaveHighlightsAndMetalTheirColour) {
    ChannelledFloor floor;
    floor.colour = [](uint32_t, uint32_t) { return 0x000080u; };  // red
    floor.surface = kWhite;
    floor.metalness = 0;
    floor.roughness = 0.3;
    // The light is where the mirror's is, and where it is not.
    const FrameRequest mirrored = lit(above(), {0, 0, 1}), aside = lit(above(), {1, 0, 0.7f});
    EXPECT_GT(middle(floor, mirrored), 90) << "white highlights on what is no metal";
    EXPECT_LT(middle(floor, aside), 60);
    floor.metalness = 1;
    EXPECT_GT(middle(floor, mirrored, 0), 200);
    EXPECT_LT(middle(floor, mirrored, 1), 10) << "red ones on red metal";
    FrameRequest strong = lit(above(), {1, 0, 0.4f});
    strong.shading.lightStrength = kStrongestLight;
    const int smooth = middle(floor, strong, 0);
    floor.roughness = 1;
    EXPECT_GT(middle(floor, strong, 0), smooth + 30) << "far from the mirror's direction rough ones are brighter";
}

/// A floor on which everything changes.
ChannelledFloor varied() {
    ChannelledFloor floor;
    floor.colour = [](uint32_t x, uint32_t y) { return (100 + x) | (60 + 2 * y) << 8 | 120u << 16; };
    floor.normals = [](uint32_t x, uint32_t y) {
        return normalTexel(0.4 * std::sin(0.3 * x), 0.4 * std::cos(0.25 * y), 0.8);
    };
    floor.surface = [](uint32_t x, uint32_t y) { return (60 + 2 * x) << 8 | (y % 32 < 16 ? 255u : 0u) << 16; };
    floor.emission = [](uint32_t x, uint32_t y) { return x / 8 % 3 == 0 && y / 8 % 3 == 0 ? 0x2040a0u : 0u; };
    return floor;
}

class ChannelDevices : public ChannelPictures, public testing::WithParamInterface<PageAccess> {};

TEST_P(ChannelDevices, DrawAsTheHostDoes) {
    RendererOptions options;
    options.access = GetParam();
    start(options);
    const auto host = HostRenderer::create({});
    const PlacedDataset floor = test::builtFloor(varied(), folder_.path());
    ASSERT_TRUE(host && renderer_->open({floor}) && (*host)->open({floor}, {}));
    Camera slanted = above(), far = above();
    slanted.eye = {5, 5, 2};
    slanted.forward = glm::normalize(glm::dvec3(-3, -3.5, -2));
    slanted.up = {0, 0, 1};
    far.eye.z = 40;
    for (const Camera& camera : {above(), slanted, far})
        for (const int look : {0, 1, 2}) {
            SCOPED_TRACE(testing::Message() << camera.eye.z << " look " << look);
            FrameRequest request = lit(camera, {1, 0.3f, 0.6f});
            if (look == 1) {
                request.shading.environment = environmentNamed("studio");
                request.shading.lightsBeside = true;
                request.shading.moreLights = {DirectedLight{}};
            }
            if (look == 2) request.shading.shadows = true, request.shading.occlusionRays = 4;
            const test::Planes one = test::drawnBy(*renderer_, request), other = test::drawnBy(**host, request);
            uint64_t hits = 0, apart = 0;
            for (size_t i = 0; i < one.depth.size(); ++i) {
                if (!std::isfinite(one.depth[i]) || !std::isfinite(other.depth[i])) continue;
                ++hits;
                apart += test::channelsApart(one.picture, other.picture, i) > 8 ? 1 : 0;
            }
            EXPECT_GT(hits, 100u);
            // The device keeps normals, roughness and colours in bytes, which highlights make the most of.
            EXPECT_LE(apart, hits / 200);
            FrameRequest off = request;
            off.shading.channels = false;
            EXPECT_FALSE(test::drawnBy(*renderer_, off).picture.rgba == one.picture.rgba);
        }
}

INSTANTIATE_TEST_SUITE_P(Access, ChannelDevices, testing::Values(PageAccess::TexelBuffer, PageAccess::StorageBuffer));

}  // namespace
}  // namespace vcp
