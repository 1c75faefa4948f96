// Datasets that shade each other: host, device and a reference in double precision.
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "tests/support/host_comparison.h"

namespace vcp {
namespace {

using test::BuiltMesh;
using test::channelsApart;
using test::Difference;
using test::drawnBy;
using test::expectFew;
using test::NamedCamera;
using test::Planes;
using test::requestOf;

constexpr double kCell = 0.04;
const glm::vec3 kLight(0.35, -0.25, 1);
const glm::dvec3 kLo(-2, -2, -0.2), kHi(2, 2, 1);

IndexedMesh plate() { return test::boxMesh({-2, -2, -0.2}, {2, 2, 0}, 24); }
IndexedMesh statue() { return test::torusMesh({0.1, 0.2, 0.6}, 0.9, 0.3, 90, 45); }

IndexedMesh placedIn(const Similarity& placement, IndexedMesh mesh) {
    for (glm::dvec3& p : mesh.positions) p = placement.fromWorld(p);
    return mesh;
}

/// The world's light, and the finest level of all that is seen.
FrameRequest litRequest(const Camera& camera) {
    FrameRequest request = requestOf(camera, 200, 150);
    request.errorPixels = 1e-3;
    request.shading.lightFollowsCamera = false;
    request.shading.lightDirection = kLight;
    request.shading.shadows = true;
    return request;
}

std::vector<NamedCamera> views() {
    const auto fit = [](glm::dvec3 forward) { return fitCamera(kLo, kHi, forward, {0, 0, 1}, 0.6, 4.0 / 3); };
    Camera parallel = fit({0.4, 0.3, -0.8});
    parallel.projection = Projection::Orthographic;
    return {{"from above", fit({0.2, 0.7, -0.8})}, {"low", fit({-0.9, 0.3, -0.25})}, {"parallel", parallel}};
}

class SceneLight : public test::HostRendererTest {
protected:
    /// The plate as it is, and the statue in a space of its own.
    void openTwo(const Similarity& placement = {}) {
        placement_ = placement;
        plate_.emplace(plate(), kCell);
        statue_.emplace(placedIn(placement, statue()), kCell / placement.scale);
        ASSERT_TRUE(plate_->ok() && statue_->ok());
        open({placed(plate_->file()), placed(statue_->file(), placement)});
    }
    /// Whether the sun is seen from a point, in double precision, past the finest level of both.
    [[nodiscard]] bool seesSun(glm::dvec3 from) const {
        const glm::dvec3 light = glm::normalize(glm::dvec3(kLight));
        const auto isFree = [&](const BuiltMesh& mesh, const Similarity& placement) {
            const PageCache& cache = mesh.cache();
            const auto caster = ReferenceCaster::create(cache, cutAtLevel(cache.dataset(), mesh.levels())).value();
            return !caster.cast({placement.fromWorld(from), placement.turnedFromWorld(light)});
        };
        return isFree(*plate_, {}) && isFree(*statue_, placement_);
    }
    std::optional<BuiltMesh> plate_, statue_;
    Similarity placement_;
};

const Similarity kElsewhere{glm::angleAxis(0.8, glm::normalize(glm::dvec3(1, 2, -0.5))), 2.5, {300, -20, 7}};

/// Pixels of `a` and `b`, both hit, whose colours differ clearly.
uint64_t clearlyApart(const Planes& a, const Planes& b) {
    uint64_t count = 0;
    for (size_t i = 0; i < a.depth.size(); ++i)
        count += std::isfinite(a.depth[i]) && channelsApart(a.picture, b.picture, i) > 4 ? 1 : 0;
    return count;
}

TEST_F(SceneLight, HostAndDeviceAgree) {
    openTwo(kElsewhere);
    Difference all;
    for (const NamedCamera& named : views())
        for (const uint32_t sky : {0u, 3u}) {
            SCOPED_TRACE(named.name);
            FrameRequest request = litRequest(named.camera);
            request.shading.occlusionRays = sky;
            all += difference(request, kCell);
            request.shading.shadows = sky == 0;
            request.sections = {{{0.3, 0.1, -1}, -0.75}};
            all += difference(request, kCell);
        }
    expectFew(all);
}

TEST_F(SceneLight, TwoDatasetsCastTheShadowsOfOne) {
    IndexedMesh both = plate();
    test::append(both, statue());
    const BuiltMesh one(both, kCell);
    ASSERT_TRUE(one.ok());
    for (const NamedCamera& named : views())
        for (const uint32_t sky : {0u, 8u}) {
            SCOPED_TRACE(named.name);
            FrameRequest request = litRequest(named.camera);
            request.shading.occlusionRays = sky;
            open(one);
            const Planes together = drawnBy(*host_, request);
            FrameRequest plain = request;
            plain.shading.shadows = false, plain.shading.occlusionRays = 0;
            const Planes bright = drawnBy(*host_, plain);
            for (const Similarity& placement : {Similarity{}, kElsewhere}) {
                openTwo(placement);
                const Planes apart = drawnBy(*host_, request);
                // Occlusion takes its directions from the normal: the same in the world's axes.
                EXPECT_LE(clearlyApart(together, apart), together.depth.size() / 500);
                EXPECT_GT(clearlyApart(apart, bright), 500u);
            }
        }
}

TEST_F(SceneLight, ShadowsAreTheReferences) {
    openTwo(kElsewhere);
    uint64_t dark = 0, wrong = 0, checked = 0;
    for (const NamedCamera& named : views()) {
        FrameRequest request = litRequest(named.camera);
        const Planes lit = drawnBy(*host_, request), device = drawnBy(*renderer_, request);
        request.shading.shadows = false;
        const Planes plain = drawnBy(*host_, request);
        for (uint32_t i = 0; i < lit.depth.size(); i += 23) {
            const glm::dvec3 normal(lit.normals[i]);
            // Where light hardly falls, there is little to darken.
            if (!std::isfinite(lit.depth[i]) || glm::dot(normal, glm::normalize(glm::dvec3(kLight))) < 0.2) continue;
            const PixelHit hit =
                pixelHit(request, {i % request.width, i / request.width}, double(lit.depth[i]), lit.normals[i]);
            const bool isSeen = seesSun(hit.position + 0.4 * kCell * normal);
            ++checked;
            dark += isSeen ? 0 : 1;
            for (const Planes* each : {&lit, &device})
                wrong += (channelsApart(each->picture, plain.picture, i) <= 8) != isSeen ? 1 : 0;
        }
    }
    EXPECT_GT(checked, 1000u);
    EXPECT_GT(dark, 80u);
    EXPECT_LE(wrong, checked / 50) << "of " << checked << ", but at the edges of shadows";
}

TEST_F(SceneLight, WhatIsHiddenCastsNothing) {
    openTwo(kElsewhere);
    FrameRequest request = litRequest(views()[0].camera);
    request.shading.occlusionRays = 4;
    const Planes both = drawnBy(*host_, request), bothByDevice = drawnBy(*renderer_, request);
    FrameRequest without = request;
    without.hidden = {1};
    const Planes host = drawnBy(*host_, without), device = drawnBy(*renderer_, without);
    // And it casts again once it is shown.
    EXPECT_EQ(drawnBy(*host_, request).picture, both.picture);
    EXPECT_EQ(drawnBy(*renderer_, request).picture, bothByDevice.picture);
    open({placed(plate_->file())});
    EXPECT_EQ(host.picture, drawnBy(*host_, request).picture);
    EXPECT_EQ(device.picture, drawnBy(*renderer_, request).picture);
}

/// The light of an encoded channel.
double lightOf(uint8_t channel) { return std::pow(channel / 255.0, 2.2); }

TEST_F(SceneLight, WhatIsTransparentLetsThroughWhatIsBehind) {
    openTwo(kElsewhere);
    for (PictureRenderer* renderer :
         {static_cast<PictureRenderer*>(host_.get()), static_cast<PictureRenderer*>(renderer_.get())}) {
        FrameRequest request = litRequest(views()[0].camera);
        request.shading.shadows = false;
        const Planes solid = drawnBy(*renderer, request, 16);
        request.looks = {{1, {}, 0}};
        const Planes gone = drawnBy(*renderer, request, 16);
        request.looks = {{1, {}, 0.25f}};
        const Planes part = drawnBy(*renderer, request, 16);
        uint64_t checked = 0;
        for (size_t i = 0; i < solid.picture.rgba.size(); i += 4) {
            // Away from edges, where a pixel's samples differ.
            if (channelsApart(solid.picture, gone.picture, i / 4) < 12) continue;
            const double expected = 0.75 * lightOf(gone.picture.rgba[i]) + 0.25 * lightOf(solid.picture.rgba[i]);
            checked += std::abs(lightOf(part.picture.rgba[i]) - expected) < 0.02 ? 1 : 0;
        }
        EXPECT_GT(checked, 500u);
        request.hidden = {1};
        EXPECT_EQ(drawnBy(*renderer, request, 16).picture, gone.picture) << "what is not there is as hidden";
    }
}

TEST_F(SceneLight, LooksByHostAndDevice) {
    openTwo(kElsewhere);
    Difference all;
    for (const NamedCamera& named : views()) {
        FrameRequest request = litRequest(named.camera);
        request.looks = {{0, glm::vec3(0.1f, 0.3f, 0.7f), 1}, {1, glm::vec3(0.8f, 0.1f, 0.1f), 0.6f}};
        all += difference(request, kCell);
        request.shading.shadows = false;
        all += difference(request, kCell);
        const Planes drawn = drawnBy(*host_, request);
        uint64_t red = 0, blue = 0;
        for (size_t i = 0; i < drawn.picture.rgba.size(); i += 4) {
            red += drawn.picture.rgba[i] > drawn.picture.rgba[i + 2] + 20 ? 1 : 0;
            blue += drawn.picture.rgba[i + 2] > drawn.picture.rgba[i] + 20 ? 1 : 0;
        }
        EXPECT_GT(red, 500u);
        EXPECT_GT(blue, 500u);
    }
    expectFew(all);
}

/// Lights from the sides, beside the request's own.
std::vector<DirectedLight> moreLights() {
    return {{false, {-1, 0.3f, 0.6f}, 0.5f}, {true, {0.8f, 0.2f, 0.6f}, 0.3f}, {false, {0.1f, 1, 0.4f}, 0.25f}};
}

TEST_F(SceneLight, SeveralLightsByHostAndDevice) {
    Difference all;
    for (const bool isOne : {true, false}) {
        openTwo(kElsewhere);
        if (isOne) open({placed(statue_->file(), kElsewhere)});
        for (const NamedCamera& named : views())
            for (const uint32_t sky : {0u, 3u}) {
                SCOPED_TRACE(named.name);
                FrameRequest request = litRequest(named.camera);
                request.shading.occlusionRays = sky;
                request.shading.moreLights = moreLights();
                request.shading.lightStrength = 0.7f;
                all += difference(request, kCell);
                request.shading.shadows = false;
                request.shading.moreLights.pop_back();
                all += difference(request, kCell);
            }
    }
    expectFew(all);
}

TEST_F(SceneLight, LightsAddUp) {
    openTwo();
    FrameRequest request = litRequest(views()[0].camera);
    request.shading.clay = glm::vec3(0.3f);
    const std::vector<DirectedLight> lights = moreLights();
    const auto drawnWith = [&](const std::vector<DirectedLight>& with) {
        setLights(request.shading, with);
        return drawnBy(*host_, request);
    };
    // The sky's light, which is in each of them, comes from the camera's up where the first light follows the camera.
    const auto darkWith = [&](const DirectedLight& light) {
        return drawnWith({{light.followsCamera, light.direction, 0}});
    };
    const Planes dark = darkWith(lights.front()), all = drawnWith(lights);
    std::vector<std::pair<Planes, Planes>> single;
    for (const DirectedLight& light : lights) single.emplace_back(drawnWith({light}), darkWith(light));
    uint64_t shaded = 0, checked = 0;
    for (size_t i = 0; i < dark.depth.size(); ++i) {
        if (!std::isfinite(dark.depth[i])) continue;
        double sum = lightOf(dark.picture.rgba[4 * i]);
        for (const auto& [one, without] : single) {
            const double own = lightOf(one.picture.rgba[4 * i]) - lightOf(without.picture.rgba[4 * i]);
            sum += own;
            shaded += own < 1e-6 ? 1 : 0;
        }
        EXPECT_NEAR(lightOf(all.picture.rgba[4 * i]), std::min(sum, 1.0), 0.02);
        ++checked;
    }
    EXPECT_GT(checked, 5000u);
    EXPECT_GT(shaded, 1000u) << "each of them casts its own shadows";
}

TEST_F(SceneLight, OneLightOfStrengthOneIsThePlainLight) {
    openTwo(kElsewhere);
    for (const uint32_t sky : {0u, 2u}) {
        FrameRequest request = litRequest(views()[1].camera);
        request.shading.occlusionRays = sky;
        const Planes host = drawnBy(*host_, request), device = drawnBy(*renderer_, request);
        const uint32_t pipelines = draw(request).pipelines;
        // A light that gives nothing changes nothing, and takes no pipeline.
        request.shading.moreLights = {{false, {0, 0, 1}, 0}};
        EXPECT_EQ(drawnBy(*host_, request).picture, host.picture);
        EXPECT_EQ(drawnBy(*renderer_, request).picture, device.picture);
        EXPECT_EQ(draw(request).pipelines, pipelines);
    }
}

// One dataset alone takes the passes that it took; a second one adds none but those of the scene.
TEST_F(SceneLight, OneDatasetPaysNothing) {
    openTwo();
    FrameRequest request = litRequest(views()[0].camera);
    request.hidden = {1};
    const uint32_t alone = draw(request).pipelines;
    request.hidden.clear();
    EXPECT_GT(draw(request).pipelines, alone);
    start();
    ASSERT_TRUE(renderer_->open({placed(plate_->file())}, {}));
    request.shading.shadows = false;
    EXPECT_EQ(draw(request).pipelines, 3u);
    request.shading.shadows = true;
    EXPECT_EQ(draw(request).pipelines, 5u);
}

TEST_F(SceneLight, StepByStepItIsTheSame) {
    openTwo(kElsewhere);
    if (!renderer_->device().software) GTEST_SKIP() << "only software devices take steps";
    FrameRequest request = litRequest(views()[0].camera);
    request.width = 220, request.height = 165;
    request.shading.occlusionRays = 64;
    const Picture expected = drawnBy(*renderer_, request).picture;
    ASSERT_TRUE(renderer_->update(request));
    ASSERT_TRUE(renderer_->renderAhead(request));
    ASSERT_TRUE(renderer_->isUnfinished());
    for (double part = 0; renderer_->isUnfinished(); part = renderer_->finishedPart()) {
        EXPECT_GE(renderer_->finishedPart(), part);
        ASSERT_TRUE(renderer_->waitForFrame());
        ASSERT_TRUE(renderer_->continueFrame());
    }
    ASSERT_TRUE(renderer_->waitForFrame());
    EXPECT_EQ(*renderer_->readPicture(), expected);
}

TEST_F(SceneLight, SamplesAndTiles) {
    openTwo(kElsewhere);
    FrameRequest request = litRequest(views()[0].camera);
    request.shading.occlusionRays = 2;
    Difference all;
    for (const NamedCamera& named : views()) {
        FrameRequest each = request;
        each.camera = named.camera;
        all += difference(each, kCell, 4);
    }
    expectFew(all, 4);
    const Planes whole = drawnBy(*host_, request);
    request.tile = PictureTile{40, 24, request.width, request.height};
    request.width = 72, request.height = 56;
    const Planes part = drawnBy(*host_, request);
    uint64_t differing = 0;
    for (uint32_t y = 0; y < request.height; ++y)
        for (uint32_t x = 0; x < request.width; ++x)
            for (size_t c = 0; c < 4; ++c)
                differing += std::abs(part.picture.rgba[4 * (size_t{y} * request.width + x) + c] -
                                      whole.picture.rgba[4 * ((size_t{y} + 24) * 200 + x + 40) + c]) > 24
                                 ? 1
                                 : 0;
    EXPECT_LE(differing, 40u);
}

}  // namespace
}  // namespace vcp
